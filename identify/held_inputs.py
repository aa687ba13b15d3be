"""Whether inputs go straight between their samples or hold until the next, as the motion says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.base_fit import SHORT, fit_from_scratch
from identify.output_error import solve
from identify.prepare import Prepared, prepare
from preprocess.trial import Trial


def prepare_best(trials: Sequence[Trial], model: str) -> Prepared:
    """Prepare trials with their inputs read as the motion says: straight between samples, or held until the next.

    A command that is changed at every sample looks like a measured angle; the likelihood tells.
    """
    plain = prepare(trials, model)
    if all(m.held or m.sample_time < 0.03 for s in plain.identify for m in s.inputs.values()):
        return plain
    held = prepare(trials, model, held=True)
    one, other = (fit_from_scratch(p.structure, p.identify, length=SHORT, rounds=1) for p in (plain, held))
    here = replace(one.problem, unlogged=None)
    sigma = zip(other.problem.stretches, one.problem.stretches, strict=True)
    there = replace(
        other.problem.weighted_as(here), stretches=tuple(replace(a, samples=b.samples) for a, b in sigma)
    )
    costs = [
        solve(q, f.solution.structure, f.solution.p, f.solution.first, f.prior, budget=5).cost
        for q, f in ((here, one), (there, other))
    ]
    return plain if costs[0] <= costs[1] or not np.isfinite(costs[1]) else held
