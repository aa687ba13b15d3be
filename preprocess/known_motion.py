"""Motion that is known beforehand: taken off the samples of a chain, so that only the rest need be guessed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from preprocess.chains import Segments, Stream, assemble, at_levels
from preprocess.first_levels import first_guess
from preprocess.intensity import fitted_cost
from preprocess.levels import Levels, thin_out
from preprocess.smoother import ChainResult
from preprocess.trial import FloatArray

#: Rows on which a chain with and without the known motion is compared, at most.
MOST_ROWS = 4_000


@dataclass(frozen=True)
class KnownMotion:
    """Motion of a chain: ``t`` (n,) s; ``parts`` (3, n, m): position, rate and acceleration."""

    t: FloatArray
    parts: FloatArray

    def at(self, t: FloatArray, order: int) -> FloatArray:
        """Position (order 0), rate or acceleration at any times, (k, m); straight on beyond the ends."""
        out = np.column_stack([np.interp(t, self.t, c) for c in self.parts[order].T])
        if order == 0:
            beyond = np.minimum(t - self.t[0], 0.0) + np.maximum(t - self.t[-1], 0.0)
            end = np.where((t < self.t[0])[:, None], self.parts[1][0], self.parts[1][-1])
            out += beyond[:, None] * end
        return np.asarray(out, float)


def less(streams: tuple[Stream, ...], known: KnownMotion) -> tuple[Stream, ...]:
    """The streams less the known motion."""
    return tuple(replace(s, value=s.value - known.at(s.t, s.order)) for s in streams)


def plus(chain: ChainResult, known: KnownMotion, streams: tuple[Stream, ...]) -> ChainResult:
    """The smoothed rest with the known motion; its streams show the measured values again."""
    motion = np.stack([known.at(chain.t, k) for k in range(3)], axis=1)
    measured = tuple(replace(a, value=b.value) for a, b in zip(chain.streams, streams, strict=True))
    return replace(chain, mean=chain.mean + motion, streams=measured)


def explains(streams: tuple[Stream, ...], known: KnownMotion, levels: Levels, segments: Segments) -> bool:
    """Whether what is left without the known motion is likelier than the whole, as an unknown motion."""
    return _cost(less(streams, known), levels, segments) < _cost(streams, levels, segments)


def _cost(streams: tuple[Stream, ...], levels: Levels, segments: Segments) -> float:
    assembled = assemble(streams, segments, np.empty(0))
    rows = at_levels(assembled, levels.sigma)
    return fitted_cost(thin_out(rows, assembled.stream, MOST_ROWS)[0], levels.q, first_guess(streams)[1])
