"""Fit a structure from scratch: regression, short windows, long windows, the noise calibrated on the way."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from identify.bent_paths import bent
from identify.first_states import first_states
from identify.fitted import FAR, NEAR, SLOWLY, Fitted, chi2_of
from identify.in_common import in_common
from identify.loosened import FIRM, loosened
from identify.noise import calibrated, calibrated_anew
from identify.output_error import Prior, Solution, Stopped, prior_for, solve
from identify.regression import coefficient_scales, couples, start_by_regression
from identify.rough_fit import RAN_AWAY, SLIGHT, begin_windows
from identify.settled import Settled, settled
from identify.slowness import slower
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters
from identify.windows import Problem, cut
from ingest.errors import NotIdentifiable
from preprocess.cores import side_by_side

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: Length of the windows, s: short ones first, so that a poor start cannot run away.
SHORTEST, SHORT, LONG = 7.0, 8.0, 30.0
#: A search stops where its next step promises less than this of the rows; sooner in windows that longer ones follow.
ENOUGH, ROUGHLY = 1e-4, 1e-3
#: A length of the windows is gone on with so many times at most, each with weights as they are by then.
PATIENCE = 4
#: Steps in which a fit gets used to another's weights.
FEW = 5
#: A fit that was begun elsewhere is clearly nearer the noise below this share of the other's cost.
CLEARLY = 0.9
#: ... or, near it, by this gain in 2 log likelihood under the other's weights.
DECISIVE = 10.0


def window_length(length: float) -> float:
    """Length of the long windows for a vessel of this length: 30 s, more for ships whose response is slower."""
    return LONG * max(1.0, min(float(np.sqrt(length / 7.0)), 5.0))


def short_windows(problem: Problem, structure: Structure) -> float:
    """Length of windows in which hardly any start runs away, s: longer for ships, no longer than a problem's."""
    return min(SHORT * slower(structure.vessel.length), problem.length)


def fit_from_scratch(
    structure: Structure,
    stretches: tuple[Stretch, ...],
    p: FloatArray | None = None,
    *,
    length: float | None = None,
    rounds: int = 2,
    apart: bool | None = None,
    fine: bool = True,
    begun: Fitted | None = None,
) -> Fitted:
    """Fit a structure without a start of its own.

    A fit that stays off the noise is begun again: with the axes apart, or, from effects of known values, with these
    held until the longest windows, for short ones hardly show what a vessel remembers. What still leaves something near
    the noise is begun a third time, over long windows at once (``identify.loosened``).

    Parameters
    ----------
    structure : Structure
    stretches : tuple of Stretch, to identify on
    p : (np,), optional
        Values of the effects' parameters to begin with; the coefficients come from regression.
    length : float, optional
        Of the windows at the end, s; by default long ones.
    rounds : int
        How often the noise is calibrated anew.
    apart : bool, optional
        Whether it may be begun again with the axes apart; by default where ``p`` is not given.
    fine : bool
        Whether weights count what inputs hide that are logged often.
    begun : Fitted, optional
        What ``fit_one_way`` gave, where that was made before.
    """
    values = null_parameters(structure) if p is None else p
    length = window_length(structure.vessel.length) if length is None else length
    found = begun or fit_one_way(structure, stretches, values, length=length)
    axes = p is None if apart is None else apart
    another = _second_way(structure, stretches, values, length, axes)
    calibrate = partial(_calibrated, rounds=rounds, fine=fine)
    first, (found, again) = found, _calibrated_and_again(found, calibrate, another)
    if again is not None and _farther(first, again) is again:
        found = _farther(found, calibrate(again))
    if axes and _misses_little(found):
        third = tried(partial(loosened, structure, stretches, values, length))
        found = found if third is None else _farther(found, calibrate(third))
    return _straight(found, calibrate)


def fit_one_way(
    structure: Structure, stretches: tuple[Stretch, ...], p: FloatArray | None = None, *, length: float
) -> Fitted:
    """Fit a structure from a regression through ever longer windows, from no other start and with rough weights."""
    values = null_parameters(structure) if p is None else p
    begin = partial(start_by_regression, structure, values, stretches)
    found = _grown(structure, stretches, begin(), length)
    if found.problem.length < length:
        found = _farther(found, _grown(structure, stretches, begin(FIRM), length))
    return found


def finished(found: Fitted, rounds: int, fine: bool) -> Fitted:
    """A fit with the weights that its errors ask for, found anew so many times; ``fine`` as in ``fit_from_scratch``."""
    calibrate = partial(_calibrated, rounds=rounds, fine=fine)
    return _straight(calibrate(found), calibrate)


def led(structure: Structure, stretches: tuple[Stretch, ...], p: FloatArray, length: float) -> Fitted:
    """A fit that windows of up to ``length``, ever longer ones, lead to from the effects' values in ``p`` (np,).

    These are held on the way where they run away with the others.
    """
    begin = start_by_regression(structure, p, stretches)
    found = _grown(structure, stretches, begin, length)
    if found.problem.length < length:
        found = _farther(found, _grown(structure, stretches, begin, length, waiting=True))
    return found


def _misses_little(found: Fitted) -> bool:
    """Whether something is left near the noise: far from it, where an effect is missing, every valley is as good."""
    return found.chi2_per_dof < FAR and (found.chi2_per_dof > NEAR or found.slow > SLOWLY)


def _second_way(
    structure: Structure, stretches: tuple[Stretch, ...], values: FloatArray, length: float, apart: bool
) -> Callable[[], Fitted] | None:
    """Another way to fit from scratch, where there is one: the axes apart, or effects of known values held."""
    begin = partial(start_by_regression, structure, values, stretches)
    if apart and any(couples(t) for t in structure.table.terms):
        return lambda: _grown(structure, stretches, begin(apart=True), length)
    if _known(structure, values).any():
        return lambda: _grown(structure, stretches, begin(), length, waiting=True)
    return None


def _calibrated_and_again(
    found: Fitted, settle: Callable[[Fitted], Fitted], another: Callable[[], Fitted] | None
) -> tuple[Fitted, Fitted | None]:
    """A fit calibrated; and, where that stays off the noise, another: far from it, one made beside the other."""
    calibrate: Callable[[], Fitted] = partial(settle, found)
    if another is None or not found.chi2_per_dof > FAR:
        here = calibrate()
        return here, tried(another) if another and here.is_off else None
    one, other = side_by_side(tried, [calibrate, another], shared=in_common(found))
    if one is None:
        raise NotIdentifiable(RAN_AWAY)
    return one, other if one.is_off else None


def tried(way: Callable[[], Fitted]) -> Fitted | None:
    """What a way gives, where it gives anything."""
    with suppress(NotIdentifiable):
        return way()
    return None


def _straight(fitted: Fitted, settle: Callable[[Fitted], Fitted]) -> Fitted:
    """The fit in windows short enough that predictions answer to what was rounded away along straight lines."""
    while fitted.problem.length > SHORTEST and bent(fitted.problem) > 1.0:
        problem, solution = fitted.problem, fitted.solution
        problem = cut(problem.stretches, 0.5 * problem.length).weighted_as(problem)
        here = settled(problem, solution.structure, solution.p)
        solution = solve(problem, solution.structure, solution.p, here.first, fitted.prior, budget=20)
        if not np.isfinite(solution.cost):
            break
        fitted = settle(Fitted(problem, fitted.prior, solution))
    return fitted


def _farther(one: Fitted, other: Fitted) -> Fitted:
    """The first of two fits, unless the other has longer windows, or is clearly nearer the noise in equal ones."""
    if one.problem.length != other.problem.length:
        return max(one, other, key=lambda f: f.problem.length)
    return other if other.chi2_per_dof < CLEARLY * one.chi2_per_dof or _likelier(other, one) else one


def _likelier(other: Fitted, one: Fitted) -> bool:
    """Whether near the noise a fit is decidedly likelier than one by whose weights both are judged."""
    if one.is_far or other.is_far:
        return False
    p, structure = other.solution.p, one.solution.structure
    there = settled(one.problem, structure, p).first
    anchor = first_states(one.problem)
    found = solve(one.problem, structure, p, there, one.prior, anchor=anchor, budget=FEW)
    return found.total < one.solution.total - DECISIVE


def _grown(
    structure: Structure,
    stretches: tuple[Stretch, ...],
    p: FloatArray,
    length: float,
    *,
    waiting: bool = False,
) -> Fitted:
    """Fit ever longer windows from ``p``; what runs away in windows of a length stays with the shorter ones.

    Effects that are ``waiting`` keep known values until the longest.
    """
    prior = prior_for(structure, coefficient_scales(structure, p, stretches))
    waits = _with_effects_held(prior, structure, p) if waiting else prior
    lengths = _lengths(length)
    problem, begun = begin_windows(structure, stretches, p, lengths[0])
    p, solution = begun.p, None
    for size in lengths:
        longer = problem if size == problem.length else cut(problem.stretches, size).weighted_as(problem)
        here = begun if longer is problem else settled(longer, structure, p)
        if not np.isfinite(here.cost):
            break
        begun = here
        problem, first = calibrated_anew(longer, begun, fine=False), begun.first
        latest: Settled | Solution = begun
        for _ in range(PATIENCE):
            enough = (ENOUGH if size == lengths[-1] else ROUGHLY) * problem.rows
            tolerance = max(enough, far_off(problem, latest))
            so_far = prior if size == lengths[-1] else waits
            latest = solution = solve(problem, structure, p, first, so_far, budget=25, tolerance=tolerance)
            far = far_off(problem, solution) > 0.0
            problem = calibrated(problem, solution) if far else calibrated_anew(problem, solution, fine=False)
            p, first = solution.p, solution.first
            if solution.stopped is not Stopped.BUDGET:
                break
    return Fitted(problem, prior, solution or solve(problem, structure, p, begun.first, prior, budget=0))


def _known(structure: Structure, p: FloatArray) -> BoolArray:
    """Which of the parameters (np,) are effects' that are not at their null in ``p``."""
    effects = np.array([s.effect >= 0 and s.coefficient < 0 for s in structure.slots], dtype=bool)
    return np.asarray(effects & (p != null_parameters(structure)))


def _with_effects_held(prior: Prior, structure: Structure, p: FloatArray) -> Prior:
    """A prior by which effects of known values stay where they are in ``p`` (np,)."""
    return prior.holding(p, _known(structure, p))


def _calibrated(fitted: Fitted, rounds: int, fine: bool) -> Fitted:
    """The fit at its best under weights that its own errors give, found anew so many times."""
    problem, prior, solution = fitted.problem, fitted.prior, fitted.solution
    for k in range(rounds + 1):
        solution = _gone_on(problem, solution, prior)
        if k and (solution.stayed or far_off(problem, solution)):
            break
        problem = calibrated_anew(problem, solution, fine)
    if problem.unlogged is not None and problem.unlogged.rounded is not None:
        bare = calibrated(replace(problem, unlogged=None), solution)
        unaware = _gone_on(bare, solution, prior)
        again = calibrated_anew(bare, unaware, fine)
        if again.unlogged is None or again.unlogged.rounded is None:
            problem, solution = again, unaware  # a fit that knows of no rounding leaves none of it
    return Fitted(problem, prior, _gone_on(problem, solution, prior))


def _gone_on(problem: Problem, solution: Solution, prior: Prior) -> Solution:
    """A search gone on with under other weights."""
    return solve(
        problem, solution.structure, solution.p, solution.first, prior, anchor=first_states(problem),
        tolerance=max(0.05, far_off(problem, solution)), budget=20,
    )  # fmt: skip


def far_off(problem: Problem, found: Solution | Settled) -> float:
    """The least gain in cost that is worth a step far from the noise; nothing near it."""
    return SLIGHT * problem.rows if chi2_of(problem, found) > FAR * problem.rows else 0.0


def _lengths(length: float) -> list[float]:
    """Lengths of the windows on the way to the last one, each double the one before, s."""
    doublings = max(0, math.floor(math.log2(length / SHORTEST)))
    return [length / 2.0**k for k in range(doublings, -1, -1)]


def fit_states(problem: Problem, structure: Structure, p: FloatArray) -> Solution:
    """The solution at parameters that are held, every window's first state at its best."""
    found = settled(problem, structure, p)
    held = Prior.held(p)
    return solve(problem, structure, p, found.first, held, anchor=first_states(problem), budget=0)
