"""How what drives a stretch changes with the general parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identify.acting import Share, flow_channels, lead_slot, shares_of, summed
from identify.drive import Drive
from identify.effect import Effect
from identify.kernel import CHANNEL
from identify.resample import rates, straight_lines
from identify.steady import SteadySlopes, loaded, moved, steady_slopes, values_of
from identify.stretch import SUBSTEPS, Stretch
from identify.structure import Structure
from identify.term import FACTORS

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: How far a parameter is moved to tell what its inputs answer, as a part of how far it is to either side.
NEAR = 0.1
#: Where the air's velocity stands among the places that a parameter may move.
AIR = (12, 13)
#: Place, derivative and derivative of the slope (n,) of what a parameter moves over time.
_Moving = tuple[int, FloatArray, FloatArray]


@dataclass(frozen=True)
class Directions:
    """Derivatives of a drive along each general parameter (ng of them).

    ``coefficients`` (ng, p), ``current`` (2, ng), ``sensor`` (9, ng). Of channels, and of the air's velocity over the
    water, only what moves: ``driven`` (d, 2) places (``identify.kernel.CHANNEL`` on, or ``AIR``) and parameters,
    ``values`` (n, d) the derivatives at each step and ``slopes`` (n, d) those of the lines' slopes.
    """

    coefficients: FloatArray
    driven: IntArray
    values: FloatArray
    slopes: FloatArray
    current: FloatArray
    sensor: FloatArray


def directions(structure: Structure, p: FloatArray, stretch: Stretch, here: Drive) -> Directions:
    """Derivatives of the drive ``here`` along the general parameters, by central differences of the drive alone."""
    return all_directions(structure, p, [stretch], [here])[0]


def all_directions(
    structure: Structure, p: FloatArray, stretches: Sequence[Stretch], here: Sequence[Drive]
) -> list[Directions]:
    """The same for several stretches; what is the same in all their logs is differentiated once."""
    logs = {loaded(structure, s.name): s.name for s in stretches}
    still = {kind: steady_slopes(structure, p, log) for kind, log in logs.items()}
    return [
        _directions(structure, p, s, d, still[loaded(structure, s.name)])
        for s, d in zip(stretches, here, strict=True)
    ]


def _directions(
    structure: Structure, p: FloatArray, stretch: Stretch, here: Drive, still: SteadySlopes
) -> Directions:
    n, driven, columns = stretch.steps, [], []
    relative = still.air - still.current
    for g, k in enumerate(structure.general):
        steady = (
            (place, np.full(n, v), np.zeros(n)) for place, v in zip(AIR, relative[:, g], strict=True) if v
        )
        for place, value, slope in (*steady, *_driven(structure, p, stretch, here, int(k))):
            driven.append((place, g))
            columns.append((value, slope))
    values, slopes = (np.empty((n, len(columns))) for _ in range(2))
    for j, (value, slope) in enumerate(columns):
        values[:, j], slopes[:, j] = value, slope
    places = np.array(driven, dtype=np.int64).reshape(-1, 2)
    return Directions(still.coefficients, places, values, slopes, still.current, still.sensor)


def _driven(structure: Structure, p: FloatArray, stretch: Stretch, here: Drive, k: int) -> Iterator[_Moving]:
    """What one general parameter moves of the factors and channels."""
    n, slot = stretch.steps, structure.slots[k]
    if slot.effect >= 0:
        if _moves_inputs(structure.actives[slot.effect].effect):
            yield from _by_input(structure, p, stretch, here, k)
    elif k == structure.u0_place:
        yield FACTORS.index("Δu"), np.full(n, -1.0), np.zeros(n)
    elif k == lead_slot(structure):
        yield from _changing(*_by_lead(here, stretch))
    else:
        carrying = {place: name for name, place in flow_channels(structure).items()}
        if k in carrying:
            yield CHANNEL + structure.table.channels.index(carrying[k]), np.ones(n), np.zeros(n)


def _by_input(
    structure: Structure, p: FloatArray, stretch: Stretch, here: Drive, k: int
) -> Iterator[_Moving]:
    """What a parameter moves by the inputs that it acts on."""
    answering = structure.actives[structure.slots[k].effect].variant.inputs
    end, begin = _ends(structure, p, k)
    there = _shares(structure, end, stretch, answering)
    units = {share.unit for share in there}
    known = [share for share in here.shares if share.unit in units]
    others = known if begin is p else _shares(structure, begin, stretch, answering)
    nothing = np.zeros(len(structure.table.channels))
    (mean, slope), (less, flatter) = (summed(nothing, some, stretch) for some in (there, others))
    width = end[k] - begin[k]
    yield from _changing((mean - less) / width, (slope - flatter) / width)


def _ends(structure: Structure, p: FloatArray, k: int) -> tuple[FloatArray, FloatArray]:
    """Parameters that a derivative is told from: beside ``p`` and ``p`` itself, of which all is known.

    What answers in steps is told from either side: between two of them nothing moves.
    """
    active = structure.actives[structure.slots[k].effect]
    if active.effect.stepwise is not None and active.effect.stepwise(active.variant.options):
        return moved(structure, p, k, 1.0), moved(structure, p, k, -1.0)
    ahead = moved(structure, p, k, NEAR)
    return (ahead if ahead[k] != p[k] else moved(structure, p, k, -NEAR)), p


def _shares(structure: Structure, p: FloatArray, stretch: Stretch, answering: tuple[str, ...]) -> list[Share]:
    return shares_of(structure, p, values_of(structure, p), stretch, answering)


def _by_lead(here: Drive, stretch: Stretch) -> tuple[FloatArray, FloatArray]:
    """Derivatives (n, nc) of channels and slopes by a lead of all inputs: what they do a little later, they do now."""
    mean, slope = straight_lines(rates(here.fine, stretch.h / SUBSTEPS), SUBSTEPS)
    return mean, slope


def _changing(value: FloatArray, slope: FloatArray) -> Iterator[_Moving]:
    """The channels that change at all."""
    for k in np.nonzero(value.any(axis=0) | slope.any(axis=0))[0]:
        yield CHANNEL + int(k), value[:, k], slope[:, k]


def _moves_inputs(effect: Effect) -> bool:
    """Whether an effect changes what the actuators do."""
    return bool(effect.actuator or effect.gain or effect.input_delay or effect.rewire)
