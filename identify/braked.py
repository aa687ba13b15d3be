"""A fit without a resistance that drives: it would run away on logs that are faster than its own.

A rich model can follow logs of all speeds up to some with a cubic resistance that is less than none: beyond these it
drives itself. The water slows every fast motion down, so that the highest odd power in an equation's own motion has no
coefficient above zero. A search may pass through such, but a fit near the noise does not end there if it need not
leave the noise for that.
"""

from __future__ import annotations

from dataclasses import replace

from identify.first_states import first_states
from identify.fitted import NEAR, Fitted
from identify.output_error import solve

#: Steps of the search within the bounds, and the share of the cost that may be lost by them.
BUDGET, LOSS = 25, 0.02


def braked(fitted: Fitted) -> Fitted:
    """The fit with what drives it at speed at nothing, where it is near the noise with it and, as good as, without."""
    s = fitted.solution
    bounded = replace(s.structure, slows=True)
    drives = any(p > b.parameter.bounds[1] for p, b in zip(s.p, bounded.slots, strict=True))
    if not drives or fitted.chi2_per_dof > NEAR:
        return fitted
    anchor = first_states(fitted.problem)
    found = solve(fitted.problem, bounded, s.p, s.first, fitted.prior, anchor=anchor, budget=BUDGET)
    return replace(fitted, solution=found) if found.total < (1.0 + LOSS) * s.total else fitted
