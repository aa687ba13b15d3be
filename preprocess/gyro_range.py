"""A gyro that is at the end of its range although no value of it repeats, as the headings of all logs tell.

Where noise or a filter comes after what limits a gyro, its values scatter about the limit. By themselves they look like
those of a vessel that turns steadily; but the heading turns on, and faster.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from preprocess.commands import feedback_noise
from preprocess.integrated import integral_at
from preprocess.judge import Judged, judge
from preprocess.outliers import MAD_TO_SIGMA
from preprocess.raw import Raw
from preprocess.trial import BoolArray, FloatArray
from preprocess.turned import pieces

#: Pieces have so many headings at least, and last until headings err by this share of the greatest yaw rates or less.
HEADINGS, ERRS = 3, 0.3
#: The gyro is beyond all but this share of its values within so many times its noise.
END, SCATTER = 0.02, 4.0
#: So many pieces tell, where the heading turns faster by this share of the limit and by so many standard errors.
TELLING, FASTER, CLEAR = 8, 0.15, 6.0
#: Standard deviation of a median over that of a mean, of normal noise.
MEDIAN = 1.2533
#: Pieces that are farther from their line than so many standard deviations are left out of it, so often.
FAR, ROUNDS = 3.0, 4
#: Within its range rates of the heading are so many times a gyro's, or they are late, and say nothing of its range.
SCALES = 0.5, 2.0
#: The range of a gyro that shows all.
EVERYWHERE = (-np.inf, np.inf)

_Both = tuple[Judged, Judged]


class _Turns(NamedTuple):
    """Pieces of logs: mean yaw rate (n,) by heading and by gyro, the gyro's least and greatest, rad/s.

    ``noise`` (n,) is what is left of that of the gyro's samples in the means.
    """

    heading: FloatArray
    gyro: FloatArray
    least: FloatArray
    greatest: FloatArray
    noise: FloatArray


NO_TURNS = _Turns(*[np.zeros(0)] * 5)


class _Line(NamedTuple):
    """A straight line (2,) through points, their scatter about it, and how many and where they are."""

    line: FloatArray
    scatter: float
    x: FloatArray

    def mirrored(self) -> _Line:
        """The same of the points with other signs."""
        return _Line(self.line * (1.0, -1.0), self.scatter, -self.x)

    def doubt(self, x: float) -> float:
        """Standard error of the line at a place."""
        mean, spread = float(self.x.mean()), float(self.x.std())
        return float(self.scatter * np.sqrt((1.0 + ((x - mean) / spread) ** 2) / len(self.x)))


def within_range(logs: Sequence[Mapping[str, Raw]]) -> list[dict[str, Raw]]:
    """The sensors' samples of every log, the yaw rates with the range beyond which their gyro shows none.

    Gyros of one name are one.
    """
    judged = [{k: judge(raw) for k, raw in log.items() if k in ("heading", "yaw_rate")} for log in logs]
    both = [j for j in judged if len(j) == 2]
    names = {j["yaw_rate"].raw.source.name for j in both}
    pairs = {
        n: [(j["heading"], j["yaw_rate"]) for j in both if j["yaw_rate"].raw.source.name == n] for n in names
    }
    reach = {name: _reach(logs) for name, logs in pairs.items()}
    return [_limited(log, reach) for log in logs]


def _limited(log: Mapping[str, Raw], reach: Mapping[str, tuple[float, float]]) -> dict[str, Raw]:
    gyro = log.get("yaw_rate")
    if gyro is None or gyro.source.name not in reach:
        return dict(log)
    return {**log, "yaw_rate": replace(gyro, reach=reach[gyro.source.name])}


def _reach(logs: Sequence[_Both]) -> tuple[float, float]:
    """Yaw rates beyond which a gyro shows none, rad/s; infinite where it shows as much as there is."""
    noise = max(feedback_noise(gyro.raw.value.ravel()) for _, gyro in logs)
    turns = _of_all(logs, noise)
    return _ends(turns, SCATTER * noise) if len(turns.gyro) >= 2 * TELLING else EVERYWHERE


def _of_all(logs: Sequence[_Both], noise: float) -> _Turns:
    """The pieces of all logs; none where noise is all that the gyro shows."""
    values = np.concatenate([gyro.raw.value[gyro.good].ravel() for _, gyro in logs])
    greatest = float(np.quantile(np.abs(values), 1.0 - END)) if len(values) else 0.0
    if greatest <= SCATTER * noise:
        return NO_TURNS
    each = [_turns(*both, noise, greatest) for both in logs]
    return _Turns(*(np.concatenate(x) for x in zip(*each, strict=True)))


def _ends(turns: _Turns, scatter: float) -> tuple[float, float]:
    """Where a gyro whose samples ``scatter`` about its limits shows no more, though the heading turns faster."""
    near = SCATTER * float(np.median(turns.noise))
    low, high = -_end(-turns.gyro, near), _end(turns.gyro, near)
    inside = (turns.least > low + scatter) & (turns.greatest < high - scatter)
    line = _line(turns.gyro[inside], turns.heading[inside])
    if line is None or not SCALES[0] < line.line[0] < SCALES[1]:
        return EVERYWHERE
    lowest, highest = (turns.heading[np.abs(turns.gyro - end) < near] for end in (low, high))
    return (
        low + scatter if _is_faster(-lowest, -low, line.mirrored()) else -np.inf,
        high - scatter if _is_faster(highest, high, line) else np.inf,
    )


def _end(told: FloatArray, scatter: float) -> float:
    """About what the greatest of (n,) scatter."""
    return float(np.median(told[told > np.quantile(told, 1.0 - END) - 2.0 * scatter]))


def _is_faster(turned: FloatArray, end: float, line: _Line) -> bool:
    """Whether yaw rates (n,) by the heading are clearly greater than the line says at the end of the gyro's."""
    if len(turned) < TELLING:
        return False
    beyond = float(np.median(turned)) - float(np.polyval(line.line, end))
    doubt = MEDIAN * line.scatter / np.sqrt(len(turned))
    return beyond > max(FASTER * end, CLEAR * float(np.hypot(doubt, line.doubt(end))))


def _turns(heading: Judged, gyro: Judged, noise: float, greatest: float) -> _Turns:
    """The pieces of a log, for a gyro's noise and greatest values."""
    t, psi = heading.raw.t[heading.good], heading.raw.value[heading.good].ravel()
    at, rate = gyro.raw.t[gyro.good], gyro.raw.value[gyro.good].ravel()
    if min(len(t), len(at)) < TELLING:
        return NO_TURNS
    every, often = (float(np.median(np.diff(x))) for x in (t, at))
    lasting = max(HEADINGS * every, 2.0 * often, np.sqrt(2.0) * feedback_noise(psi) / (ERRS * greatest))
    edges, covered = pieces(t, at, lasting, 1.5 * lasting + every, 1)
    if not covered.any():
        return NO_TURNS
    begin = np.minimum(np.searchsorted(at, t[edges])[:-1], len(at) - 1)
    lasts = np.diff(t[edges])[covered]
    turned, told = (np.diff(x)[covered] / lasts for x in (psi[edges], integral_at(t[edges], at, rate)))
    least, most = (f.reduceat(rate, begin)[covered] for f in (np.minimum, np.maximum))
    return _Turns(turned, told, least, most, noise * np.sqrt(np.minimum(1.0, often / lasts)))


def _line(x: FloatArray, y: FloatArray) -> _Line | None:
    """The straight line through points (n,) but for those far from it; None of too few."""
    keep: BoolArray = np.ones(len(x), dtype=bool)
    for _ in range(ROUNDS):
        if keep.sum() < TELLING or not np.ptp(x[keep]):
            return None
        line = np.polyfit(x[keep], y[keep], 1)
        left = y - np.polyval(line, x)
        used, keep = keep, _near(left)
    return _Line(line, _scatter(left[used]), x[used])


def _near(left: FloatArray) -> BoolArray:
    return np.asarray(np.abs(left - np.median(left)) < FAR * _scatter(left), dtype=bool)


def _scatter(left: FloatArray) -> float:
    """Standard deviation of (n,), robustly."""
    return MAD_TO_SIGMA * float(np.median(np.abs(left - np.median(left))))
