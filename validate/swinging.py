"""Effects that swing by themselves: their own valley is narrow, and bent all the way from none of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from identify.base_fit import SHORT
from identify.rough_fit import roughly
from identify.settled import Settled, settled
from identify.structure import Structure
from identify.windows import Problem
from ingest.errors import NotIdentifiable

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Windows in which what swings is begun are no shorter, s.
BRIEFEST = 2.0


def swings(structure: Structure) -> bool:
    """Whether the last effect swings by itself."""
    return any(s.parameter.shape for s in structure.slots if s.effect == len(structure.actives) - 1)


def begun_swinging(structure: Structure, problem: Problem, starts: Sequence[FloatArray]) -> Settled:
    """Where what swings is nearest, of several starts (np,): far off the noise no first order tells which is best."""
    begins = [_begun(structure, problem, p) for p in starts]
    return min(begins, key=lambda x: x.cost if np.isfinite(x.cost) else np.inf)


def _begun(structure: Structure, problem: Problem, p: FloatArray) -> Settled:
    """A rough fit in windows of one period: longer ones have a valley for every swing in them."""
    own = structure.values(p, len(structure.actives) - 1)
    length = min(max(2.0 * math.pi / own["frequency"], BRIEFEST), SHORT, problem.length)
    with suppress(NotIdentifiable):
        p = roughly(structure, problem.stretches, p, length)
    return settled(problem, structure, p)
