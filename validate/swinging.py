"""Effects that swing by themselves: their own valley is narrow, and bent all the way from none of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

from identify.base_fit import short_windows
from identify.output_error import Solution
from identify.rough_fit import roughly, roughly_from
from identify.settled import Settled, settled
from identify.structure import Structure
from identify.windows import Problem
from ingest.errors import NotIdentifiable
from validate.search_ends import nearest, total

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Windows in which what swings is begun are no shorter, s.
BRIEFEST = 2.0
#: Steps from each of the begins; and so many more from so many of those that are ahead, and of those at no bound.
FEW, MORE, GONE_ON = 8, 20, 2


def searched_swinging(
    search: Callable[..., Solution],
    structure: Structure,
    problem: Problem,
    starts: Sequence[FloatArray],
    wanted: Sequence[FloatArray] = (),
    longer: int = 1,
) -> Solution:
    """Where the ``search`` of what swings ends, from the best of several starts (np,) and of those that are ``wanted``.

    Which of them leads to the lowest valley no first order tells, nor how near it begins; a few steps do. What the
    accelerations want comes with the coefficients that go with it. The last steps are so many times as many where it
    is to go on ``longer``: what began roughly comes late to a base that is near the noise.
    """
    begins = [_begun(structure, problem, p, roughly) for p in starts]
    begins += [_begun(structure, problem, p, roughly_from) for p in wanted]
    ends = sorted((search(x.p, x.first, budget=FEW) for x in begins), key=total)
    free = [x for x in ends[GONE_ON:] if not x.held.any()]
    return nearest([search(x.p, x.first, budget=longer * MORE) for x in ends[:GONE_ON] + free[:GONE_ON]])


def _begun(
    structure: Structure, problem: Problem, p: FloatArray, rough: Callable[..., FloatArray]
) -> Settled:
    """A rough fit in windows of one period: longer ones have a valley for every swing in them."""
    own = structure.values(p, len(structure.actives) - 1)
    length = min(max(2.0 * math.pi / own["frequency"], BRIEFEST), short_windows(problem, structure))
    with suppress(NotIdentifiable):
        p = rough(structure, problem.stretches, p, length)
    return settled(problem, structure, p)
