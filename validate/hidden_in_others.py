"""What the inputs of other logs hide between their samples, where those of the fit's own logs hide nothing.

Orders that are logged as often as they are given are entered with the step at which they are given or with the next, as
it happens: in some logs always with the one, in others now with the one and now with the other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.first_states import first_states
from identify.fitted import AtNoise, Fitted
from identify.noise import in_noise
from identify.output_error import Prior, solve
from identify.unlogged import most_likely

#: Steps in which first states are fitted anew.
STEPS = 8


def as_they_hide(other: Fitted, near: AtNoise) -> Fitted:
    """A fit looked at on other logs, with what their inputs hide; as it is unless it comes ``near`` the noise by it."""
    problem, s = other.problem, other.solution
    hides = problem.unlogged is not None and problem.unlogged.share > 0.0
    if hides or other.chi2_per_dof < near.chi2_per_dof or not np.isfinite(s.cost):
        return other
    bare = replace(problem, inflation=np.ones(4), unlogged=None)
    known = most_likely(bare, s.structure, s.p, in_noise(problem, s.moments), pushes=problem.pushes)
    if known is None or not known.share:
        return other
    hiding, held = replace(problem, unlogged=known), Prior.held(s.p)
    found = solve(hiding, s.structure, s.p, s.first, held, anchor=first_states(hiding), budget=STEPS)
    followed = replace(other, problem=hiding, solution=found)
    return followed if followed.chi2_per_dof < near.chi2_per_dof else other
