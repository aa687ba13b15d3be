"""What a search keeps to: what it does not look at, and the search it is held against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.base_fit import CLEARLY
from identify.fitted import Fitted

#: Names of effects.
Names = frozenset[str]
NONE: Names = frozenset()
#: Causes come one or two at a time: of more effects than these not all are believed.
BELIEVABLE = 2
#: Another search is given up where it stays so many times as far from the noise as the first came.
HOPELESS = 2.0


@dataclass(frozen=True)
class First:
    """How near the noise a first search came, as cost per degree of freedom, and with how many effects.

    Where it came to the noise (``at_noise``), another is worth its time as long as it needs fewer, or comes nearer. One
    that has nothing left to take is given up where it is so many times as far off as is ``hopeless``.
    """

    chi2_per_dof: float
    effects: float = np.inf
    at_noise: bool = False
    hopeless: float = HOPELESS

    def is_out_of_reach(self, fitted: Fitted, stuck: bool) -> bool:
        """Whether another search is hopeless: stuck far behind, or behind with as many effects."""
        if stuck and fitted.chi2_per_dof > self.hopeless * self.chi2_per_dof:
            return True
        many = len(fitted.solution.structure.actives) >= self.effects
        return many and CLEARLY * fitted.chi2_per_dof > self.chi2_per_dof

    def is_as_good(self, fitted: Fitted) -> bool:
        """Whether it came to the noise with no more effects than another has that is not clearly nearer."""
        many = len(fitted.solution.structure.actives) >= self.effects
        return self.at_noise and many and not fitted.chi2_per_dof < CLEARLY * self.chi2_per_dof


@dataclass(frozen=True)
class Within:
    """What a search keeps to.

    Effects whose names are ``barred`` are not looked at, nor are ``waves`` unless it may know of them. It is given up
    where the ``first`` search, that it is held against, is out of its reach.
    """

    barred: Names = NONE
    waves: bool = True
    first: First = First(np.inf)


#: A search that looks at everything, and to the end.
ALL = Within()


class GivenUp(Exception):
    """A search that stays farther off than another came."""
