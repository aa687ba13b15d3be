"""What a heading says less what the gyro says, and what every log has alike in it.

That is the gyro's scale, the compass's deviation and its lag.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from preprocess.integrated import UNTOLD, Run
from preprocess.trial import FloatArray

#: So many times the angle is sought by which a compass deviates.
ANGLES = 3
#: Deviation among what every log has alike.
DEVIATION = slice(3, 7)


def angles_of(runs: Sequence[Run]) -> list[FloatArray]:
    """The heading (n,) of each run as the gyro tells it: its integral, begun where a compass that deviates says.

    By a heading's own angle a compass would deviate by what it wanders.
    """
    angles = [run.value for run in runs]
    for _ in range(ANGLES):
        around, alike = _alike(runs, angles)
        left = [r.value - r.integral - c @ alike for r, c in zip(runs, around, strict=True)]
        angles = [
            (1.0 + alike[0]) * r.integral + rest - _bare(r.at, rest)
            for r, rest in zip(runs, left, strict=True)
        ]
    return angles


def lag_of(runs: Sequence[Run]) -> float:
    """How much later the headings are stamped than the gyro's rates are, s.

    At headings that are all alike what deviates looks late as well, and is not looked for.
    """
    bare = [_bare(r.at, np.column_stack([r.rate, r.slope, r.integral, r.value - r.integral])) for r in runs]
    columns = np.concatenate(bare)
    return -float(np.linalg.lstsq(columns[:, :-1], columns[:, -1], rcond=UNTOLD)[0][0])


def _alike(runs: Sequence[Run], angles: Sequence[FloatArray]) -> tuple[list[FloatArray], FloatArray]:
    """What every log has alike (n, 11), run by run, and how much of it (11,) the headings have in them."""
    around = [alike_of(r, a) for r, a in zip(runs, angles, strict=True)]
    against = [run.value - run.integral for run in runs]
    bare = [_bare(r.at, np.column_stack([c, a])) for r, c, a in zip(runs, around, against, strict=True)]
    columns = np.concatenate(bare)
    alike = np.linalg.lstsq(columns[:, :-1], columns[:, -1], rcond=UNTOLD)[0]
    return around, np.asarray(alike, dtype=float)


def _bare(at: FloatArray, values: FloatArray) -> FloatArray:
    """Values (n, ...) less the straight line in time that is nearest to them."""
    line = np.column_stack([np.ones(len(at)), at - at.mean()])
    return np.asarray(values - line @ np.linalg.lstsq(line, values, rcond=None)[0], dtype=float)


def alike_of(run: Run, angle: FloatArray) -> FloatArray:
    """What every log has alike (n, 11), for an angle (n,): the gyro's scale, a lag, deviation once and twice around."""
    around = np.column_stack([f(k * angle) for k in (1.0, 2.0) for f in (np.sin, np.cos)])
    return np.column_stack([run.integral, run.rate, run.slope, around, run.rate[:, None] * around])
