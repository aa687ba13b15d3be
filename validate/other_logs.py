"""A fit looked at on other logs than its own, or on some of its windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, replace
from functools import partial

import numpy as np
from scipy.stats import chi2

from identify.base_fit import fit_from_scratch, tried, window_length
from identify.disturbance import with_disturbances
from identify.first_states import first_states
from identify.fitted import FAR, Fitted
from identify.output_error import Prior, Solution, information_of, prior_for, solve
from identify.parameter_covariance import covariance_of
from identify.reduction import Reduced
from identify.regression import coefficient_scales, start_by_regression
from identify.settled import settled
from identify.stretch import Stretch
from identify.taken_order import as_in
from identify.wander import drifts_shown, with_drifts
from identify.windows import Problem, cut
from validate.search_ends import total

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Other logs speak against a fit's parameters where its own lose what chance takes in this share of cases.
AGAINST = 1e-3
#: Steps in which parameters follow other logs: a rich model over whole ones needs some tens.
FOLLOWED = 40


def on_other_logs(fitted: Fitted, stretches: Sequence[Stretch]) -> Fitted | None:
    """The same parameters on other stretches: only the windows' first states are fitted."""
    problem = _other_problem(fitted, stretches)
    if problem is None:
        return None
    tight = Prior.held(fitted.solution.p)
    found = solve(
        problem, fitted.solution.structure, fitted.solution.p, first_states(problem), tight, budget=8
    )
    return Fitted(problem, tight, found) if np.isfinite(found.cost) else None


def with_other_logs(fitted: Fitted, stretches: Sequence[Stretch]) -> Fitted | None:
    """Other stretches with the parameters free to follow as far as the fit's own logs leave them open.

    Parameters that these logs do not determine predict others badly, and yet nothing is missing: the windows of both
    are fitted together, from where the fit is, and those of the others are returned. What an input does that rested in
    all of the fit's own is for the others alone to say. Far from the noise the
    parameters are held: what is missing there is not a matter of their intervals. So are they where the fit's own
    logs would lose more by it than their intervals allow.
    """
    other = _other_problem(fitted, stretches)
    if other is None or fitted.chi2_per_dof > FAR:
        return on_other_logs(fitted, stretches)
    own, n = fitted.problem, len(fitted.problem.windows)
    moved = tuple(replace(w, stretch=w.stretch + len(own.stretches)) for w in other.windows)
    both = replace(own, stretches=(*own.stretches, *other.stretches), windows=(*own.windows, *moved))
    s = fitted.solution
    first = np.vstack([s.first, first_states(other)])
    p, prior = _fed(fitted, other.stretches)
    found = solve(both, s.structure, p, first, prior, anchor=first_states(both), budget=FOLLOWED)
    if not _follows(other, found, n) or _against(fitted, found, n):
        found = min([found, *_begun_anew(fitted, both, prior)], key=total)
    if not np.isfinite(found.cost):
        return None
    if _against(fitted, found, n):
        return on_other_logs(fitted, stretches)
    return of_windows(Fitted(other, fitted.prior, found), slice(n, None))


def _follows(other: Problem, found: Solution, n: int) -> bool:
    """Whether the windows after the first ``n`` came near the noise."""
    fitted = Fitted(other, Prior.held(found.p), found)
    return np.isfinite(found.cost) and of_windows(fitted, slice(n, None)).chi2_per_dof < FAR


def _begun_anew(fitted: Fitted, both: Problem, prior: Prior) -> list[Solution]:
    """The fit to its own logs and others begun anew, from its own alone and from all.

    From far off, a run that turns away shows no way back; and of valleys that are as deep on its own logs one may lead
    to where the others are followed, and another not.
    """
    structure, p = fitted.solution.structure, fitted.solution.p
    length = both.length if np.isfinite(both.length) else window_length(structure.vessel.length)
    found = []
    for stretches in (fitted.problem.stretches, both.stretches):
        anew = tried(partial(fit_from_scratch, structure, stretches, p, length=length, rounds=0))
        if anew is not None:
            begin = anew.solution.p
            first = settled(both, structure, begin).first
            found.append(solve(both, structure, begin, first, prior, anchor=first_states(both), budget=20))
    return found


def _fed(fitted: Fitted, stretches: Sequence[Stretch]) -> tuple[FloatArray, Prior]:
    """Where to begin, and what is known, with the coefficients as other stretches give them that no own log feeds."""
    structure, p, prior = fitted.solution.structure, fitted.solution.p, fitted.prior
    coefficients = np.array([s.coefficient >= 0 for s in structure.slots])
    idle = coefficients & (np.diag(fitted.solution.reduced.information.sum(axis=0)) == 0.0)
    if not idle.any():
        return p, prior
    begin = start_by_regression(structure, p, stretches)
    known = prior_for(structure, coefficient_scales(structure, p, stretches), prior.ridge)
    return np.where(idle, begin, p), replace(prior, sd=np.where(idle, known.sd, prior.sd))


def _against(fitted: Fitted, found: Solution, n: int) -> bool:
    """Whether the fit's own logs (the first ``n`` windows) lose more than chance takes where others are followed too.

    Or gain more: that is another fit, in a better valley, and says nothing of this one.

    By as much as the reported covariance exceeds that of white noise alone, in the mean over the parameters, chance
    takes more (Rao and Scott 1984).
    """
    before, after = fitted.solution.moments.residuals, found.moments.residuals[:n]
    lost = abs(sum(float(np.sum(b**2) - np.sum(a**2)) for a, b in zip(before, after, strict=True)))
    least = float(chi2.isf(AGAINST, len(found.p)))
    if lost <= least:
        return False
    covariance = covariance_of(with_disturbances(fitted))
    known = information_of(fitted.solution, fitted.prior)
    return lost > least * max(1.0, float(np.einsum("ij,ji", known, covariance)) / len(known))


def of_windows(fitted: Fitted, some: slice) -> Fitted:
    """A fit with the solution of some windows alone."""
    s = fitted.solution
    left = s.moments.of(some)
    reduced = Reduced(*(x[some] for x in astuple(s.reduced)))
    solution = replace(s, first=s.first[some], cost=left.cost, moments=left, reduced=reduced)
    return replace(fitted, solution=solution)


def _other_problem(fitted: Fitted, stretches: Sequence[Stretch]) -> Problem | None:
    """Windows of other stretches, with the noise levels, weights and length of the fit's; None where there are none."""
    if not stretches:
        return None
    own = fitted.problem.stretches
    scaled = [_with_noise_of(fitted.problem, as_in(own, s)) for s in stretches]
    problem = cut(scaled, fitted.problem.length).weighted_as(fitted.problem)
    return problem if problem.windows else None


def _with_noise_of(problem: Problem, stretch: Stretch) -> Stretch:
    """The stretch with the noise levels, the waves and the drift that were found on the others."""
    own = stretch.samples
    kind, sigma = (
        np.concatenate([getattr(s.samples, c) for s in problem.stretches]) for c in ("kind", "sigma")
    )
    factor = np.ones(4)
    for k in np.intersect1d(own.kind, kind):
        factor[k] = np.median(sigma[kind == k]) / np.median(own.sigma[own.kind == k])
    noisy = stretch.weighted(own.sigma * factor[own.kind], factor)
    return replace(with_drifts([noisy], drifts_shown(problem))[0], swell=problem.swell)
