"""What drives a stretch for given parameters: channels, coefficients, current, air and sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.acting import Share, constant_channels, shares_of, summed
from identify.steady import loaded, steady, values_of
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@dataclass(frozen=True)
class Drive:
    """Everything that the compiled rollout and the measurement equation need, beside the initial state.

    ``channels`` (n, nc) mean over each step and ``slopes`` (n, nc) of the straight line with the same first moment (end
    less middle), made of a ``constant`` (nc,) and what the inputs put in, the ``shares``; ``coefficients`` (p,),
    ``wind`` (n, 2), ``current`` (2,), ``sensor`` (9,); ``factor`` (p,) is what effects on loading make of each
    coefficient in this log (already in ``coefficients``); ``u0`` the speed that terms in Δu are about, m/s.
    """

    channels: FloatArray
    slopes: FloatArray
    constant: FloatArray
    shares: tuple[Share, ...]
    coefficients: FloatArray
    wind: FloatArray
    current: FloatArray
    sensor: FloatArray
    factor: FloatArray
    u0: float = 0.0

    @cached_property
    def fine(self) -> FloatArray:
        """The channels (nc, n·SUBSTEPS) on the fine grid."""
        out = np.empty((len(self.constant), len(self.channels) * SUBSTEPS))
        out[...] = self.constant[:, None]
        for share in self.shares:
            out[list(share.places)] += share.fine
        return out


def drive(structure: Structure, p: FloatArray, stretch: Stretch) -> Drive:
    """Evaluate effects on inputs, water, air, loading and sensors for one stretch."""
    return drives(structure, p, [stretch])[0]


def drives(structure: Structure, p: FloatArray, stretches: Sequence[Stretch]) -> list[Drive]:
    """The same for several stretches; what is the same in all their logs is evaluated once."""
    values, constant, found = values_of(structure, p), constant_channels(structure, p), []
    logs = {loaded(structure, s.name): s.name for s in stretches}
    still = {kind: steady(structure, p, values, log) for kind, log in logs.items()}
    for stretch in stretches:
        rest, shares = still[loaded(structure, stretch.name)], shares_of(structure, p, values, stretch)
        mean, slope = summed(constant, shares, stretch)
        found.append(Drive(
            mean, slope, constant, tuple(shares), rest.coefficients, stretch.wind + rest.air, rest.current, rest.sensor,
            rest.factor, structure.u0_at(p),
        ))  # fmt: skip
    return found
