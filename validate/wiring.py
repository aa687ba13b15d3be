"""Are the inputs wired as declared? A test on the accelerations alone, before anything is searched for.

A wrong wiring makes every other fit meaningless, so it is looked at first: the regression of the smoothed
accelerations under each wiring, gains having the sign that geometry says. Every log may have coefficients and a lag of
its inputs of its own, so that neither a clock nor anything else that the model lacks can pass for a wiring. Two wirings
are compared block by block; the blocks are long against the memory of the errors, so that their differences are
independent, whatever the noise. Coefficients that are free in every log can follow the noise, more of them under one
wiring than under another (gains have a sign); the wiring must therefore also stand with the same coefficients in all
logs. And under it the inputs must drive the vessel where it goes: a propeller whose thrust comes and goes unlogged can
be followed best as one that is reversed and pushes by its other terms alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy import stats

from identify.effect import Active
from identify.regression import predicted, regressors, solve_regression
from identify.slopes import accelerations, averaged
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters
from validate.candidates import wirings

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
#: Regressors (n, terms) and accelerations (n, 3).
Rows = tuple[FloatArray, FloatArray]

#: Length of a block, s.
BLOCK = 10.0
#: Accelerations are slopes over this time either way, s, and regressors averaged to match: noise must not decide.
SLOPE = 1.5
#: Inputs may be this late or early in each log, s, in steps of; rows that are used, one in.
LAG, LAG_STEP, THIN = 2.0, 0.25, 3
#: A wiring that beats the declared one looks alike where the best one beats it by fewer standard errors than this.
CLEARLY_BETTER = 3.0
#: With shared coefficients it must beat the declared one by so many standard errors; lags are found in so many turns.
STANDS, TURNS = 1.0, 3
#: A wiring is believed wrong where chance would say so in fewer than this share of campaigns.
FALSE_ALARM = 0.01


@dataclass(frozen=True)
class Wiring:
    """A wiring that the data prefer to the declared one: z of the blocks' differences, and its p-value.

    ``tried`` lists every wiring with the z by which the declared one loses to it.
    """

    active: Active
    z: float
    p_value: float
    look_alikes: tuple[str, ...]
    tried: tuple[tuple[Active, float], ...]


def misfit_by_block(structure: Structure, stretches: Sequence[Stretch], shared: bool = False) -> FloatArray:
    """Squared error of the regression (blocks,), each acceleration in units of its standard deviation.

    Coefficients are each stretch's own, or ``shared`` by all; the lag of the inputs is always each stretch's own.
    """
    parts = [_averaged(structure, s) for s in stretches]
    scale = np.vstack([t for _, t in parts]).std(axis=0) + 1e-12
    laid = [_at_lags(structure, s.h, *part) for s, part in zip(stretches, parts, strict=True)]
    if shared:
        errors = _shared(structure, laid, scale)
    else:
        errors = [_own(structure, lags, scale) for lags in laid]
    return np.concatenate([_in_blocks(e, s.h) for e, s in zip(errors, stretches, strict=True)])


def _at_lags(structure: Structure, h: float, design: FloatArray, target: FloatArray) -> list[Rows]:
    """The rows of one stretch at every lag of its inputs."""
    moving = [k for k, t in enumerate(structure.table.terms) if t.role in ("thrust", "rudder")]
    found = []
    for lag in np.arange(-LAG, LAG + LAG_STEP / 2, LAG_STEP):
        late = design.copy()
        late[:, moving] = _shifted(design[:, moving], round(lag / h))
        found.append((late, target))
    return found


def _coefficients(structure: Structure, rows: Sequence[Rows]) -> FloatArray:
    thin = slice(None, None, THIN)
    design, target = (np.vstack([part[k][thin] for part in rows]) for k in (0, 1))
    return solve_regression(structure, null_parameters(structure), design, target)


def _errors(structure: Structure, p: FloatArray, rows: Rows, scale: FloatArray) -> FloatArray:
    """Squared errors (n,) of some rows under given coefficients."""
    return np.asarray(np.sum(((rows[1] - predicted(structure, p, rows[0])) / scale) ** 2, axis=1))


def _own(structure: Structure, lags: Sequence[Rows], scale: FloatArray) -> FloatArray:
    """Squared errors of one stretch under its own coefficients, at the lag that leaves least."""
    return min((_errors(structure, _coefficients(structure, [x]), x, scale) for x in lags), key=np.sum)


def _shared(structure: Structure, laid: Sequence[Sequence[Rows]], scale: FloatArray) -> list[FloatArray]:
    """Squared errors per stretch under common coefficients: lags and coefficients in turn."""
    chosen = [lags[len(lags) // 2] for lags in laid]
    for _ in range(TURNS):
        p = _coefficients(structure, chosen)
        errors = [[_errors(structure, p, x, scale) for x in lags] for lags in laid]
        best = [int(np.argmin([e.sum() for e in each])) for each in errors]
        chosen = [lags[k] for lags, k in zip(laid, best, strict=True)]
    p = _coefficients(structure, chosen)
    return [_errors(structure, p, x, scale) for x in chosen]


def _in_blocks(errors: FloatArray, h: float) -> FloatArray:
    size = max(1, round(BLOCK / h))
    edges = np.arange(0, max(len(errors) - size // 2, 1), size)
    return np.asarray(np.add.reduceat(errors, edges), dtype=float)


def _shifted(columns: FloatArray, steps: int) -> FloatArray:
    """Columns ``steps`` later, the ends held."""
    rows = np.clip(np.arange(len(columns)) - steps, 0, len(columns) - 1)
    return columns[rows]


def _averaged(structure: Structure, stretch: Stretch) -> tuple[FloatArray, FloatArray]:
    """Regressors (n, terms) and accelerations (n, 3) over the same parabolic window: the least-squares slope's own."""
    m = max(1, min(round(SLOPE / stretch.h), stretch.steps // 4))
    return averaged(regressors(structure, null_parameters(structure), stretch), m), accelerations(stretch, m)


def better_wiring(structure: Structure, stretches: Sequence[Stretch]) -> Wiring | None:
    """The wiring that the accelerations prefer to the declared one, where they clearly do."""
    best = min(_compared(structure, stretches), key=lambda x: float(x[1].sum()), default=None)
    if best is None or best[0].p_value > FALSE_ALARM:
        return None
    return best[0] if _stands(structure, stretches, best[0].active, STANDS) else None


def perhaps_wired(structure: Structure, stretches: Sequence[Stretch], most: int) -> list[Wiring]:
    """Wirings that the accelerations prefer, if not clearly, best first: worth a fit where no fit comes near."""
    preferred = sorted((w for w, _ in _compared(structure, stretches) if w.z > 0.0), key=lambda w: -w.z)
    return list(islice((w for w in preferred if _stands(structure, stretches, w.active, 0.0)), most))


def _compared(structure: Structure, stretches: Sequence[Stretch]) -> list[tuple[Wiring, FloatArray]]:
    """Every wiring with what speaks for it, and its squared errors by block."""
    actives = wirings(structure)
    if not actives or "u" not in structure.model.predicts:
        return []
    declared = misfit_by_block(structure, stretches)
    errors = [(a, misfit_by_block(structure.with_effect(a), stretches)) for a in actives]
    tried = tuple((a, _z(declared, e)) for a, e in errors)
    found = []
    for (active, mine), (_, z) in zip(errors, tried, strict=True):
        alike = [
            a.label
            for a, e in errors
            if a is not active and e.sum() < declared.sum() and _z(e, mine) < CLEARLY_BETTER
        ]
        p_value = min(1.0, len(actives) * float(stats.norm.sf(z)))
        found.append((Wiring(active, z, p_value, tuple(alike), tried), mine))
    return found


def _stands(structure: Structure, stretches: Sequence[Stretch], active: Active, least: float) -> bool:
    """Whether a wiring is better with the same coefficients in all logs too, and drives the vessel where it goes."""
    wired = structure.with_effect(active)
    shared = (misfit_by_block(x, stretches, shared=True) for x in (structure, wired))
    return _z(*shared) >= least and _drives(structure, wired, stretches)


def _drives(declared: Structure, wired: Structure, stretches: Sequence[Stretch]) -> bool:
    """Whether the gains whose sign is known work on the vessel's way ahead, where the wiring changes any of them."""
    gains = [t.positive and t.dof == "u" for t in wired.table.terms]
    as_declared, parts = ([_averaged(x, s) for s in stretches] for x in (declared, wired))
    if all(
        np.array_equal(a[:, gains], b[:, gains]) for (a, _), (b, _) in zip(as_declared, parts, strict=True)
    ):
        return True
    p = _coefficients(wired, parts)
    work = 0.0
    for (design, _), stretch in zip(parts, stretches, strict=True):
        pushed = predicted(wired, p, np.where(gains, design, 0.0))[:, 0]
        work += float(pushed @ stretch.states[: len(pushed), 3])
    return work > 0.0


def _z(one: FloatArray, other: FloatArray) -> float:
    """By how many standard errors ``other`` is better, from bounded differences so that no block decides alone."""
    quiet = 0.1 * float(np.mean(other))
    difference = (one - other) / (one + other + quiet)
    spread = float(np.std(difference, ddof=1)) if len(difference) > 2 else np.inf
    return float(np.mean(difference) / max(spread / np.sqrt(len(difference)), 1e-12))
