"""Values of an effect that a search does not come to from where it is.

The size that an input must pass has no slope to search along; the place of an antenna has several valleys.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.base_fit import short_windows, tried
from identify.fitted import Fitted
from identify.in_common import in_common
from identify.input_sizes import between, sizes_of
from identify.rough_fit import roughly
from identify.structure import effects_alone
from preprocess.cores import side_by_side
from validate.refits import begun_at

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A size that an input passes is searched by steps of the first share of it, down to the second.
WIDEST, NARROWEST = 0.08, 0.002
#: Steps of a refit at another size, as long as it may come lower, and of one that is begun anew.
PATIENT, FOLLOWED = 60, 20


def at_likeliest_size(fitted: Fitted) -> Fitted:
    """The fit with the size that the last effect asks an input to pass where the measurements want it.

    What only asks whether an input passes a size has no slope to search along: sizes to both sides are tried, all else
    free, at half the distance where neither is better. The hull may have been bent to a wrong one, and the inputs be
    thought to hide what that leaves: it is begun anew between any two sizes that the input has, too.
    """
    k = _size_of_last(fitted)
    if k is None:
        return fitted
    anew = begun_between_sizes(fitted)
    starts = (fitted,) if anew is fitted else (fitted, anew)
    return min((_on_both_sides(start, k) for start in starts), key=lambda f: f.solution.total)


def _on_both_sides(best: Fitted, k: int) -> Fitted:
    """The fit with the size in place ``k`` where neither a larger nor a smaller one is better."""
    low, high = best.solution.structure.slots[k].parameter.bounds
    share = WIDEST
    while share > NARROWEST:
        size = float(best.solution.p[k])
        sides = [_at_size(best, k, min(max(size * by, low), high)) for by in (1.0 - share, 1.0 + share)]
        nearest = min(sides, key=lambda f: f.solution.total)
        if nearest.solution.total < best.solution.total:
            best = nearest
        else:
            share *= 0.5
    return best


def begun_between_sizes(fitted: Fitted) -> Fitted:
    """The nearest of a fit and those begun roughly with the size of its last effect between any two of the input's."""
    k = _size_of_last(fitted)
    if k is None:
        return fitted
    structure, stretches = fitted.solution.structure, fitted.problem.stretches
    most = structure.slots[k].parameter.bounds[1]
    sizes = between(sizes_of(stretches, *structure.actives[-1].variant.inputs), most)
    return _begun_with(fitted, k, sizes)


def begun_all_over(fitted: Fitted) -> Fitted:
    """The nearest of a fit and those begun roughly with its last effect at places all over what is possible for it."""
    structure, best = fitted.solution.structure, fitted
    for k, slot in enumerate(structure.slots):
        places, bounds = slot.parameter.places, slot.parameter.bounds
        if places and slot.effect == len(structure.actives) - 1:
            best = _begun_with(best, k, np.linspace(*bounds, places + 2)[1:-1])
    return best


def _begun_with(fitted: Fitted, k: int, values: Sequence[float] | FloatArray) -> Fitted:
    """The nearest of a fit and those begun roughly with one parameter at other values."""
    structure, stretches = fitted.solution.structure, fitted.problem.stretches
    known, length = effects_alone(structure, fitted.solution.p), short_windows(fitted.problem, structure)

    def begun(value: float) -> Fitted | None:
        p = np.where(np.arange(len(known)) == k, value, known)
        return tried(lambda: begun_at(fitted, roughly(structure, stretches, p, length), FOLLOWED))

    found = side_by_side(begun, list(values), shared=in_common(fitted))
    return min((f for f in (fitted, *found) if f), key=lambda f: f.solution.total)


def _at_size(fitted: Fitted, k: int, size: float) -> Fitted:
    p = fitted.solution.p.copy()
    p[k] = size
    found = begun_at(fitted, p, PATIENT, target=fitted.solution.total)
    return found if np.isfinite(found.solution.total) else fitted


def _size_of_last(fitted: Fitted) -> int | None:
    """Place of the parameter by which the last effect asks whether its input passes a size; None where none does."""
    structure = fitted.solution.structure
    last = structure.actives[-1] if structure.actives else None
    if last is None or not last.effect.stepwise or not last.effect.stepwise(last.variant.options):
        return None
    return next(k for k, s in enumerate(structure.slots) if s.effect == len(structure.actives) - 1)
