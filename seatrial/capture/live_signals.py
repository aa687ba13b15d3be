"""What of decoded tables is worth a curve: the fields that a campaign would take, and where the vessel is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ingest.log import Source
from seatrial.capture.decoders import Tables

FloatArray = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Points of the track; when there are more, every second one is left out.
MOST_POINTS = 4000
#: Columns that are shown of a topic of which nothing is known.
MOST_COLUMNS = 12
#: Metres per radian of latitude, mean.
RADIUS_M = 6_371_008.8


@dataclass(frozen=True)
class Sample:
    """New values of one signal.

    Attributes
    ----------
    quantity, label, unit : str
    time_ns : (n,) int64
    value : (n,)
        As decoded.
    position : (n, 2), optional
        Latitude and longitude, rad: then it is a place, not a value.
    rank : float
        Which of several positions to draw.
    """

    quantity: str
    label: str
    unit: str
    time_ns: Integers
    value: FloatArray
    position: FloatArray | None = None
    rank: float = 0.0


def samples_of(tables: Tables) -> Iterator[Sample]:
    """The signals in a batch of tables."""
    for source in (s for s in tables.sources if s.topic in tables.tables):
        if source.quantity == "position":
            yield from position_of(source, tables)
            continue
        table = tables.tables[source.topic]
        for column in source.fields.values():
            if column in table and table[column].dtype.kind in "iuf":
                unit = tables.units.get((source.topic, column), source.unit)
                yield Sample(source.quantity, f"{source.topic}.{column}", unit, table.index.to_numpy(np.int64),
                             table[column].to_numpy(np.float64))  # fmt: skip
    if tables.settled and not tables.sources:
        yield from everything(tables)


def everything(tables: Tables) -> Iterator[Sample]:
    """The first columns of all topics, where nothing is known of them."""
    for topic, table in tables.tables.items():
        for column in [c for c in table.columns if table[c].dtype.kind in "iuf"][:MOST_COLUMNS]:
            unit = tables.units.get((topic, column), "")
            yield Sample(
                topic,
                f"{topic}.{column}",
                unit,
                table.index.to_numpy(np.int64),
                table[column].to_numpy(float),
            )


def position_of(source: Source, tables: Tables) -> Iterator[Sample]:
    """Places, where they are in latitude and longitude."""
    from ingest.units import factor_to_si

    if "latitude" not in source.fields:
        return
    table, (factor, _) = tables.tables[source.topic], factor_to_si(source.unit)
    place = table[[source.fields["latitude"], source.fields["longitude"]]].to_numpy(np.float64) * factor
    good = np.isfinite(place).all(axis=1) & (np.abs(place).sum(axis=1) > 0)
    if good.any():
        times = table.index.to_numpy(np.int64)[good]
        yield Sample("position", source.topic, "rad", times, np.empty(0), place[good], source.rank)


@dataclass
class Track:
    """Where the vessel has been: of all sources the best, thinned as it grows."""

    _points: list[tuple[float, float]] = field(default_factory=list)
    _rank: float = -math.inf
    _every: int = 1
    _skipped: int = 0

    def add(self, place: FloatArray, rank: float) -> None:
        """Append latitudes and longitudes, (n, 2), rad."""
        if rank < self._rank:
            return
        if rank > self._rank:
            self._points, self._rank, self._every = [], rank, 1
        keep = place[self._skipped % self._every :: self._every] if self._every > 1 else place
        self._skipped += len(place)
        self._points += [(float(a), float(b)) for a, b in keep]
        if len(self._points) > MOST_POINTS:
            self._points, self._every = self._points[::2], 2 * self._every
        if not len(keep) and len(place):
            self._points[-1:] = [(float(place[-1, 0]), float(place[-1, 1]))]

    def plane(self) -> tuple[FloatArray, FloatArray]:
        """North and east of the first point, m, (n,) each; good enough for a picture of some kilometres."""
        place = np.array(self._points)
        north = (place[:, 0] - place[0, 0]) * RADIUS_M
        return north, (place[:, 1] - place[0, 1]) * RADIUS_M * math.cos(place[0, 0])
