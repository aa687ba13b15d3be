"""A table of terms as a tape: every product of factors formed once, from two earlier values, for all equations.

Values are numbered: the factors (``identify.term.FACTORS``), the channels, then the products in their order. What the
accelerations are is a sum over some of the values, each times a row of coefficients, one per equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identify.aligned import aligned
from identify.flow import RESULTS, ROOM
from identify.term import FACTORS

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
PlaceArray = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]

#: Equations (u, v, r, e1, e2), padded to what is worked on abreast.
ROW = 8
#: Summands are worked on in groups of this many.
GROUP = 4
#: What a tape needs beside the velocities: speed and its inverse, the air, states of its own, the flow behind the hull.
NEEDS = (("U", "/U"), ("Vwx", "Vwy"), ("e1", "e2"), RESULTS)


class Steps(NamedTuple):
    """What the compiled code takes of a tape.

    ``left``, ``right`` (t,) places of the two values of each product, ``single`` (m,) places of the other summands,
    t and m multiples of ``GROUP`` (what was added to make them so counts nothing); ``needs`` (4,) what of ``NEEDS``
    there is; ``base`` number of factors and channels, which is the place of the first product. ``flow_place`` (10,)
    and ``flow`` (11,) are what ``identify.flow_behind.flow`` takes, empty without one.
    """

    left: PlaceArray
    right: PlaceArray
    single: PlaceArray
    needs: IntArray
    base: int
    flow_place: PlaceArray
    flow: FloatArray


@dataclass(frozen=True)
class Tape:
    """Products and sums that a table stands for.

    Attributes
    ----------
    steps : Steps
    value : (p,)
        Place of the value that each coefficient is multiplied with.
    target : (p,)
        Where each coefficient goes in the flat rows of coefficients: a row for every product, then for every single.
    """

    steps: Steps
    value: PlaceArray
    target: IntArray

    @property
    def values(self) -> int:
        """Number of values, and room for what the flow gives."""
        return self.steps.base + len(self.steps.left) + ROOM

    @property
    def summands(self) -> int:
        """Number of rows of coefficients."""
        return len(self.steps.left) + len(self.steps.single)

    def rows(self, coefficients: FloatArray) -> FloatArray:
        """Flat rows (summands · ROW,) of coefficients (p,), one place per equation in each."""
        sums = np.bincount(self.target, weights=coefficients, minlength=self.summands * ROW)
        return aligned(np.asarray(sums, dtype=float))


def tape_of(
    product: IntArray, equation: IntArray, channels: int, flow_place: PlaceArray, flow: FloatArray
) -> Tape:
    """Write a table of products (p, factors) in equations (p,) as a tape."""
    base = len(FACTORS) + channels
    wanted = [tuple(sorted(int(f) for f in row if f)) for row in product]
    order = _in_order(wanted)
    known = {(): 0} | {(k,): k for k in range(base)} | {f: base + k for k, f in enumerate(order)}
    pairs = [tuple(known[part] for part in _halves(f)) for f in order]
    values = [known[f] for f in wanted]
    singles = [v for v in dict.fromkeys(values) if v < base]
    pairs += [(0, 0)] * (-len(pairs) % GROUP)
    row = {base + k: k for k in range(len(pairs))} | {v: len(pairs) + k for k, v in enumerate(singles)}
    singles += [0] * (-len(singles) % GROUP)
    target = np.array([ROW * row[v] for v in values], dtype=np.int64) + equation
    left, right = (np.array([p[k] for p in pairs], dtype=np.uint64) for k in (0, 1))
    steps = Steps(
        left, right, np.array(singles, dtype=np.uint64), _needs(product, equation), base, flow_place, flow
    )
    return Tape(steps, np.array(values, dtype=np.uint64), target)


def _halves(factors: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The two parts that a product is formed from: what waits for no velocity apart, so that it is never waited for."""
    moving = sum(f < len(FACTORS) for f in factors)
    cut = moving if 0 < moving < len(factors) else len(factors) - 1
    return factors[:cut], factors[cut:]


def _in_order(wanted: Sequence[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """Every product that is formed on the way to those wanted, each after its parts, those of many steps last."""
    depth: dict[tuple[int, ...], int] = {}

    def steps(factors: tuple[int, ...]) -> int:
        if len(factors) < 2:
            return 0
        if factors not in depth:
            depth[factors] = 1 + max(steps(part) for part in _halves(factors))
        return depth[factors]

    for factors in wanted:
        steps(factors)
    return sorted(depth, key=depth.__getitem__)


def _needs(product: IntArray, equation: IntArray) -> IntArray:
    used = set(product.ravel().tolist())
    found = [any(FACTORS.index(f) in used for f in group) for group in NEEDS]
    found[2] = found[2] or bool((equation > 2).any())
    return np.array(found, dtype=np.int64)
