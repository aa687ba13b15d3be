"""Fits begun anew: a search that began elsewhere may have stopped short, or in another valley."""

from __future__ import annotations

import numpy as np

from identify.base_fit import short_windows, tried
from identify.fitted import FAR, Fitted
from identify.rough_fit import roughly
from identify.structure import effects_alone
from validate.refits import begun_at
from validate.scan import WORTH, wanted_values
from validate.search_ends import total
from validate.sizes import begun_all_over, begun_between_sizes

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: So many of the valleys that the accelerations have are begun in.
VALLEYS = 3


def anew(fitted: Fitted, rounds: int = 2) -> Fitted:
    """The better of a fit and of others begun roughly with its effects' values, under the same weights.

    The last effect's are those that the accelerations want, too, in each of their valleys: near the noise in those that
    they do not want besides, for in noisy ones a valley is all that shows.
    """
    structure, best = fitted.solution.structure, begun_all_over(begun_between_sizes(fitted))
    found = wanted_values(structure, fitted.problem.stretches, best.solution.p)
    wanted = [p for gain, p in found[:VALLEYS] if gain > WORTH or best.chi2_per_dof < FAR]
    best = min([best, *(_begun_roughly(fitted, p) for p in wanted)], key=lambda f: total(f.solution))
    for _ in range(rounds):
        other = _begun_roughly(fitted, best.solution.p)
        if not other.solution.total < best.solution.total:
            return best
        enough = other.solution.total > 0.98 * best.solution.total
        best = other
        if enough:
            return best
    return best


def _begun_roughly(fitted: Fitted, p: FloatArray) -> Fitted:
    """The fit begun with the effects' values of ``p`` (np,), all else as short windows want it.

    As it is where these run away even there.
    """
    structure, problem = fitted.solution.structure, fitted.problem
    values, length = effects_alone(structure, p), short_windows(problem, structure)
    found = tried(lambda: begun_at(fitted, roughly(structure, problem.stretches, values, length), 20))
    return fitted if found is None else found
