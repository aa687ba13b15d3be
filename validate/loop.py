"""The loop: find what is missing, take it, look again, and check that everything taken still stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from identify.base_fit import Fitted, window_length
from identify.effect import Active
from identify.noise import calibrated
from identify.output_error import solve
from identify.prepare import Prepared
from identify.windows import cut, first_states
from identify.base_fit import fit_from_scratch
from validate.candidates import Screened, candidates, prior_of, screen
from validate.judgement import INDISTINCT, Judged, judge, under, worthwhile

#: Candidates that are refitted in each round.
FINALISTS = 8
#: No campaign lacks more than this many effects that can be found.
MOST_EFFECTS = 4
#: Length of the windows for the first, rough pass, s.
ROUGH = 10.0


@dataclass(frozen=True)
class Turn:
    """One round: the fit without, all screened candidates, those that were refitted, and what was taken."""

    base: Fitted
    screened: tuple[Screened, ...]
    judged: tuple[Judged, ...]
    taken: Judged | None


@dataclass(frozen=True)
class Outcome:
    """Where the loop ended: the last fit, its rounds, and for every effect taken its gain and look-alikes."""

    declared: Fitted
    fitted: Fitted
    turns: tuple[Turn, ...]
    standing: tuple[Standing, ...]


@dataclass(frozen=True)
class Standing:
    """An effect in the last fit: what dropping it would cost, its p-value, and what could stand in its place."""

    active: Active
    gain: float
    p_value: float
    look_alikes: tuple[str, ...]


def search(prepared: Prepared, report: Callable[[str], None] = lambda _: None) -> Outcome:
    """Search for what the declared model lacks, on the logs to identify on."""
    rough = fit_rough(prepared)
    turns: list[Turn] = []
    rough = _rounds(rough, turns, report)
    fine = refined(rough)
    fine = _rounds(fine, turns, report)
    fine = _pruned(fine, report)
    standing = _standing(fine, report)
    return Outcome(rough, fine, tuple(turns), standing)


def fit_rough(prepared: Prepared) -> Fitted:
    """The declared model on short windows, in which even a poor model cannot run far."""
    return fit_from_scratch(prepared.structure, prepared.identify, length=ROUGH)


def refined(fitted: Fitted) -> Fitted:
    """The same structure on long windows, weights from its own errors."""
    structure, p = fitted.solution.structure, fitted.solution.p
    problem = cut(fitted.problem.stretches, window_length(structure.vessel.length))
    problem = problem.inflated(fitted.problem.inflation)
    solution = solve(problem, structure, p, first_states(problem), fitted.prior)
    for _ in range(2):
        problem = calibrated(problem, solution)
        solution = solve(problem, structure, solution.p, solution.first, fitted.prior, anchor=first_states(problem))
    return Fitted(problem, fitted.prior, solution)


def _rounds(fitted: Fitted, turns: list[Turn], report: Callable[[str], None]) -> Fitted:
    while True:
        actives = candidates(fitted.solution.structure)
        screened = screen(fitted, actives)
        finalists = [s for s in screened[:FINALISTS] if s.gain > 8.0]
        base, judged = judge(fitted, finalists, len(actives)) if finalists else (fitted, [])
        taken = next((j for j in judged if j.evidence > 0 and worthwhile(base, j.fitted)), None)
        turns.append(Turn(base, tuple(screened), tuple(judged), taken))
        if taken is None or len(fitted.solution.structure.actives) >= MOST_EFFECTS:
            return fitted
        report(f"taken: {taken.label} (gain {taken.gain:.0f})")
        problem = calibrated(taken.fitted.problem, taken.fitted.solution)
        fitted = under(problem, taken.fitted)


def dropped(fitted: Fitted, index: int) -> Fitted:
    """The fit without one of its effects, everything else free, under the same weights."""
    solution = fitted.solution
    structure = solution.structure.without(index)
    keep = [k for k, s in enumerate(solution.structure.slots) if s.effect != index]
    p = solution.p[keep]
    prior = replace(fitted.prior, mean=fitted.prior.mean[keep], sd=fitted.prior.sd[keep])
    anchor = first_states(fitted.problem)
    return Fitted(fitted.problem, prior, solve(fitted.problem, structure, p, solution.first, prior, anchor=anchor, budget=20))


def _pruned(fitted: Fitted, report: Callable[[str], None]) -> Fitted:
    """Drop effects that no longer stand once the others are in."""
    while fitted.solution.structure.actives:
        without = [dropped(fitted, k) for k in range(len(fitted.solution.structure.actives))]
        gains = [w.solution.total - fitted.solution.total for w in without]
        weakest = int(np.argmin(gains))
        k = len(fitted.solution.p) - len(without[weakest].solution.p)
        if gains[weakest] > _limit(k, len(candidates(without[weakest].solution.structure))):
            return fitted
        report(f"dropped again: {fitted.solution.structure.actives[weakest].label}")
        fitted = without[weakest]
    return fitted


def _limit(k: int, tried: int) -> float:
    from scipy import stats

    from validate.judgement import FALSE_ALARM

    return float(stats.chi2.isf(FALSE_ALARM / max(tried, 1), max(k, 1)))


def _standing(fitted: Fitted, report: Callable[[str], None]) -> tuple[Standing, ...]:
    """For each effect, what could stand in its place: refit every candidate without it."""
    out = []
    for index, active in enumerate(fitted.solution.structure.actives):
        base = dropped(fitted, index)
        gain = base.solution.total - fitted.solution.total
        actives = [a for a in candidates(base.solution.structure) if a.label != active.label]
        rivals = [s for s in screen(base, actives)[:FINALISTS] if s.gain > 0.2 * gain]
        _, judged = judge(base, rivals, len(actives) + 1) if rivals else (base, [])
        mine = len(fitted.solution.p) - len(base.solution.p)
        near = [j for j in judged if gain - j.gain - 2.0 * (mine - j.parameters) < INDISTINCT]
        report(f"{active.label}: gain {gain:.0f}; look-alikes: {', '.join(j.label for j in near) or 'none'}")
        out.append(Standing(active, gain, _p_value(gain, mine, len(actives) + 1), tuple(_named(j, active) for j in near)))
    return tuple(out)


def _p_value(gain: float, k: int, tried: int) -> float:
    from scipy import stats

    single = float(stats.chi2.sf(max(gain, 0.0), max(k, 1)))
    return float(-np.expm1(tried * np.log1p(-min(single, 1 - 1e-16))))


def _named(judged: Judged, active: Active) -> str:
    other = judged.screened.active
    return other.effect.name if other.effect.name != active.effect.name else other.label
