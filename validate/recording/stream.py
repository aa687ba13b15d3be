"""Columns into a recording: series thinned for the eye, tracks, hulls; never a call per sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import rerun as rr

from preprocess.trial import FloatArray
from validate.recording.entities import COLOURS, ELAPSED, UTC
from validate.recording.glyphs import drawable
from validate.report.thinning import IntArray, extremes

#: Rows of one series above which it is thinned to its extremes, and about how many a recording holds in all.
MOST, FEWEST, TOTAL = 20_000, 1_000, 2_500_000
#: Series that a log has, about.
SERIES = 60
#: Rows of one send: several chunks are written faster than one large one.
CHUNK = 10_000


@dataclass(frozen=True)
class Clock:
    """The times of one log: ``utc_ns`` is UTC at t = 0, where known; a series has at most ``most`` rows."""

    utc_ns: int | None
    most: int = MOST

    def columns(self, t: FloatArray) -> list[rr.TimeColumn]:
        """Index columns for samples at ``t``, s."""
        nanoseconds = np.rint(t * 1e9).astype(np.int64)
        out = [rr.TimeColumn(ELAPSED, duration=nanoseconds.astype("timedelta64[ns]"))]
        if self.utc_ns is not None:
            out.append(rr.TimeColumn(UTC, timestamp=(nanoseconds + self.utc_ns).astype("datetime64[ns]")))
        return out


@dataclass(frozen=True)
class Look:
    """How a series is drawn."""

    part: str
    name: str
    points: bool = False
    width: float = 1.5


def send_series(
    rec: rr.RecordingStream, path: str, clock: Clock, t: FloatArray, value: FloatArray, look: Look
) -> None:
    """One series: finite samples only for points; what is not finite breaks a line.

    Parameters
    ----------
    t, value : (n,)
        Times, s, and values in SI units.
    """
    colour, name = COLOURS[look.part], drawable(look.name)
    style = (
        rr.SeriesPoints(colors=colour, markers="circle", marker_sizes=look.width, names=name)
        if look.points
        else rr.SeriesLines(colors=colour, widths=look.width, names=name)
    )
    rec.log(path, style, static=True)
    keep = np.isfinite(value) & np.isfinite(t) if look.points else np.isfinite(t)
    send_scalars(rec, path, clock, t[keep], value[keep])


def send_scalars(rec: rr.RecordingStream, path: str, clock: Clock, t: FloatArray, value: FloatArray) -> None:
    """The samples themselves, thinned to their extremes, in chunks; a gap is a row without a value.

    A row with NaN would break the line as well, but no two recordings with NaN in them compare equal.
    """
    known = np.flatnonzero(np.isfinite(value))
    if not len(known):
        return
    t, value = t[known[0] : known[-1] + 1], value[known[0] : known[-1] + 1]
    rows = extremes(value, clock.most)
    for part in chunks(rows):
        known = np.isfinite(value[part])
        columns = rr.Scalars.columns(scalars=value[part][known])
        if not known.all():
            columns = columns.partition(known.astype(np.int64))
        rec.send_columns(path, indexes=clock.columns(t[part]), columns=columns)


def most_rows(logs: int) -> int:
    """Rows of one series, so that a campaign of many logs stays small; far more than a screen has columns."""
    return int(np.clip(TOTAL // (SERIES * max(1, logs)), FEWEST, MOST))


def chunks(rows: IntArray) -> list[IntArray]:
    """Row numbers in pieces of at most `CHUNK`."""
    return np.array_split(rows, max(1, -(-len(rows) // CHUNK))) if len(rows) else []


def strips(track: FloatArray) -> list[FloatArray]:
    """Unbroken pieces of a track, (n, 2) each, cut where a coordinate is NaN."""
    ok = np.isfinite(track).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ok, [False]]).astype(np.int8)))
    return [track[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]


def thin_track(track: FloatArray, most: int = 4000) -> FloatArray:
    """A track with the extremes of both its coordinates."""
    return track[np.union1d(extremes(track[:, 0], most), extremes(track[:, 1], most))]
