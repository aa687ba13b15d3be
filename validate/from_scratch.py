"""What the accelerations want most, fitted from scratch: far from the noise no step may lead to it from where a fit is.

A base that lacks much ends in a valley of its own, its coefficients bent to follow the motion without what is missing.
The accelerations have no valleys: a regression says what each candidate is worth whatever the base, and where.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.base_fit import fit_from_scratch, tried
from identify.fitted import Fitted
from identify.in_common import in_common
from preprocess.cores import side_by_side
from validate.candidates import Screened
from validate.pace import Pace


def from_scratch(base: Fitted, screened: Sequence[Screened], pace: Pace) -> list[tuple[Screened, Fitted]]:
    """Fits of the candidates that lead, without regard to the base, that follow the motion over windows as long.

    Each has rough weights of its own.
    """

    def fitted(one: Screened) -> Fitted | None:
        structure = base.solution.structure.with_effect(one.active)
        _, value = one.wanted or (0.0, one.unmoved)
        stretches, length = base.problem.stretches, base.problem.length
        return tried(lambda: fit_from_scratch(structure, stretches, value, length=length, rounds=0))

    leading = [s for s in screened if s.leads]
    known = [*in_common(base), *(s.active for s in leading)]
    found = side_by_side(fitted, leading, lambda s: pace(f"trying {s.active.label} from scratch"), known)
    return [(s, f) for s, f in zip(leading, found, strict=True) if f and _as_long(f, base)]


def _as_long(fitted: Fitted, base: Fitted) -> bool:
    finite = bool(np.isfinite(fitted.solution.total))
    return finite and len(fitted.problem.windows) == len(base.problem.windows)
