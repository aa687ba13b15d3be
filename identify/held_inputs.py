"""Whether inputs go straight between their samples or hold until the next, as the motion says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.base_fit import SHORT
from identify.noise import calibrated
from identify.output_error import prior_for, solve
from identify.prepare import Prepared, prepare
from identify.regression import coefficient_scales
from identify.rough_fit import roughly
from identify.settled import settled
from identify.structure import null_parameters
from identify.windows import Problem, cut
from preprocess.trial import Trial

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Steps that either reading is fitted with in all short windows, from where it is best in some.
STEPS = 8


def prepare_best(trials: Sequence[Trial], model: str) -> Prepared:
    """Prepare trials with their inputs read as the motion says: straight between samples, or held until the next.

    A command that is changed at every sample looks like a measured angle; the likelihood tells.
    """
    plain = prepare(trials, model)
    if all(m.held or m.sample_time < 0.03 for s in plain.identify for m in s.inputs.values()):
        return plain
    held = prepare(trials, model, held=True)
    one, other = (
        roughly(p.structure, p.identify, null_parameters(p.structure), SHORT) for p in (plain, held)
    )
    problem = cut(plain.identify, SHORT)
    weights = calibrated(problem, settled(problem, plain.structure, one))
    costs = _cost(weights, plain, one), _cost(weights, held, other)
    return plain if costs[0] <= costs[1] or not np.isfinite(costs[1]) else held


def _cost(weights: Problem, prepared: Prepared, p: FloatArray) -> float:
    """What is left of the errors in the windows of ``weights``, with the inputs as they are prepared, from ``p`` on."""
    pairs = zip(prepared.identify, weights.stretches, strict=True)
    problem = replace(weights, stretches=tuple(replace(a, samples=b.samples) for a, b in pairs))
    structure, first = prepared.structure, settled(problem, prepared.structure, p).first
    prior = prior_for(structure, coefficient_scales(structure, p, problem.stretches))
    return solve(problem, structure, p, first, prior, budget=STEPS).cost
