"""What stays unexplained: the structured part of the prediction error over windows, and what cross-validation says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.base_fit import window_length
from identify.drive import drive
from identify.first_states import begun, first_states
from identify.fitted import FAR, AtNoise, Fitted
from identify.free_running import less_waves
from identify.gusts import blown
from identify.noise import beyond_drift, calibrated, smoothness
from identify.output_error import Prior, Solution, information_of, solve
from identify.predict import relative_errors, run, shown, true_first_state
from identify.stretch import KIND, Stretch
from identify.unlogged import Unlogged
from identify.windows import Problem, Window, cut

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


#: An error counts for no more than so many standard deviations of its channel: beyond, a prediction has run away.
RUN_AWAY = 5.0
#: A prediction that is so far off, m/s or rad/s, left all bounds.
OUT_OF_BOUNDS = 1e3
#: Steps in which first states are fitted to such windows.
STEPS = 8
#: How near the noise is at it, unless something else is said.
AT_NOISE = AtNoise()


def seconds_ahead(length: float) -> float:
    """How far ahead, s, predictions are looked at for a vessel of this length, m: 30 s, more for ships that are slower.

    A ship of a hundred metres has hardly begun to turn in half a minute: whatever the model lacks, it predicts that.
    """
    return window_length(length)


def _horizon(fitted: Fitted) -> float:
    return seconds_ahead(fitted.solution.structure.vessel.length)


def ahead(fitted: Fitted, near: AtNoise = AT_NOISE) -> Fitted:
    """The same parameters in windows of ``seconds_ahead``, from the first states that the smoothed motion gives.

    A fit at the noise (``near`` it) has its own first states, which are the better known ones, fitted in such windows.
    Off the noise they would take in what the model lacks. In waves that are known they are fitted all the same: the
    smoothed motion has the waves' own velocity, which a prediction would sail on with.
    """
    if near.holds(fitted) and fitted.problem.length >= _horizon(fitted):
        return fitted
    structure, p = fitted.solution.structure, fitted.solution.p
    if _known_better(fitted, near):
        problem, solution = _gone_on(fitted)
        if np.isfinite(solution.cost):
            return Fitted(calibrated(problem, solution), Prior.held(p), solution)
    problem = cut(fitted.problem.stretches, _horizon(fitted)).weighted_as(
        replace(fitted.problem, unlogged=None)
    )
    drives = [drive(structure, p, s) for s in problem.stretches]
    first = np.array(
        [
            true_first_state(structure, drives[w.stretch], problem.stretches[w.stretch], w.first)
            for w in problem.windows
        ]
    )
    held = Prior.held(p)
    solution = solve(problem, structure, p, first, held, budget=0)
    if not np.isfinite(solution.cost):
        return Fitted(problem, held, solution)
    return Fitted(calibrated(problem, solution), held, solution)


def _gone_on(fitted: Fitted) -> tuple[Problem, Solution]:
    """Windows of about ``seconds_ahead``, each from where one of the fit's own begins, first states fitted from there.

    What the inputs hide counts in that: else first states would bend to make up for it.
    """
    structure, p = fitted.solution.structure, fitted.solution.p
    horizon = _horizon(fitted)
    windows: list[Window] = []
    first: list[FloatArray] = []
    for w, x in zip(fitted.problem.windows, fitted.solution.first, strict=True):
        last = windows[-1] if windows else None
        follows = last is not None and (last.stretch, last.first + last.steps) == (w.stretch, w.first)
        if (
            last is not None
            and follows
            and last.steps * fitted.problem.stretches[w.stretch].h < 0.8 * horizon
        ):
            samples = slice(last.samples.start, w.samples.stop)
            windows[-1] = replace(last, steps=last.steps + w.steps, samples=samples)
        else:
            windows, first = [*windows, w], [*first, x]
    problem = replace(fitted.problem, windows=tuple(windows), length=horizon)
    held, begin = Prior.held(p), np.array(first)
    anchor = first_states(problem)
    return problem, solve(problem, structure, p, begin, held, anchor=anchor, budget=STEPS)


def _known_better(fitted: Fitted, near: AtNoise) -> bool:
    """Whether fitted first states are better known than those of the smoothed motion."""
    return fitted.problem.swell is not None or near.holds(fitted)


def window_errors(
    fitted: Fitted, p: FloatArray, first: FloatArray, which: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """Prediction less smoothed measurement of u, v, r (n, 3) over some windows, and the smoother's own variance."""
    errors, variances = [], []
    structure, problem = fitted.solution.structure, fitted.problem
    drives = [drive(structure, p, s) for s in problem.stretches]
    first, _ = begun(problem, structure, drives, first)
    for k in which:
        w = problem.windows[k]
        stretch, d = problem.stretches[w.stretch], drives[w.stretch]
        states = shown(structure, d, stretch, run(structure, d, stretch, first[k], w.first, w.steps))
        part = slice(w.first, w.first + w.steps + 1)
        errors.append(states[:, 3:6] - stretch.states[part, 3:6])
        variances.append(stretch.sigmas[part] ** 2)
    return np.vstack(errors), np.vstack(variances)


def structured_share(
    fitted: Fitted, besides: Sequence[Stretch] = (), near: AtNoise = AT_NOISE
) -> dict[str, float]:
    """Per channel: structured part of the windows' prediction error over the channel's standard deviation.

    The standard deviation is that of the fit's logs and of those ``besides``: a log that holds one course and speed has
    hardly any of its own. ``near`` says how near the noise is at it.

    Taken off are the smoother's own variance, waves that are known, what the sampling of the inputs leaves open, and
    the part of what is left that noise of the sensors can account for, white or wandering: where the errors of the raw
    measurements are white, or rough as a wander is (a force that is missing makes smooth ones), nothing is left, unless
    a wander that is known is too small for them. Where they are far from the noise, and from what the inputs hide, they
    are neither, and what whole logs are off by counts too.
    """
    seen, fitted = fitted, ahead(fitted, near)
    everything = range(len(fitted.problem.windows))
    error, variance = window_errors(fitted, fitted.solution.p, fitted.solution.first, everything)
    variance = variance + _left_open(fitted, seen.problem.unlogged, not _known_better(seen, near))
    variance = variance + (seen.problem.swell.variance(_horizon(seen)) if seen.problem.swell else 0.0)
    logs = (*fitted.problem.stretches, *besides)
    spread = spread_of(logs)
    size = np.minimum(np.nan_to_num(np.abs(error) / spread, nan=RUN_AWAY), RUN_AWAY)
    left = np.sqrt(np.maximum(np.mean(size**2 - variance / spread**2, axis=0), 0.0))
    slow = 1.0 - 1.0 / np.maximum(fitted.problem.dispersed.inflation, 1.0) ** 2
    kinds = {"u": ("position", "velocity"), "v": ("position", "velocity"), "r": ("heading", "yaw_rate")}
    large = np.clip((fitted.problem.inflation - 3.0) / 7.0, 0.0, 1.0)
    if not np.isfinite(fitted.solution.cost):
        slow, large = np.ones(4), np.ones(4)
    smooth = {
        k: max(smoothness(fitted.problem, fitted.solution.moments, k), float(large[k])) for k in KIND.values()
    }
    for kind in (KIND["position"], KIND["heading"]):
        beyond = beyond_drift(fitted.problem, fitted.solution.moments, kind, not _known_better(seen, near))
        smooth[kind] = max(smooth[kind], beyond)
    known = np.array([np.sqrt(max(slow[KIND[s]] * smooth[KIND[s]] for s in kinds[c])) for c in "uvr"])
    share = left * known
    if (fitted if seen.problem.unlogged is None else seen).chi2_per_dof > FAR:
        whole = over_whole_logs(seen, fitted.problem.stretches, spread)
        share = np.maximum(share, [whole[c] for c in "uvr"])
    predicts = fitted.solution.structure.model.predicts
    return {c: float(share[j]) if c in predicts else 0.0 for j, c in enumerate("uvr")}


def spread_of(stretches: Sequence[Stretch]) -> FloatArray:
    """Standard deviation (3,) of u, v, r over some stretches."""
    return np.asarray(np.vstack([s.states[:, 3:6] for s in stretches]).std(axis=0) + 1e-12, dtype=float)


def over_whole_logs(fitted: Fitted, stretches: Sequence[Stretch], spread: FloatArray) -> dict[str, float]:
    """Per channel the free-running error over whole stretches in units of its ``spread``: what is missing adds up.

    Less waves that are known, and the smoother's own variance.
    """
    structure, p = fitted.solution.structure, fitted.solution.p
    errors = [less_waves(relative_errors(structure, p, s, spread, RUN_AWAY), s) for s in stretches]
    square = np.mean(np.vstack(errors) ** 2, axis=0)
    smoothed = np.mean(np.vstack([s.sigmas for s in stretches]) ** 2, axis=0) / spread**2
    return dict(zip("uvr", np.sqrt(np.maximum(square - smoothed, 0.0)).tolist(), strict=True))


def _left_open(
    fitted: Fitted, unlogged: Unlogged | None, smoothed: bool, draws: int = 3, seed: int = 0
) -> FloatArray:
    """Variance (3,) of u, v, r over windows that no model could help.

    An input's change may have come any time between two samples, and ``smoothed`` first states have their errors. A
    wind that nothing measured has gusts.
    """
    rng = np.random.default_rng(seed)
    structure, problem, solution = fitted.solution.structure, fitted.problem, fitted.solution
    square, n = np.zeros(3), 0
    drives = [drive(structure, solution.p, s) for s in problem.stretches]
    begin, _ = begun(problem, structure, drives, solution.first)
    for number, (stretch, plain) in enumerate(zip(problem.stretches, drives, strict=True)):
        windows = [k for k, w in enumerate(problem.windows) if w.stretch == number]
        for _ in range(draws):
            moved = drive(structure, solution.p, _with_other_times(stretch, rng))
            if unlogged and unlogged.gusty:
                gusts = blown(structure, solution.p, stretch, unlogged.gusty, rng)
                moved = replace(moved, wind=moved.wind + gusts)
            for k in windows:
                w, first = problem.windows[k], begin[k]
                other = first.copy()
                other[3:6] += rng.standard_normal(3) * stretch.sigmas[w.first] * smoothed
                runs = [
                    run(structure, d, stretch, x, w.first, w.steps)[:, 3:6]
                    for d, x in ((plain, first), (moved, other))
                ]
                square += np.nansum(np.minimum((runs[0] - runs[1]) ** 2, 1e2), axis=0)
                n += len(runs[0])
    return np.asarray(square / max(n, 1), dtype=float)


def _with_other_times(stretch: Stretch, rng: np.random.Generator) -> Stretch:
    """The stretch with every logged change of an input up to half an interval earlier or later."""
    inputs = {
        name: replace(m, t=m.t + rng.uniform(-0.5, 0.5, len(m.t)) * m.sample_time)
        for name, m in stretch.inputs.items()
    }
    return replace(stretch, inputs=inputs)


def folds(fitted: Fitted) -> list[list[int]]:
    """Windows in five parts by turns, so that every log is in every part's complement."""
    n = len(fitted.problem.windows)
    return [list(range(k, n, 5)) for k in range(min(5, n))]


def _bounded(fitted: Fitted, p: FloatArray) -> FloatArray:
    slots = fitted.solution.structure.slots
    return np.clip(p, [s.parameter.bounds[0] for s in slots], [s.parameter.bounds[1] for s in slots])


def _solve_where_known(m: FloatArray, right: FloatArray) -> FloatArray:
    """Solution of a symmetric system of unit diagonal, along the directions that the other parts determine."""
    values, vectors = np.linalg.eigh(m)
    good = values > 1e-6 * values[-1]
    return np.asarray(vectors[:, good] @ ((vectors[:, good].T @ right) / values[good]), dtype=float)


def cross_validated(fitted: Fitted) -> dict[str, float]:
    """RMSE of u, v, r over windows, each part predicted by the parameters that the other parts give.

    The parameters without a part follow from the normal equations of the others, to first order: of a fit far from the
    noise they may be far off. Infinite where a prediction ran away.
    """
    reduced = fitted.solution.reduced
    information = information_of(fitted.solution, fitted.prior)
    total = []
    for fold in folds(fitted):
        left = information - reduced.information[fold].sum(axis=0)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(left), 1e-300))
        move = -scale * _solve_where_known(
            left * scale * scale[:, None], scale * reduced.score[fold].sum(axis=0)
        )
        p = _bounded(fitted, fitted.solution.p + np.nan_to_num(move))
        first = fitted.solution.first - reduced.state_slope @ (p - fitted.solution.p)
        with np.errstate(over="ignore", invalid="ignore"):
            error, _ = window_errors(fitted, p, first, fold)
        total.append(np.where(np.abs(error) < OUT_OF_BOUNDS, error, np.inf))
    rmse = np.sqrt(np.mean(np.vstack(total) ** 2, axis=0))
    return {c: float(rmse[j]) for j, c in enumerate(("u", "v", "r"))}
