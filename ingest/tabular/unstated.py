"""Units that no column states: what the numbers mean follows from the others beside them, or else from their size.

A heading goes with the course over the track, and its slope with the yaw rate; which of degrees and radians makes it
so decides. Only where nothing does, what fits into one turn is radians.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Source
from ingest.units import factor_to_si

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Option of a source whose unit is a guess: what the guess is from, and that of one which has nothing but its size.
GUESSED, SIZE = "unit_guessed", "its values"
#: A rudder that goes no further, rad, is in radians; it does not turn round.
LARGEST_RUDDER = 1.6
#: Just beyond one turn, rad.
ONE_TURN = 6.5
#: Signals are held against each other as means over steps of so many s, from so many steps on.
STEP, FEWEST = 1.0, 6
#: Rows that are looked at.
MOST_ROWS = 200_000
#: 1 − length of the mean of an angle less the course: more is scattered; and one unit's is this many times another's.
SCATTERED, TIMES = 0.05, 4.0
#: A heading that keeps to the course is that near, the other unit so far off, rad.
NEAR, FAR = np.radians(10.0), np.radians(30.0)
#: A yaw rate goes with the slope of a heading that turned so far, rad, from this correlation on.
TURNED, ALIKE = 0.2, 0.7
#: More than this for every radian is degrees: half-way, as factors go.
BETWEEN = float(np.sqrt(np.degrees(1.0)))


def guess_angle_unit(values: Floats) -> str:
    """Degrees or radians, from how an angle wraps, or else from how large it gets."""
    values = values[np.isfinite(values)]
    steps = np.abs(np.diff(values))
    if ((steps > 340) & (steps < 380)).any():
        return "deg"
    most = np.abs(values).max(initial=0.0)
    if ((steps > 5.9) & (steps < 6.6)).any() and most < 7:
        return "rad"
    return "deg" if most > ONE_TURN else "rad"


def _guess_rudder_unit(values: Floats) -> str:
    return "deg" if np.nanmax(np.abs(values), initial=0.0) > LARGEST_RUDDER else "rad"


def _guess_rate_unit(values: Floats) -> str:
    return "deg/s" if np.nanmax(np.abs(values), initial=0.0) > 3 else "rad/s"


def _guess_revolutions_unit(values: Floats) -> str:
    return "rpm" if np.nanmax(np.abs(values), initial=0.0) > 60 else "rev/s"


#: By kind of unit: its guess from the values alone.
GUESSES: Mapping[str, Callable[[Floats], str]] = {
    "angle": guess_angle_unit,
    "rudder": _guess_rudder_unit,
    "rate": _guess_rate_unit,
    "rev": _guess_revolutions_unit,
}


def settled(sources: Iterable[Source], table: pd.DataFrame) -> tuple[Source, ...]:
    """The sources of one table, guessed units as the signals beside them say, where these do."""
    found = tuple(sources)
    if not any(_angle_of(s) or s.quantity == "yaw_rate" for s in found if GUESSED in s.options):
        return found
    motion = _Motion.of(found, table.iloc[:: len(table) // MOST_ROWS + 1])
    found = tuple(_told(s, motion.by_track(s), "the course over the track") for s in found)
    rates = [s for s in found if s.quantity == "yaw_rate"]
    found = tuple(_told(s, motion.by_rate(s, rates), "the yaw rate") for s in found)
    heading = next((s for s in found if s.quantity == "heading"), None)
    return tuple(_told(s, motion.by_heading(s, heading), "the heading") for s in found)


def _told(source: Source, unit: str | None, by: str) -> Source:
    return replace(source, unit=unit, options={**source.options, GUESSED: by}) if unit else source


def _angle_of(source: Source) -> str | None:
    """The column of an angle that follows the track: of a heading or a course."""
    return source.fields.get("value" if source.quantity == "heading" else "course")


def _open(source: Source) -> bool:
    return source.options.get(GUESSED) == SIZE


@dataclass(frozen=True)
class _Motion:
    """Rows of a table as means over steps of time.

    Attributes
    ----------
    table : DataFrame
    step : (n,) int
        Step of each row.
    t : (m,) float
        Mean time of each step, s.
    track : (m,) complex, optional
        Position: north + i east.
    """

    table: pd.DataFrame
    step: NDArray[np.int64]
    t: Floats
    track: Complex | None = None

    @classmethod
    def of(cls, sources: Sequence[Source], table: pd.DataFrame) -> _Motion:
        t = table.index.to_numpy(float) * 1e-9
        step = np.unique(np.floor(t / STEP), return_inverse=True)[1]
        motion = cls(table, step, np.bincount(step, t) / np.bincount(step))
        position = next((s for s in sources if s.quantity == "position"), None)
        return replace(motion, track=motion.position(position)) if position else motion

    def mean(self, values: Floats) -> Floats:
        """Mean over each step; NaN where there is none."""
        good = np.isfinite(values)
        count = np.bincount(self.step[good], minlength=len(self.t))
        total = np.bincount(self.step[good], values[good], minlength=len(self.t))
        return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))

    def column(self, name: str) -> Floats:
        """A column as numbers."""
        return np.asarray(self.table[name].to_numpy(float, na_value=np.nan))

    def position(self, source: Source) -> Complex:
        """North + i east, to any scale."""
        north, east = (self.column(c) for c in source.fields.values())
        if "latitude" in source.fields:
            good = np.isfinite(north) & ((north != 0.0) | (east != 0.0))
            middle = float(np.median(north[good])) if good.any() else 0.0
            east = np.where(good, east * np.cos(middle * factor_to_si(source.unit)[0]), np.nan)
        return np.asarray(self.mean(north) + 1j * self.mean(east))

    def direction(self, column: str, unit: str) -> Complex:
        """Mean of an angle as a number on (or inside) the unit circle."""
        angle = self.column(column) * factor_to_si(unit)[0]
        return np.asarray(self.mean(np.cos(angle)) + 1j * self.mean(np.sin(angle)))

    def by_track(self, source: Source) -> str | None:
        """The unit in which an angle follows the course over the track; None where either or neither does."""
        column = _angle_of(source)
        if column is None or not _open(source) or self.track is None:
            return None
        mean = {unit: self.along(self.direction(column, unit)) for unit in ("deg", "rad")}
        scatter = {unit: 1.0 - abs(m) for unit, m in mean.items()}
        best, other = sorted(scatter, key=lambda u: scatter[u])
        if scatter[other] > max(SCATTERED, TIMES * scatter[best]):
            return best
        off = {unit: abs(np.angle(m)) for unit, m in mean.items()}
        best, other = sorted(off, key=lambda u: off[u])
        return best if scatter[other] < SCATTERED and off[best] < NEAR and off[other] > FAR else None

    def along(self, direction: Complex) -> complex:
        """Mean of the course less an angle, as a number inside the unit circle; 0 where nothing moves."""
        good = np.isfinite(self.track * direction) if self.track is not None else np.zeros(0, bool)
        if self.track is None or good.sum() < FEWEST:
            return 0j
        chord = self.track[good][2:] - self.track[good][:-2]
        length = np.abs(chord)
        most = float(np.median(length))
        if most == 0.0:
            return 0j
        share = np.minimum(length, most) / np.where(length > 0.0, length, 1.0)  # an outlier weighs no more
        total = np.sum(share * chord * np.conj(direction[good][1:-1]))
        return complex(total / np.sum(share * length))

    def by_rate(self, source: Source, rates: Sequence[Source]) -> str | None:
        """The unit in which the slope of a heading goes with a yaw rate."""
        if source.quantity != "heading" or not _open(source) or not rates:
            return None
        rate = min(rates, key=lambda r: GUESSED in r.options)
        units = ("deg/s", "rad/s") if GUESSED in rate.options else (rate.unit,)
        fitting = set()
        for unit in ("deg", "rad"):
            ratio = self.ratio(source.fields["value"], unit, rate.fields["value"])
            of = [abs(ratio) * factor_to_si(u)[0] for u in units] if ratio else []
            if any(1.0 / BETWEEN < r < BETWEEN for r in of):
                fitting.add(unit)
        return fitting.pop() if len(fitting) == 1 else None

    def by_heading(self, source: Source, heading: Source | None) -> str | None:
        """The unit of a yaw rate by what the heading turned."""
        if source.quantity != "yaw_rate" or heading is None or not _open(source):
            return None
        ratio = self.ratio(heading.fields["value"], heading.unit, source.fields["value"])
        return None if ratio is None else "deg/s" if abs(ratio) > BETWEEN else "rad/s"

    def ratio(self, heading: str, unit: str, rate: str) -> float | None:
        """A yaw rate as logged for each rad/s that a heading turns; None where they do not go together."""
        direction, r = self.direction(heading, unit), self.mean(self.column(rate))
        good = np.isfinite(direction) & np.isfinite(r)
        t, direction, r = self.t[good], direction[good], r[good]
        if len(t) < FEWEST:
            return None
        span = t[2:] - t[:-2]
        near = span < 3.0 * np.median(span)
        turned = np.angle(direction[2:] * np.conj(direction[:-2]))[near]
        summed = ((r[:-2] + 2.0 * r[1:-1] + r[2:]) / 4.0 * span)[near]
        product, size = float(summed @ turned), float(turned @ turned)
        if np.abs(turned).sum() < 2.0 * TURNED or product**2 < ALIKE**2 * size * float(summed @ summed):
            return None
        return product / size
