"""Stretches cut into short windows that follow each other."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Length of the windows for a vessel of one metre, s; it grows with the root of the length.
LENGTH = 5.0
#: A channel that hardly varies in a log counts as if it varied by this share of its spread over all logs.
LEAST = 0.1
#: Places of u, v, r in the state.
UVR = slice(3, 6)


@dataclass(frozen=True)
class Piece:
    """A window of one stretch: ``steps`` from ``begin``, ``opens`` where the stretch begins with it."""

    stretch: int
    begin: int
    steps: int
    opens: bool


@dataclass(frozen=True)
class Chain:
    """Stretches in pieces that follow each other, stretch by stretch.

    ``spread`` (stretches, 3) of u, v, r in each; ``measured`` per stretch the states (steps + 1, 3) that are compared.
    """

    structure: Structure
    stretches: tuple[Stretch, ...]
    pieces: tuple[Piece, ...]
    spread: FloatArray

    def without(self, stretches: Collection[int]) -> Chain:
        """The same without some stretches."""
        kept = tuple(p for p in self.pieces if p.stretch not in stretches)
        return Chain(self.structure, self.stretches, kept, self.spread)


def chain_of(structure: Structure, stretches: Sequence[Stretch]) -> Chain:
    """Cut stretches into pieces, and find how much u, v and r vary in each."""
    length = LENGTH * max(1.0, float(np.sqrt(structure.vessel.length)))
    pieces = [p for k, s in enumerate(stretches) for p in _pieces(k, s, length)]
    return Chain(structure, tuple(stretches), tuple(pieces), spreads(stretches))


def spreads(stretches: Sequence[Stretch]) -> FloatArray:
    """Standard deviation (stretches, 3) of u, v, r in every stretch, no less than a share of that over all of them."""
    overall = np.vstack([s.states[:, UVR] for s in stretches]).std(axis=0)
    own = np.array([s.states[:, UVR].std(axis=0) for s in stretches])
    return np.asarray(np.maximum(own, LEAST * overall) + 1e-9, dtype=float)


def _pieces(index: int, stretch: Stretch, length: float) -> list[Piece]:
    edges = np.linspace(0, stretch.steps, max(1, round(stretch.steps * stretch.h / length)) + 1).astype(int)
    return [Piece(index, int(a), int(b - a), k == 0) for k, (a, b) in enumerate(pairwise(edges))]
