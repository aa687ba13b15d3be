"""Coefficients whose columns are the same on the data, told as one: a thrust at constant rate of turn and a constant.

The fit itself keeps them all, and its prediction is the sum: only what is told of it is put in one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.estimators.estimate import Settings
from identify.estimators.solve import dependences
from identify.fit import Estimated
from identify.fitted import Fitted
from identify.regression import regressors
from identify.slot import Slot
from identify.structure import Structure
from identify.written import plus_minus

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Relative singular value of the scaled columns of an equation below which they count as the same.
TOLERANCE = Settings.tolerance


@dataclass(frozen=True)
class Same:
    """The parameter ``given_up``, whose column is those of ``kept``, each times its share."""

    given_up: int
    kept: tuple[int, ...]
    shares: tuple[float, ...]

    def other_way(self) -> Same:
        """The one that was kept given up."""
        return Same(self.kept[0], (self.given_up,), (1.0 / self.shares[0],))


def same_columns(fitted: Fitted) -> tuple[Same, ...]:
    """The model's own coefficients whose columns are others' on the data.

    What is named first is kept, unless the sum is beyond its bounds: no propeller drives astern for a headwind.
    """
    structure, p = fitted.solution.structure, fitted.solution.p
    design = np.vstack([regressors(structure, p, s) for s in fitted.problem.stretches])
    found = [s for mine, columns in _equations(structure) for s in _same(design[:, columns], mine)]
    either = [(s, *([s.other_way()] if len(s.kept) == 1 else [])) for s in found]
    may_be = [[s for s in pair if _within(s, structure.slots, p)] for pair in either]
    return tuple(possible[0] for possible in may_be if possible)


def _within(same: Same, slots: Sequence[Slot], p: FloatArray) -> bool:
    bounds = [slots[k].parameter.bounds for k in same.kept]
    sums = [p[k] + share * p[same.given_up] for k, share in zip(same.kept, same.shares, strict=True)]
    return all(low <= x <= high for x, (low, high) in zip(sums, bounds, strict=True))


def _equations(structure: Structure) -> list[tuple[list[int], list[int]]]:
    """Per equation the places of the model's own coefficients, and their columns."""
    out = []
    for mine, columns in structure.layout.by_equation:
        own = [(int(k), int(c)) for k, c in zip(mine, columns, strict=True) if _is_own(structure.slots[k])]
        out += [([k for k, _ in own], [c for _, c in own])] if len(own) > 1 else []
    return out


def _is_own(slot: Slot) -> bool:
    return slot.effect < 0 and not slot.nuisance and slot.term is not None


def _same(design: FloatArray, mine: Sequence[int]) -> list[Same]:
    scale = np.linalg.norm(design, axis=0)
    factor: FloatArray = np.asarray(np.linalg.qr(design / np.where(scale > 0.0, scale, 1.0), mode="r"))
    out = []
    for d in dependences(factor, TOLERANCE)[1]:
        others = list(d.others)
        if others:
            shares = np.linalg.lstsq(factor[:, others], factor[:, d.column], rcond=None)[0]
            shares = shares * scale[d.column] / scale[others]
            out.append(Same(mine[d.column], tuple(mine[k] for k in others), tuple(map(float, shares))))
    return out


def merging(same: Sequence[Same], count: int) -> FloatArray:
    """Matrix (np, np) that puts what is given up into what is kept."""
    out = np.eye(count)
    for s in same:
        out[s.given_up, s.given_up] = 0.0
        out[s.kept, s.given_up] = s.shares
    return out


def merged_into(same: Same, told: Mapping[int, Estimated]) -> Estimated:
    """What is given up, as it is told."""
    into = " and ".join(told[k].name for k in same.kept)
    return replace(told[same.given_up], identifiable=False, at_bound=False, reason=f"merged into {into}")


def merged_words(same: Same, told: Mapping[int, Estimated]) -> str:
    """What is to be said of it, by the coefficients as they are ``told`` at their places."""
    gone, terms = told[same.given_up].name, [told[k].term for k in (*same.kept, same.given_up)]
    into = " and ".join(told[k].name for k in same.kept)
    if len(same.kept) > 1:
        return f"{gone} is merged into {into}: on these data {terms[-1]} is a combination of {', '.join(terms[:-1])}."
    both = told[same.kept[0]]
    first, second, ratio = (
        (*terms, 1.0 / same.shares[0]) if terms[0] != "1" else (*terms[::-1], same.shares[0])
    )
    times = f"{ratio:.4g}" if second == "1" else f"{ratio:.4g} {second}"
    value = plus_minus(both.value, both.stderr) + ("" if both.unit == "1" else f" {both.unit}")
    return (
        f"{gone} is merged into {into}: on these data {first} = {times}, and only the sum of both is known, "
        f"{into} = {value}."
    ).replace("-", "−")
