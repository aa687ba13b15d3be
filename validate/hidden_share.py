"""What of a candidate's gain the inputs' own gaps would give the fit without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.fitted import Fitted
from identify.noise import dispersed_cost
from identify.windows import Problem
from validate.refits import under


def accounted_for(base: Fitted, there: Fitted) -> float:
    """What a fit is likelier by, in 2 log likelihood, with its inputs' gaps as it answers to them itself.

    Weights are those that the best candidate leaves behind, and with them what is hidden is what *it* answers to. A
    late or lagging input may make up for what lies between the samples of one that is logged seldom: the fit without
    it, weighed as if little were hidden, or much that it would never show, loses what it knew.

    Parameters
    ----------
    base : Fitted
        The fit without candidates under its own weights.
    there : Fitted
        The same fit under the weights of the best of them.
    """
    known, weights = base.problem.unlogged, there.problem
    if known is None:
        return 0.0
    own = under(replace(weights, unlogged=known.over(weights)), there)
    theirs, its = (dispersed_cost(f.problem, f.solution) + _log_determinant(f.problem) for f in (there, own))
    return max(0.0, theirs - its) if np.isfinite(its) else 0.0


def _log_determinant(problem: Problem) -> float:
    """Logarithm of the determinant of the errors' covariance, over that of white noise."""
    return 0.0 if problem.whitening is None else -float(np.sum(np.log1p(-problem.whitening.shrink)))
