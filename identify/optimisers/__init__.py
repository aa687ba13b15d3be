"""Optimisers behind ask and tell: saved, resumed and repeated from their state alone."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from .adaptive_beetle_swarm import ABSAS
from .ant_colony import ACO_R
from .bee_colony import ABC
from .beetle_swarm import BSAS
from .covariance_matrix import CMAES
from .differential_evolution import DE
from .grid import CV
from .multistart import MULTISTART
from .particle_swarm import LDWPSO, PSO
from .search import generation, minimise, resume
from .state import Minimum, Optimiser, State, StopReason

ALL: tuple[Optimiser[Any], ...] = (ABC, ACO_R, BSAS, ABSAS, PSO, LDWPSO, CV, CMAES, DE, MULTISTART)
OPTIMISERS: Mapping[str, Optimiser[Any]] = MappingProxyType({o.name: o for o in ALL})

__all__ = [
    "OPTIMISERS",
    "Minimum",
    "Optimiser",
    "State",
    "StopReason",
    "generation",
    "minimise",
    "resume",
]
