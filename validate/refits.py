"""Refits of the candidates: near the noise each from where the base is, farther off a race from several starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from identify.base_fit import short_windows
from identify.first_states import first_states
from identify.fitted import FAR, NEAR, Fitted
from identify.free_running import is_lost
from identify.in_common import in_common
from identify.noise import calibrated_anew
from identify.output_error import Solution, Stopped, solve
from identify.rough_fit import roughly
from identify.settled import settled
from identify.structure import Structure, effects_alone
from identify.windows import Problem
from ingest.errors import NotIdentifiable
from preprocess.cores import side_by_side
from validate.begins import from_where_it_was
from validate.candidates import Screened, prior_of, thinned
from validate.from_scratch import from_scratch
from validate.other_start import other_start
from validate.pace import Pace
from validate.scan import WORTH
from validate.search_ends import fallen, total
from validate.swing_scan import swings, wanted_swings
from validate.swinging import searched_swinging

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: Below this cost per degree of freedom a refit converges from where the base is ...
CONVERGES = 1.5
#: ... if no stream's slow errors are so many times its noise: many samples of white noise hide how far a model is off.
STRAYS = 3.0
#: So many candidates are refitted to the end, and so many of those that promised most; the others are left after a few
#: steps, in which one that began far from the base's own optimum may not have caught up.
RUNNERS, PROMISING = 4, 4
#: More than so many are first refitted over part of the windows.
MANY = 10
#: So many of the candidates that promise most are begun before the others.
FIRST = 10
#: Steps in which forces are found for a wind or a roll that stays as it was looked at.
FORCED = 3
#: Steps from another begin of a base that is near and lost.
LONGER_WAY = 8
#: What swings is searched for so many times as long.
LONGER = 3
#: A fit under new weights is refitted so many times.
ROUNDS = 3
#: So many are refitted beside each other before one is given up because it cannot reach what another has.
FEW = 2


def step_tolerance(fitted: Fitted) -> float:
    """When a search may stop: at a twentieth of a unit of cost, earlier while the model is far from the noise."""
    return 0.05 if fitted.chi2_per_dof < FAR else 1e-4 * fitted.solution.cost


def converges(fitted: Fitted) -> bool:
    """Whether a refit converges from where a fit is: near the noise, in what is slow as well, and not lost.

    Positions are not asked: a receiver wanders by itself.
    """
    return fitted.chi2_per_dof < CONVERGES and fitted.slow < STRAYS and not is_lost(fitted)


def refit(fitted: Fitted, screened: Screened, *, budget: int = 20, target: float = np.inf) -> Fitted:
    """Refit with the candidate in and everything free, from its screened start or from a regression's.

    The valley of what swings is bent: a search follows it for longer.
    """
    found = begun(fitted, screened, target)
    return went_on(found, LONGER * budget if swings(found.solution.structure) else budget, target)


def begun(fitted: Fitted, screened: Screened, target: float = np.inf) -> Fitted:
    """The first steps of a refit: near the noise all of it, farther off from the best of several starts."""
    structure = fitted.solution.structure.with_effect(screened.active)
    problem, first = fitted.problem, fitted.solution.first
    prior = prior_of(structure, screened.p, fitted)
    search = partial(
        solve, problem, structure, prior=prior, anchor=first_states(problem), tolerance=step_tolerance(fitted)
    )
    ways = [(screened.p, first), (screened.unmoved, first)]
    waiting = forces_waiting(structure, screened.unmoved)
    if waiting.any():
        forced = search(
            screened.unmoved, first, prior=prior.holding(screened.unmoved, waiting), budget=FORCED
        )
        ways.append((forced.p, forced.first))
    moved = Fitted(problem, prior, min((search(p, x, budget=0) for p, x in ways), key=total))
    if converges(fitted) and not swings(structure):
        here = went_on(moved, 20, target)
        if screened.wanted is None:
            return here
        there = search(*other_start(structure, screened, fitted), budget=20)
        return replace(here, solution=min(here.solution, there, key=total))
    anew = _anew(search, structure, screened, fitted)
    return replace(moved, solution=min(went_on(moved, 2).solution, anew, key=total))


def forces_waiting(structure: Structure, p: FloatArray) -> BoolArray:
    """Which parameters (np,) of the last effect say nothing in ``p`` as yet, for all that it pushes with is nothing.

    A first step would move them by what is known beforehand alone: a wind to none, however hard it blows.
    """
    last = len(structure.actives) - 1
    mine = np.array([s.effect == last for s in structure.slots], dtype=bool)
    pushes = np.array([s.coefficient >= 0 for s in structure.slots], dtype=bool)
    silent = (mine & pushes).any() and not p[mine & pushes].any()
    return mine & ~pushes if silent else np.zeros(len(p), dtype=bool)


def _anew(
    search: Callable[..., Solution], structure: Structure, screened: Screened, base: Fitted
) -> Solution:
    """A few steps from where a candidate may begin anew, or some more; of more from a base that is near and lost."""
    if not swings(structure):
        lost = base.chi2_per_dof < FAR and is_lost(base)
        start = other_start(structure, screened, base)
        return search(*start, budget=LONGER_WAY) if lost else fallen(search, start, base.solution.total)
    if converges(base):
        return searched_swinging(search, structure, base.problem, (screened.unmoved,), longer=LONGER)
    found = wanted_swings(structure, base.problem.stretches, screened.unmoved)
    wanted = [p for gain, p in found if gain > WORTH]
    return searched_swinging(search, structure, base.problem, (screened.unmoved,), wanted)


def went_on(fitted: Fitted, budget: int, target: float = np.inf) -> Fitted:
    """More steps of a search that ended because it had used up its own."""
    if fitted.solution.stopped is not Stopped.BUDGET:
        return fitted
    s = fitted.solution
    found = solve(
        fitted.problem, s.structure, s.p, s.first, fitted.prior, anchor=first_states(fitted.problem),
        budget=budget, tolerance=step_tolerance(fitted), target=target,
    )  # fmt: skip
    return replace(fitted, solution=found)


def raced(base: Fitted, finalists: Sequence[Screened], pace: Pace) -> list[tuple[Screened, Fitted]]:
    """Refits of the finalists, best first.

    Off the noise, of many those that fall behind over part of the windows are left there; and where one of those that
    promised most comes near the noise alone, the others are not begun: what could stand in its place is asked later.
    Far from it, and where the base is lost, what leads is fitted from scratch in place of that, for from the valley of
    such a base no step may lead to it; where that is at the noise, far from which the base is, nothing else is begun.
    """
    few = len(finalists) <= MANY
    if converges(base) or (few and base.chi2_per_dof < FAR):
        return _alive(base, _nearly(base, finalists, pace))
    some, promising = thinned(base), {id(s) for s in finalists[:PROMISING]}
    runners: list[tuple[Screened, Fitted]] = []
    whole = _led(base, finalists, pace)
    if there := [(s, f) for s, f in whole if base.chi2_per_dof > FAR and f.is_as_sensors_say]:
        return best_first(there, base)
    done = {id(s) for s, _ in whole}
    racing = [s for s in finalists if id(s) not in done]
    for part in (racing[:FIRST], racing[FIRST:]):
        runners = _alive(base, [*runners, *_beside(some, part, lambda s: went_on(begun(some, s), 3), pace)])
        ahead = [r for k, r in enumerate(runners) if k < RUNNERS or id(r[0]) in promising]
        whole += _taken_on(base, ahead, {id(s) for s, _ in whole}, pace)
        if any(f.chi2_per_dof < CONVERGES and not is_lost(f) for _, f in whole):
            break
    return _alive(base, whole)


def _led(base: Fitted, finalists: Sequence[Screened], pace: Pace) -> list[tuple[Screened, Fitted]]:
    """What leads, fitted from scratch, where the base is far off or lost; near the noise by the base's own weights."""
    if base.chi2_per_dof > FAR:
        return from_scratch(base, finalists, pace)
    found = from_scratch(base, finalists, pace) if is_lost(base) else []
    return [(s, under(base.problem, f)) for s, f in found]


def _taken_on(
    base: Fitted, ahead: Sequence[tuple[Screened, Fitted]], done: set[int], pace: Pace
) -> list[tuple[Screened, Fitted]]:
    """Fits on some windows taken on to all of the base's, but for those that are ``done`` (by identity).

    The nearest are taken on first, and no more where one of those is at the noise.
    """
    part = {id(s): f for s, f in ahead if id(s) not in done}
    pace.expect(len(part), pace.left)
    best = [s for s, _ in ahead if id(s) in part]
    found: list[tuple[Screened, Fitted]] = []
    for k in range(0, len(best), FEW):
        found += _beside(base, best[k : k + FEW], lambda s: _slack(base, _whole(base, part[id(s)])), pace)
        if any(f.chi2_per_dof < NEAR and not is_lost(f) for _, f in found):
            break
    return found


def _beside(
    base: Fitted, screened: Sequence[Screened], refitted: Callable[[Screened], Fitted], pace: Pace
) -> list[tuple[Screened, Fitted]]:
    """Refits of some candidates, one beside the other; the best first."""
    known = [*in_common(base), *(s.active for s in screened)]
    found = side_by_side(refitted, screened, lambda s: pace(f"trying {s.active.label}"), known)
    return _alive(base, list(zip(screened, found, strict=True)))


def _nearly(base: Fitted, finalists: Sequence[Screened], pace: Pace) -> list[tuple[Screened, Fitted]]:
    """Refits in turn, a few beside each other; what cannot come near the best of those before is given up."""
    found: list[tuple[Screened, Fitted]] = []

    def refitted(target: float, screened: Screened) -> Fitted:
        return _slack(base, refit(base, screened, target=target))

    for k in range(0, len(finalists), FEW):
        target = min((total(f.solution) + 0.5 * target_gap(base, f) for _, f in found), default=np.inf)
        found += _beside(base, finalists[k : k + FEW], partial(refitted, target), pace)
    return found


def _slack(base: Fitted, fit: Fitted) -> Fitted:
    """A refit that stayed finite, its slack linkages begun where they were."""
    return from_where_it_was(fit, step_tolerance(base)) if np.isfinite(fit.solution.total) else fit


def _alive(base: Fitted, runners: list[tuple[Screened, Fitted]]) -> list[tuple[Screened, Fitted]]:
    """Those that did not run away, best first."""
    return best_first([(s, f) for s, f in runners if np.isfinite(f.solution.total)], base)


def best_first(refitted: Sequence[tuple[Screened, Fitted]], base: Fitted) -> list[tuple[Screened, Fitted]]:
    """Refits by their cost; far from the noise, where the base's weights hardly ask what is far off, by how far."""
    far = base.chi2_per_dof > FAR
    return sorted(refitted, key=lambda x: x[1].astray_by if far else x[1].solution.total)


def _whole(base: Fitted, part: Fitted) -> Fitted:
    """A fit on some windows taken on to all of the base's, from the first begin that runs away in none of them."""
    structure, problem = part.solution.structure, base.problem
    search = partial(
        solve, problem, structure, prior=part.prior, anchor=first_states(problem), budget=18,
        tolerance=step_tolerance(base),
    )  # fmt: skip
    found = part.solution
    for p, first in _begins(base, part):
        found = search(p, first)
        if np.isfinite(found.total):
            break
    return Fitted(problem, part.prior, found)


def _begins(base: Fitted, part: Fitted) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Where a fit on some windows may begin in all: with the base's first states, with its own, or roughly anew."""
    structure, problem, p = part.solution.structure, base.problem, part.solution.p
    yield p, base.solution.first
    yield p, settled(problem, structure, p).first
    p, length = effects_alone(structure, p), short_windows(problem, structure)
    with suppress(NotIdentifiable):
        p = roughly(structure, problem.stretches, p, length)
        yield p, settled(problem, structure, p).first


def target_gap(base: Fitted, best: Fitted) -> float:
    """What the best candidate gains, and a little more."""
    return base.solution.total - best.solution.total + 50.0


def begun_at(fitted: Fitted, p: FloatArray, budget: int, target: float = np.inf) -> Fitted:
    """The same structure fitted under the same weights from other parameters (np,), given up short of a target."""
    problem, structure = fitted.problem, fitted.solution.structure
    found = solve(
        problem, structure, p, settled(problem, structure, p).first, fitted.prior, anchor=first_states(problem),
        budget=budget, tolerance=step_tolerance(fitted), target=target,
    )  # fmt: skip
    return replace(fitted, solution=found)


def under(problem: Problem, fitted: Fitted, budget: int = 12) -> Fitted:
    """The same structure fitted under another problem's weights, and windows where those differ, from where it was."""
    s = fitted.solution
    alike = len(s.first) == len(problem.windows)
    first = s.first if alike else settled(problem, s.structure, s.p).first
    anchor, tolerance = first_states(problem), step_tolerance(fitted)
    solution = solve(
        problem, s.structure, s.p, first, fitted.prior, anchor=anchor, budget=budget, tolerance=tolerance
    )
    return replace(fitted, problem=problem, solution=solution)


def knowing(fitted: Fitted, problem: Problem) -> Fitted:
    """The fit gone on with in a problem that knows of other disturbances than its own, noise told anew with them."""
    for _ in range(ROUNDS):
        fitted = under(problem, fitted, 20)
        problem = calibrated_anew(problem, fitted.solution)
    return under(problem, fitted, 20)
