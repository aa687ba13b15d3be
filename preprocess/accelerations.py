"""Horizontal accelerations out of what an inertial sensor measures: its specific force, less gravity by roll and pitch.

What a log calls accelerations is looked for by name, format by format. Where it has no roll and pitch, the vessel is
taken to be upright: whether what is left says anything of the motion, ``preprocess.inertial`` finds out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ingest.detect import Rule, detect
from ingest.log import Log, Source
from ingest.units import factor_to_si
from preprocess.resolve import rows_of
from preprocess.trial import FloatArray

G = 9.80665
_FLU: Mapping[str, object] = {"frame": "flu"}
_MILLI: Mapping[str, object] = {"scale": 1e-3 * G}


def _force(
    topic: str, names: Sequence[str], rank: float = 50.0, options: Mapping[str, object] | None = None
) -> Rule:
    return Rule("acceleration", topic, dict(zip("xyz", names, strict=True)), "m/s/s", rank, options or {})


def _tilt(topic: str, roll: str, pitch: str, unit: str, rank: float = 50.0) -> Rule:
    return Rule("tilt", topic, {"roll": roll, "pitch": pitch}, unit, rank)


def _quaternion(topic: str, names: Sequence[str], options: Mapping[str, object] | None = None) -> Rule:
    return Rule("tilt", topic, dict(zip("wxyz", names, strict=True)), "", 50.0, options or {})


#: Specific force, forward, starboard and down unless the frame says otherwise.
FORCES = (
    _force(r"IMU(\[\d+\])?", ("AccX", "AccY", "AccZ")),
    _force(r"vehicle_acceleration", ("xyz[0]", "xyz[1]", "xyz[2]"), 55.0),
    _force(r"sensor_combined", tuple(f"accelerometer_m_s2[{k}]" for k in range(3))),
    _force(r"HIGHRES_IMU", ("xacc", "yacc", "zacc"), 55.0),
    _force(r"(SCALED|RAW)_IMU\d?", ("xacc", "yacc", "zacc"), options=_MILLI),
    _force(r".*", tuple(f"linear_acceleration.{k}" for k in "xyz"), options=_FLU),
)
#: Roll, starboard down, and pitch, bow up.
TILTS = (
    _tilt(r"ATT", "Roll", "Pitch", "deg"),
    _tilt(r"ATTITUDE|attitude", "roll", "pitch", "rad"),
    _quaternion(r"vehicle_attitude", tuple(f"q[{k}]" for k in range(4))),
    _quaternion(r".*", tuple(f"orientation.{k}" for k in "wxyz"), _FLU),
)


@dataclass(frozen=True)
class Accelerations:
    """Horizontal accelerations (n, 2), forward and starboard, m/s², at times (n,) s; where from.

    ``upright``: no roll and pitch were logged.
    """

    t: FloatArray
    value: FloatArray
    source: str
    upright: bool


def find_accelerations(log: Log) -> Accelerations | None:
    """The best accelerations of a log, level with the sea; None where it has none."""
    sources = detect(FORCES, log.tables)
    if not sources:
        return None
    source = sources[0]
    rows = rows_of(log, source.topic, source.device, "acceleration", source.name)
    force = _columns(rows, source)
    if not (np.nanstd(force[:, :2], axis=0) > 0.0).all():  # a column that is there for the format's sake
        return None
    force = force * float(str(source.options.get("scale", 1.0)))
    if source.options.get("frame") == "flu":
        force = force * np.array([1.0, -1.0, -1.0])
    t = np.asarray(rows.index.to_numpy(dtype=np.int64) * 1e-9, float)
    tilts = detect(TILTS, log.tables)
    roll, pitch = _tilts(log, tilts[0], t) if tilts else np.zeros((2, len(t)))
    value = level(force, roll, pitch)
    keep = np.isfinite(value).all(axis=1) & (np.diff(t, prepend=-np.inf) > 0.0)
    if keep.sum() < 2:
        return None
    return Accelerations(t[keep], value[keep], source.topic, not tilts)


def level(force: FloatArray, roll: FloatArray, pitch: FloatArray) -> FloatArray:
    """Horizontal components, forward and starboard, of a specific force (n, 3), m/s²: gravity has none."""
    x, y, z = force.T
    down = np.sin(roll) * y + np.cos(roll) * z
    return np.column_stack([np.cos(pitch) * x + np.sin(pitch) * down, np.cos(roll) * y - np.sin(roll) * z])


def _columns(rows: pd.DataFrame, source: Source) -> FloatArray:
    return np.column_stack([rows[c].to_numpy(dtype=float) for c in source.fields.values()])


def _tilts(log: Log, source: Source, t: FloatArray) -> FloatArray:
    """Roll and pitch (2, n) at any times, rad."""
    rows = rows_of(log, source.topic, source.device, "tilt", source.name)
    at, values = rows.index.to_numpy(dtype=np.int64) * 1e-9, _columns(rows, source)
    if "w" in source.fields:
        angles = _of_quaternion(values)
        if source.options.get("frame") == "flu":
            angles = angles * np.array([1.0, -1.0])
    else:
        angles = values * factor_to_si(source.unit)[0]
    known = np.isfinite(angles).all(axis=1)
    return np.stack([np.interp(t, at[known], c[known]) for c in angles.T])


def _of_quaternion(q: FloatArray) -> FloatArray:
    """Roll and pitch (n, 2) of quaternions (n, 4), the scalar first (Fossen 2011, eq. 2.72-73)."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x**2 + y**2))
    return np.column_stack([roll, np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))])
