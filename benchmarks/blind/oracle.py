"""The oracle: the declared model with the true effects in it, fitted from the true values.

It says how well the truth itself would predict (so what the best answer is worth), how much worse the
prediction gets when an effect is left out (whether it can be detected at all), and which other effects would
fit as well in its place (whether it can be told apart).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.blind.naming import Entry, deviations, entry_of, sides
from fixtures.campaign import Run
from identify.base_fit import fit_from_scratch, window_length
from identify.effect import Active
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.noise import calibrated
from identify.output_error import prior_for, solve
from identify.parameter_covariance import covariance_of
from identify.prepare import Prepared, prepare
from identify.regression import coefficient_scales, start_by_regression
from identify.report_fit import fitted_effect
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters
from identify.windows import cut
from preprocess.trial import Trial
from validate.candidates import candidates, screen
from validate.diagnosis import Validation
from validate.look_alikes import dropped
from validate.other_logs import with_other_logs
from validate.refits import refit
from validate.scores import predictions, validation
from validate.structure_left import structured_share

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A fit with a lower cost per degree of freedom than this has reached the noise of the sensors.
NOISE = 1.1
#: How often the noise is calibrated anew.
ROUNDS = 3
#: Rivals of a true effect that are refitted in its place, those first that promise most.
RIVALS = 5
#: Rivals that lose less than this against the truth cannot be told from it (odds of 20 to 1).
INDISTINCT = 6.0


@dataclass(frozen=True)
class Truth:
    """What is fitted: the trials, the declared model, the entries of the true effects, and what really happened."""

    trials: tuple[Trial, ...]
    model: str
    effects: tuple[Entry, ...]
    runs: tuple[Run, ...]


def prediction_error(scores: Validation) -> float:
    """Return the free-running error on unseen logs: root of the channels' summed squared nrmse."""
    shares = [c.nrmse for c in scores.channels.values() if c.nrmse is not None]
    return math.sqrt(sum(s * s for s in shares))


def error_of(prepared: Prepared, fitted: Fitted) -> float:
    """Prediction error of a fit on the logs that validate."""
    stretches = prepared.validate
    runs = predictions(fitted.solution.structure, fitted.solution.p, stretches)
    return prediction_error(validation(prepared.structure, stretches, runs))


def active_of(true: Entry, structure: Structure) -> Active | None:
    """Return the product's own effect that says what the truth says; None where its library has none."""
    fitting = [a for a in candidates(structure) if a.effect.name == true["name"] and _fits(true, a)]
    return fitting[0] if fitting else None


def _fits(true: Entry, active: Active) -> bool:
    options = {k: list(v) if isinstance(v, tuple) else v for k, v in active.variant.options.items()}
    if "logs" in options:
        there = sides(options | {"among": true.get("among", ())})
        return sides(true) in (there, there[::-1])
    if true.get("input") and active.variant.input not in (None, true["input"]):
        return active.effect.name == "thrust_asymmetry"
    keys = ("stream", "form", "swapped", "reversed")
    return all(options.get(k) == true.get(k) for k in keys if k in true or k in options)


def start_values(true: Entry, active: Active) -> dict[str, float]:
    """Return the true parameters in the terms in which the product searches."""
    values = {k: float(v) for k, v in true["parameters"].items()}
    if true["name"] in ("current", "wind") and "speed" in values:
        sign = 1.0 if true["name"] == "current" else -1.0
        values["north"] = sign * values["speed"] * math.cos(values["direction"])
        values["east"] = sign * values["speed"] * math.sin(values["direction"])
    found = {"logs": active.variant.options.get("logs", ()), "among": true.get("among", ())}
    elsewhere = true["name"] == "thrust_asymmetry" and active.variant.input != true["input"]
    if elsewhere or sides(true) != sides(found):
        values = {k: 1.0 / v for k, v in values.items()}
    return values


def fit_truth(prepared: Prepared, effects: Sequence[Entry], runs: Sequence[Run]) -> Fitted | None:
    """Fit the declared model with the true effects, begun at their true values; None where there is none."""
    structure = prepared.structure
    values: dict[tuple[int, str], float] = {}
    for k, true in enumerate(effects):
        active = active_of(true, structure)
        if active is None:
            return None
        structure = structure.with_effect(active)
        values |= {(k, n): v for n, v in start_values(true, active).items()}
    p = null_parameters(structure)
    for i, slot in enumerate(structure.slots):
        p[i] = np.clip(values.get((slot.effect, slot.name), p[i]), *slot.parameter.bounds)
    near = start_by_regression(structure, p, [_as_it_was(s, runs) for s in prepared.identify], ridge=1e-8)
    found = fit_from(structure, prepared.identify, near)
    if found is not None and found.chi2_per_dof < NOISE:
        return found
    other = fit_from_scratch(structure, prepared.identify, p)
    return found if found is not None and found.chi2_per_dof < other.chi2_per_dof else other


def fit_from(structure: Structure, stretches: tuple[Stretch, ...], p: FloatArray) -> Fitted | None:
    """Fit from values near the truth, on long windows at once; None where that runs away."""
    prior = prior_for(structure, coefficient_scales(structure, p, stretches))
    problem = cut(stretches, window_length(structure.vessel.length))
    first = first_states(problem)
    for _ in range(ROUNDS):
        solution = solve(problem, structure, p, first, prior, anchor=first_states(problem), budget=25)
        if not np.isfinite(solution.cost):
            return None
        problem, p, first = calibrated(problem, solution), solution.p, solution.first
    return Fitted(problem, prior, solve(problem, structure, p, first, prior, anchor=first_states(problem)))


def _as_it_was(stretch: Stretch, runs: Sequence[Run]) -> Stretch:
    """Return a stretch with the true motion in place of the smoothed one."""
    truth = next(r.recording.truth for r in runs if stretch.name.startswith(r.name))
    t = np.asarray(stretch.start + stretch.h * np.arange(stretch.steps + 1), dtype=np.float64)
    t += _clock_of(stretch, t, truth.t, truth.psi)
    columns = (truth.x, truth.y, truth.psi, truth.u, truth.v, truth.r)
    return replace(stretch, states=np.column_stack([np.interp(t, truth.t, c) for c in columns]))


def _clock_of(stretch: Stretch, t: FloatArray, true_t: FloatArray, psi: FloatArray) -> float:
    """How far the log's first record was from the start of the truth, s: where the headings agree best."""
    offsets = np.arange(-1.0, 1.0, 0.02)
    misfit = [
        float(np.mean(1.0 - np.cos(np.interp(t + o, true_t, psi) - stretch.states[:, 2]))) for o in offsets
    ]
    return float(offsets[int(np.argmin(misfit))])


def consult(truth: Truth) -> dict[str, Any]:
    """Return what the oracle says of a case, as data for its record."""
    prepared = prepare(truth.trials, truth.model)
    full = fit_truth(prepared, truth.effects, truth.runs)
    if full is None:
        return {"missing": "an effect that the library does not have"}
    error = error_of(prepared, full)
    return {
        "error": error,
        "chi2": full.chi2_per_dof,
        "share": _share(prepared, full),
        "effects": [_of_effect(prepared, full, k, true, error) for k, true in enumerate(truth.effects)],
    }


def _share(prepared: Prepared, full: Fitted) -> dict[str, float]:
    """Structure that is left per channel with the truth in: the larger of fitted and unseen logs'."""
    own, unseen = structured_share(full), with_other_logs(full, prepared.validate)
    other = structured_share(unseen, prepared.identify) if unseen else own
    return {c: max(own[c], other[c]) for c in own}


def _of_effect(prepared: Prepared, full: Fitted, k: int, true: Entry, error: float) -> dict[str, Any]:
    effects = full.solution.structure.actives
    without = dropped(full, k)
    fitted, _ = fitted_effect(full.solution.structure, full.solution.p, covariance_of(full), k)
    found: dict[str, Any] = {
        "gain": without.solution.total - full.solution.total,
        "raises": error_of(prepared, without) / error,
        "parameters": {e.name: [e.value, e.stderr] for e in fitted.parameters},
        "deviations": deviations(true, entry_of(fitted, true.get("among", ()))),
    }
    return found | {"rivals": _rivals(full, without, effects[k]) if found["raises"] >= 1.2 else {}}


def _rivals(full: Fitted, without: Fitted, active: Active) -> dict[str, float]:
    """Loss in -2 log likelihood of the best rivals when they stand in the place of a true effect."""
    others = [a for a in candidates(without.solution.structure) if a.label != active.label]
    best = screen(without, others)[:RIVALS]
    fits = {s.active.label: refit(without, s) for s in best}
    losses = {label: f.solution.total - full.solution.total for label, f in fits.items()}
    return {label: loss for label, loss in sorted(losses.items(), key=lambda x: x[1]) if math.isfinite(loss)}


def separable(effect: Entry) -> bool:
    """Whether every rival loses clearly against a true effect."""
    return all(loss > INDISTINCT for loss in effect["rivals"].values())
