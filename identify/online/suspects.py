"""What a model that has stopped fitting looks like: the library's effects, fitted to the blocks since the change.

Before the change the model was known, with the uncertainty that it had; since then, each effect in turn may act as
well. The blocks' first states are free, the model's own parameters free within what was known of them, the effect's
own parameters wholly. The gain in likelihood over the model alone is judged by its χ² distribution, times the number of
candidates that were tried, and corrected by how much the errors were dispersed before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from identify.effect import Active, Variant
from identify.effects import EFFECTS
from identify.effects.propulsion import THRUST_ASYMMETRY, THRUSTERS
from identify.fit import Estimated
from identify.online.horizon import Horizon, duration, fitted_firsts, problem_of, promised, update, with_noise
from identify.online.knowledge import Estimate, Noise, nothing_known
from identify.output_error import Prior, Stopped
from identify.report_fit import fitted_effect
from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Names of what came before the change and what came since: effects on loading act in one of them.
BEFORE, SINCE = "before", "since"
#: Chance that an effect is named where there is none.
FALSE_NAME = 0.01
#: Costs that differ by less cannot be told apart (odds of 20 to 1).
INDISTINCT = 6.0
#: An effect explains a change where the errors that it leaves are no larger than this many standard deviations.
EXPLAINED = 3.5
#: Searches at most for one effect, and effects that are searched for: those that promise most at first sight.
ROUNDS, REFITTED = 10, 7
#: Effects that cannot set in while sailing, or would look like others from one moment on.
NEVER = (
    "thrust_fade", "input_wiring", "actuator_lag", "roll_coupling", "thrust_loss_with_speed", "cross_terms",
    "linear_damping", "rudder_flow",
)  # fmt: skip


@dataclass(frozen=True)
class Suspect:
    """An effect that was tried.

    Attributes
    ----------
    active : Active
    parameters : tuple of Estimated
        As they are reported, without errors.
    gain : float
        In -2 log likelihood over the model alone.
    p_value : float
        Of the gain, the number of candidates counted.
    left : float
        Errors that it leaves, in standard deviations above what they should be.
    p : (np,)
        All parameters, the effect's among them.
    """

    active: Active
    parameters: tuple[Estimated, ...]
    gain: float
    p_value: float
    left: float
    p: FloatArray

    @property
    def label(self) -> str:
        """The effect's name, and the input that it is on."""
        variant = self.active.variant
        kept = [str(v) for k, v in variant.options.items() if k != "logs"]
        parts = [p for p in (variant.input, *kept) if p]
        return self.active.effect.name + (f" ({', '.join(parts)})" if parts else "")


@dataclass(frozen=True)
class Suspicion:
    """What the blocks since a change look like.

    Attributes
    ----------
    suspects : tuple of Suspect
        Best first.
    excess : float
        Errors of the model alone, in standard deviations above what they should be.
    seconds : float
        Of data since the change.
    """

    suspects: tuple[Suspect, ...]
    excess: float
    seconds: float

    @property
    def named(self) -> tuple[Suspect, ...]:
        """The effects that it may be: significant, explaining, and not worse than the best; empty: nothing known."""
        best = next((s for s in self.suspects if s.p_value < FALSE_NAME), None)
        if best is None or best.left > EXPLAINED:
            return ()
        near = [s for s in self.suspects if s.gain > best.gain - INDISTINCT and s.left <= EXPLAINED]
        return tuple(s for s in near if s.p_value < FALSE_NAME)


def candidates(structure: Structure) -> list[Active]:
    """Every effect of the library that could have set in; a thruster by itself may have lost thrust, too."""
    taken = {a.label for a in structure.actives}
    setting = replace(structure.setting, logs=(BEFORE, SINCE), identify_logs=(BEFORE, SINCE))
    known = [
        Active(e, v) for e in EFFECTS if e.name not in NEVER for v in e.variants(setting) if not v.besides
    ]
    kinds = {i.name: i.kind for i in structure.inputs if i.kind in THRUSTERS}
    alone = [Active(THRUST_ASYMMETRY, Variant(n)) for n in kinds]
    labels = {a.label: a for a in (*known, *alone)}
    return [a for label, a in labels.items() if label not in taken]


def suspects(
    structure: Structure, known: Estimate, noise: Noise, blocks: Sequence[Stretch], scale: float,
    earlier: Suspicion | None = None,
) -> Suspicion:  # fmt: skip
    """Try every candidate on the blocks since a change.

    Parameters
    ----------
    structure : Structure
    known : Estimate
        Of before the change.
    noise : Noise
        Of before the change.
    blocks : sequence of Stretch
    scale : float
        Mean of the squared whitened errors before the change, over what it should have been.
    earlier : Suspicion, optional
        What fewer of the blocks looked like; its effects are searched for from where they were found, too.
    """
    weights = replace(noise, inflation=noise.inflation * noise.dispersion)
    since = tuple(with_noise(replace(b, name=SINCE), noise) for b in blocks)
    problem = problem_of(since, noise)
    freedom = float(problem.rows - 6 * len(since))
    alone = _refined(_start(structure, known, structure, known.p, since, weights))
    if alone is None:
        return Suspicion((), float("inf"), 0.0)
    tried = candidates(structure)
    found_before = {s.active.label: s.p for s in (earlier.suspects if earlier else ())}
    screened = sorted(
        (s for a in tried for s in _starts(structure, known, a, since, weights, found_before.get(a.label))),
        key=lambda s: s.promised,
    )
    found: dict[str, Suspect] = {}
    for start in screened:
        active = start.horizon.structure.actives[-1]
        if active.label in found or len(found) >= REFITTED:
            continue
        fitted = _refined(start)
        if fitted is None:
            continue
        gain = max(alone.cost - fitted.cost, 0.0) / max(scale, 1.0)
        count = sum(s.effect == len(structure.actives) for s in fitted.structure.slots)
        p_value = min(1.0, float(stats.chi2.sf(gain, count)) * len(tried))
        left = _excess(_misfit(fitted, since, noise), freedom, scale)
        found[active.label] = Suspect(active, _readable(fitted), gain, p_value, left, fitted.p)
    ranked = tuple(sorted(found.values(), key=lambda s: -s.gain))
    return Suspicion(ranked, _excess(_misfit(alone, since, noise), freedom, scale), sum(map(duration, since)))


@dataclass(frozen=True)
class _Start:
    """Where a search begins, the cost that the first step promises, and what is to be added to the search's cost."""

    horizon: Horizon
    promised: float
    constant: float


def _start(
    base: Structure, known: Estimate, structure: Structure, p: FloatArray, since: tuple[Stretch, ...],
    weights: Noise,
) -> _Start:  # fmt: skip
    """A structure on the blocks, its own parameters free within what was known of the model's."""
    size = len(structure.slots)
    place = {structure.key(s): k for k, s in enumerate(structure.slots)}
    pairs = [(k, place[base.key(s)]) for k, s in enumerate(base.slots) if base.key(s) in place]
    old, new = (np.array(x) for x in zip(*pairs, strict=True))
    past, own = nothing_known(size), marginal(known.information, old)
    past.information[np.ix_(new, new)] = own
    past.vector[new] = own @ known.p[old]
    constant = float(known.p[old] @ own @ known.p[old])
    prior = Prior(np.zeros(size), np.full(size, np.inf))
    first = fitted_firsts(structure, p, since, weights)
    horizon = Horizon(structure, prior, p, weights, past, since, first)
    return _Start(horizon, promised(horizon) + constant, constant)


def marginal(information: FloatArray, kept: np.ndarray[tuple[int, ...], np.dtype[np.intp]]) -> FloatArray:
    """Information on some parameters, whatever the others are."""
    others = np.setdiff1d(np.arange(len(information)), kept)
    inside = information[np.ix_(kept, kept)]
    if not len(others):
        return inside
    across = information[np.ix_(kept, others)]
    return np.asarray(inside - across @ np.linalg.solve(information[np.ix_(others, others)], across.T), float)


def _starts(
    base: Structure, known: Estimate, active: Active, since: tuple[Stretch, ...], weights: Noise,
    before: FloatArray | None,
) -> list[_Start]:  # fmt: skip
    """An effect at each of the values where a search for it begins, and where it was found ``before``."""
    wide = base.with_effect(active)
    at_null = wide.carried(known.p, base)
    mine = [k for k, s in enumerate(wide.slots) if s.effect == len(base.actives) and s.coefficient < 0]
    lists = [wide.slots[k].parameter.starts or (wide.slots[k].parameter.null,) for k in mine]
    found = [] if before is None else [_start(base, known, wide, before, since, weights)]
    for j in range(max(map(len, lists), default=1)):
        p = at_null.copy()
        p[mine] = [x[j % len(x)] for x in lists]
        found.append(_start(base, known, wide, p, since, weights))
    return [s for s in found if np.isfinite(s.promised)]


@dataclass(frozen=True)
class _Fitted:
    """A structure fitted to the blocks: parameters, cost, and whitened errors per block."""

    structure: Structure
    p: FloatArray
    cost: float
    residuals: tuple[FloatArray, ...]


def _refined(start: _Start) -> _Fitted | None:
    horizon = start.horizon
    for _ in range(ROUNDS):
        horizon, solution = update(horizon, None)
        if not np.isfinite(solution.cost):
            return None
        if solution.stopped is Stopped.CONVERGED:
            break
    cost = solution.cost + start.constant
    return _Fitted(horizon.structure, horizon.p, cost, solution.moments.residuals)


def _misfit(fitted: _Fitted, since: tuple[Stretch, ...], noise: Noise) -> float:
    """Squared errors in units of their size before the change (weights without dispersion)."""
    total = 0.0
    for block, residual in zip(since, fitted.residuals, strict=True):
        kind = block.samples.kind
        total += float(np.sum(residual**2 * (noise.dispersion[kind] ** 2)[:, None]))
    return total


def _excess(misfit: float, freedom: float, scale: float) -> float:
    """How many standard deviations a sum of squares is above what it should be."""
    return (misfit / scale - freedom) / float(np.sqrt(2.0 * freedom))


def _readable(fitted: _Fitted) -> tuple[Estimated, ...]:
    index = len(fitted.structure.actives) - 1
    effect, _ = fitted_effect(fitted.structure, fitted.p, np.zeros((len(fitted.p),) * 2), index)
    return effect.parameters
