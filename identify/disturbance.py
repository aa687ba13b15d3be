"""How large disturbances are that the errors of a fit are most likely with, and what they move its parameters by.

First states and parameters have followed disturbances as far as they can; what counts is what the errors have that
these cannot follow (restricted likelihood; Patterson and Thompson 1971). Under the sensors' noise of single samples a
disturbance need not show at all where over a whole log it is larger than what that noise leaves open.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from identify.disturbed import (
    PUSHED,
    SIZE_OF,
    STANDS,
    Disturbed,
    Sizes,
    blocks_in,
    roots_of,
    sized,
    unit_answers,
)
from identify.drive import drive
from identify.first_states import begun, state_precision
from identify.fitted import Fitted
from identify.kernel import NX
from identify.noise import errors_by_stream, low_frequency_ratio, size_ratio
from identify.whitening import whitening_of
from identify.windows import Problem, Window, moments, tangents_of

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Time constants that are tried, s: of what pushes (0: white), and of the sensors' drifts.
PUSH_TIMES, DRIFT_TIMES = (0.0, 8.0), (60.0, 10.0)
#: Gain in 2 log likelihood from which disturbances are believed.
BELIEVED = 2.0
#: Sizes are sought between these, as logarithms, in units of what the errors could just show.
RANGE = (-5.0, 9.0)
#: Above this cost per degree of freedom errors are what the model lacks, not what pushes a vessel that it describes.
TOO_FAR = 20.0
#: More measurements than this are not looked at: what disturbances they show would not fit into memory.
MOST_ROWS = 300_000


class _Reduced(NamedTuple):
    """What errors and parameters have to do with the shapes, the first states eliminated.

    ``shapes`` (w, n, n), ``across`` (w, n, np) and ``toward`` (w, n): products of the shapes with themselves, with the
    parameters' tangents and with the errors; ``information`` (np, np) and ``score`` (np,) of the parameters; ``cost``:
    the errors' squares.
    """

    shapes: FloatArray
    across: FloatArray
    toward: FloatArray
    information: FloatArray
    score: FloatArray
    cost: float


class _Likeliest(NamedTuple):
    """Sizes of disturbances, the −2 log likelihood with them, and what it is over that of none."""

    sizes: Sizes
    deviance: float
    gain: float


def with_disturbances(fitted: Fitted) -> Fitted:
    """The fit with what its errors show of pushes and of drifts of the sensors, for its standard errors."""
    return fitted.remembered(_disturbed)


def _disturbed(fitted: Fitted) -> Fitted:
    """The same, made anew."""
    bare = _white(fitted)
    unit = None if fitted.refits else _shown(bare, fitted)
    if unit is None:
        return fitted
    try:
        sizes = most_likely(bare, fitted, unit)
    except np.linalg.LinAlgError:  # what the data hardly tell: the standard errors stay as they are
        return fitted
    if sizes is None:
        return fitted
    answers = sized(bare, sizes, unit)
    return replace(fitted, disturbed=Disturbed(sizes, _varied(fitted, answers), _left(bare, fitted, answers)))


def deviance(fitted: Fitted) -> float:
    """−2 log likelihood of a fit with the disturbances that its errors are most likely with, up to a constant.

    For fits to the same windows: what one of them takes for an effect may be pushes to the other. Infinite where a fit
    is too far from the noise to look, NaN where the data hardly tell.
    """
    bare = _white(fitted)
    unit = _shown(bare, fitted)
    if unit is None:
        return np.inf
    plain = _products(bare, fitted, unit)
    times = [(push, drift) for push in PUSH_TIMES for drift in DRIFT_TIMES]
    try:
        return min(_at_times(bare, fitted, plain, *at, restricted=False).deviance for at in times)
    except np.linalg.LinAlgError:  # no evidence, either way
        return np.nan


def _white(fitted: Fitted) -> Problem:
    """A fit's problem, errors weighed by the sensors' noise alone."""
    return replace(fitted.problem, inflation=np.ones(4), dispersion=np.ones(4))


def _shown(bare: Problem, fitted: Fitted) -> tuple[FloatArray, ...] | None:
    """What samples show of each unit disturbance; None where a fit is too far from the noise, or too long, to look."""
    structure, s = fitted.solution.structure, fitted.solution
    near = np.isfinite(s.cost) and fitted.chi2_per_dof < TOO_FAR
    if not near or fitted.problem.rows > MOST_ROWS:
        return None
    drives = [drive(structure, s.p, stretch) for stretch in bare.stretches]
    return unit_answers(bare, structure, drives, begun(bare, structure, drives, s.first)[0], blocks_in(bare))


def _left(bare: Problem, fitted: Fitted, answers: tuple[FloatArray, ...]) -> FloatArray:
    """How many times larger than white noise each stream's errors are without disturbances (4,), slowly averaged."""
    white, s = whitening_of(bare, [*(bare.hidden or ()), (1.0, answers)]), fitted.solution
    now = moments(bare, s.structure, s.p, s.first)
    places = [(w.stretch, w.samples) for w in bare.windows]
    now = replace(now, white=lambda k, e: white.whitened(k, *places[k], bare.less_known(bare.windows[k], e)))
    h = bare.stretches[0].h
    ratio = [max(size_ratio(e), low_frequency_ratio(e, h)) for e in errors_by_stream(bare, now)]
    return np.asarray(np.maximum(ratio, 1.0), dtype=float)


def _varied(fitted: Fitted, answers: tuple[FloatArray, ...]) -> FloatArray:
    """What disturbances make the scores (w, 8 + np, 8 + np) of first states and parameters vary by."""
    problem, s = fitted.problem, fitted.solution
    rows = tangents_of(problem, s.structure, s.p, s.first)
    out = []
    for k, w in enumerate(problem.windows):
        columns = _whitened(problem, k, w, rows[k], answers[w.stretch][w.samples])
        score = np.einsum("mac,mak->ck", columns[:, :, : rows[k].shape[2]], columns[:, :, rows[k].shape[2] :])
        out.append(score @ score.T)
    return np.array(out)


def _whitened(
    problem: Problem, k: int, window: Window, columns: FloatArray, answers: FloatArray
) -> FloatArray:
    """Columns (m, 2, c) of a window and answers (m, 2, n) in its samples' units, both weighted and made white."""
    sigma = problem.stretches[window.stretch].samples.sigma[window.samples]
    sigma = sigma * problem.inflation[problem.kinds(window)]
    weighted = problem.less_known(window, answers / sigma[:, None, None])
    together = np.concatenate([columns, weighted], axis=2)
    if problem.whitening is None:
        return together
    return problem.whitening.whitened_columns(k, window.stretch, window.samples, together)


def most_likely(problem: Problem, fitted: Fitted, unit: tuple[FloatArray, ...]) -> Sizes | None:
    """Sizes that the errors of a fit are most likely with; None where they show no disturbance."""
    plain = _products(problem, fitted, unit)
    best, least = None, -BELIEVED
    push, drift = PUSH_TIMES[0], DRIFT_TIMES[0]
    for times in ([(t, drift) for t in PUSH_TIMES], [(None, t) for t in DRIFT_TIMES[1:]]):
        for push_time, drift_time in times:
            at = (push if push_time is None else push_time, drift_time)
            found = _at_times(problem, fitted, plain, *at)
            if found.gain < least:
                best, least, push = found.sizes, found.gain, at[0]
    return best


def _products(problem: Problem, fitted: Fitted, unit: tuple[FloatArray, ...]) -> FloatArray:
    """Per window the products (8 + np + 1 + n, square) of tangents, errors and shapes, one with another."""
    s = fitted.solution
    rows = tangents_of(problem, s.structure, s.p, s.first)
    raw = moments(problem, s.structure, s.p, s.first).raw
    out = []
    for k, w in enumerate(problem.windows):
        shapes = unit[w.stretch][w.samples]
        own = np.concatenate([rows[k], problem.less_known(w, raw[k])[:, :, None]], axis=2)
        columns = _whitened(problem, k, w, own, shapes.reshape(*shapes.shape[:2], -1))
        flat = columns.reshape(-1, columns.shape[2])
        out.append(flat.T @ flat)
    return np.array(out)


def _at_times(
    problem: Problem,
    fitted: Fitted,
    plain: FloatArray,
    push_time: float,
    drift_time: float,
    restricted: bool = True,
) -> _Likeliest:
    """The likeliest sizes with these time constants."""
    count = (plain.shape[1] - NX - len(fitted.solution.p) - 1) // (PUSHED + STANDS)
    reduced = _reduced(fitted, plain, roots_of(problem, count, push_time, drift_time))
    known = np.einsum("wnn->n", reduced.shapes).reshape(-1, count).sum(axis=1) / reduced.shapes[..., 0].size
    off = known[PUSHED:]
    known = np.append(known[:PUSHED], np.bincount(SIZE_OF, off) / np.bincount(SIZE_OF))
    reference = 1.0 / np.sqrt(np.maximum(known, 1e-30))

    def less(x: FloatArray) -> tuple[float, FloatArray]:
        value, along = _less(reduced, np.repeat(_each(np.exp(x) * reference), count), restricted)
        each = along.reshape(-1, count).sum(axis=1)
        return value, np.append(each[:PUSHED], np.bincount(SIZE_OF, each[PUSHED:]))

    begin, bounds = np.full(len(reference), -1.0), [RANGE] * len(reference)
    found = minimize(less, begin, jac=True, method="L-BFGS-B", bounds=bounds)
    size = np.exp(found.x) * reference
    nothing, _ = _less(reduced, np.zeros(reduced.shapes.shape[1]), restricted)
    sizes = Sizes(size[:PUSHED], push_time, size[PUSHED:], drift_time)
    return _Likeliest(sizes, float(found.fun) + reduced.cost, float(found.fun) - nothing)


def _each(sizes: FloatArray) -> FloatArray:
    """Size (6,) in every direction, from those of the pushes and those of the drifts (5,)."""
    return np.append(sizes[:PUSHED], sizes[PUSHED:][list(SIZE_OF)])


def _reduced(fitted: Fitted, plain: FloatArray, roots: FloatArray) -> _Reduced:
    """Eliminate the first states; the shapes are those of independent disturbances of unit size."""
    s = fitted.solution
    few = NX + len(s.p) + 1
    turn = np.zeros((len(plain), plain.shape[1] - few, plain.shape[1] - few))
    for d in range(roots.shape[1]):
        part = slice(d * roots.shape[2], (d + 1) * roots.shape[2])
        turn[:, part, part] = roots[:, d]
    full = plain.copy()
    full[:, :, few:] = full[:, :, few:] @ turn
    full[:, few:] = np.swapaxes(turn, 1, 2) @ full[:, few:]
    states = full[:, :NX, :NX] + np.diag(state_precision(s.structure))
    scale = 1.0 / np.sqrt(states[:, range(NX), range(NX)])
    states = states * scale[:, :, None] * scale[:, None, :] + 1e-13 * np.eye(NX)
    left = full[:, :NX, NX:] * scale[:, :, None]
    full = full[:, NX:, NX:] - np.swapaxes(left, 1, 2) @ np.linalg.solve(states, left)
    free, np_ = ~s.held, len(s.p)
    information = full[:, :np_, :np_].sum(axis=0) + np.diag(1.0 / fitted.prior.sd**2)
    score = full[:, :np_, np_].sum(axis=0) - (s.p - fitted.prior.mean) / fitted.prior.sd**2
    by = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    information = information * by * by[:, None] + 1e-12 * np.eye(np_)
    across = full[:, np_ + 1 :, :np_] * by
    return _Reduced(
        full[:, np_ + 1 :, np_ + 1 :], across[:, :, free], full[:, np_ + 1 :, np_],
        information[np.ix_(free, free)], (score * by)[free],
        float(full[:, np_, np_].sum() + np.sum(((s.p - fitted.prior.mean) / fitted.prior.sd) ** 2)),
    )  # fmt: skip


def _less(reduced: _Reduced, scale: FloatArray, restricted: bool) -> tuple[float, FloatArray]:
    """−2 log likelihood of disturbances of these sizes (n,) less the errors' squares; slopes (n,) by their logarithm.

    Restricted to what no parameter can follow, or at the likeliest parameters.
    """
    within = np.eye(len(scale)) + reduced.shapes * scale * scale[:, None]
    right = np.concatenate([reduced.across, reduced.toward[:, :, None]], axis=2) * scale[:, None]
    lower, inverse = np.linalg.cholesky(within), np.linalg.inv(within)
    solved = inverse @ right
    taken = np.einsum("wna,wnb->ab", right, solved)
    information, score = reduced.information - taken[:-1, :-1], reduced.score - taken[:-1, -1]
    own = np.linalg.cholesky(information)
    reached = np.linalg.solve(own, score)
    logs = np.log(np.einsum("wnn->wn", lower)).sum() + restricted * np.log(np.diag(own)).sum()
    value = float(2.0 * logs - taken[-1, -1] - reached @ reached)
    left = solved[:, :, -1] - solved[:, :, :-1] @ np.linalg.solve(own.T, reached)
    slope = np.sum(1.0 - np.einsum("wnn->wn", inverse) - left**2, axis=0)
    if restricted:
        slope -= np.sum((solved[:, :, :-1] @ np.linalg.inv(own).T) ** 2, axis=(0, 2))
    return value, np.asarray(2.0 * slope)
