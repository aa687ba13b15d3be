"""Samples of one quantity out of a log, in SI units and in Seatrial's frames, at their own times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from ingest.detect import dilution, quality_mask, stated_sigma
from ingest.log import Log, Source
from ingest.sender import sender_of
from ingest.units import factor_to_si
from preprocess import frames
from preprocess.resolve import Column, numbers, rows_of, rows_where
from preprocess.trial import BoolArray, FloatArray
from preprocess.vessel import Sensor, Vessel

_DEFAULT_UNIT = {"position": "m", "heading": "rad", "yaw_rate": "rad/s", "velocity": "m/s", "depth": "m"}
_ELEMENT = "["


@dataclass(frozen=True)
class Raw:
    """Samples of one quantity before cleaning.

    Attributes
    ----------
    t : (n,) s
        Since the log's first record, latency taken off.
    value : (n,) or (n, 2)
        SI units and Seatrial's frames; geodetic positions in degrees, see ``geodetic``.
    flagged : (n,) bool
        True where the receiver itself calls the sample bad.
    geodetic, body, relative : bool
        Latitude and longitude; velocity along body axes; wind relative to the vessel (speed, direction from).
    quantum : float
        Step to which the values were rounded, SI; 0 where none shows.
    stated : (n,), optional
        Standard deviation that the sensor itself states of each sample, SI, or its dilution; NaN where it does not.
    unsure : float
        By how much all times may be early or late together, s: see ``Log.unsure``.
    sender : str, optional
        What sent it, where that is known; see ``ingest.sender``.
    reach : (least, greatest), optional
        Beyond these its sensor is at the end of its range, SI, as another sensor tells.
    ordered : bool
        Of an input: an order that was sent (calibrated pulses), no feedback.
    remarks : tuple of str
        Sentences on what was noticed while it was read.
    """

    quantity: str
    t: FloatArray
    value: FloatArray
    flagged: BoolArray
    source: Source
    geodetic: bool = False
    body: bool = False
    relative: bool = False
    quantum: float = 0.0
    stated: FloatArray | None = None
    unsure: float = 0.0
    sender: str | None = None
    reach: tuple[float, float] | None = None
    ordered: bool = False
    remarks: tuple[str, ...] = ()


def read_raw(log: Log, source: Source, sensor: Sensor | None, vessel: Vessel, accuracy: bool = False) -> Raw:
    """Return samples of a source in SI units.

    Parameters
    ----------
    log : Log
    source : Source
    sensor : Sensor, optional
        Its ``offset`` (logged less true, SI unit) and ``latency`` (s) are taken off.
    vessel : Vessel
        For the magnetic variation.
    accuracy : bool
        Take what the sensor states of its samples' accuracy too.
    """
    rows = rows_of(log, source.topic, source.device, f"sensors.{source.quantity}", source.name)
    rows = rows_where(rows, source.options)
    columns = {k: _field(rows, source.topic, f) for k, f in source.fields.items()}
    t = np.asarray(rows.index.to_numpy(dtype=np.int64) * 1e-9, float) - (
        (sensor.latency or 0.0) if sensor else 0.0
    )
    flagged = ~quality_mask(source.options, rows)
    stated = stated_accuracy(source, rows) if accuracy else None
    unsure = log.unsure.get(source.topic, 0.0)
    sender = sender_of(log, source) if source.quantity in ("position", "velocity") else None
    raw = Raw(source.quantity, t, np.empty(0), flagged, source, stated=stated, unsure=unsure, sender=sender)
    raw = _CONVERT[source.quantity](raw, columns, rows)
    return _corrected(_once(raw), sensor, vessel)


def _once(raw: Raw) -> Raw:
    """The samples without those that are the one before them once more, at the same time: they say nothing new."""
    value = raw.value.reshape(len(raw.t), -1)
    new = (np.diff(raw.t) != 0.0) | (np.diff(value, axis=0) != 0.0).any(axis=1)
    return raw if new.all() else kept(raw, np.append(True, new))


def stated_accuracy(source: Source, rows: pd.DataFrame) -> FloatArray | None:
    """What a source states of each sample: its standard deviation, SI, else its dilution; (n,), None without."""
    sigma = stated_sigma(source.options, rows)
    return dilution(source.options, rows) if sigma is None or not np.isfinite(sigma).any() else sigma


def kept(raw: Raw, keep: BoolArray) -> Raw:
    """Only some of the samples."""
    stated = None if raw.stated is None else raw.stated[keep]
    return replace(raw, t=raw.t[keep], value=raw.value[keep], flagged=raw.flagged[keep], stated=stated)


def _field(rows: pd.DataFrame, topic: str, field: str) -> FloatArray:
    if field in rows.columns:
        return numbers(rows, Column(topic, field))
    name, _, rest = field.partition(_ELEMENT)
    return numbers(rows, Column(topic, name, int(rest.rstrip("]"))))


def _scale(values: FloatArray, unit: str) -> FloatArray:
    factor, offset = factor_to_si(unit)
    return values * factor + offset


def _angle_unit(source: Source, values: FloatArray) -> str:
    """Return the stated unit; where none is, degrees if the values cannot be radians of one turn."""
    if source.unit:
        return source.unit
    return "deg" if np.nanmax(np.abs(values), initial=0.0) > 2.1 * np.pi else "rad"


def _position(raw: Raw, columns: Mapping[str, FloatArray], rows: pd.DataFrame) -> Raw:
    if "latitude" not in columns:
        value = np.column_stack([_scale(columns[k], raw.source.unit or "m") for k in ("north", "east")])
        return replace(raw, value=value)
    factor = np.degrees(factor_to_si(raw.source.unit or "deg")[0])
    value = np.column_stack([columns["latitude"], columns["longitude"]]) * factor
    absent = (value == 0.0).all(axis=1) | (np.abs(value[:, 0]) > 90.0)
    return replace(raw, value=value, flagged=raw.flagged | absent, geodetic=True)


def _heading(raw: Raw, columns: Mapping[str, FloatArray], rows: pd.DataFrame) -> Raw:
    angle = _scale(columns["value"], _angle_unit(raw.source, columns["value"]))
    if raw.source.options.get("frame") == "enu":
        angle = frames.enu_yaw_to_heading(angle)
    return replace(raw, value=angle * _sign(raw.source))


def _yaw_rate(raw: Raw, columns: Mapping[str, FloatArray], rows: pd.DataFrame) -> Raw:
    rate = _scale(columns["value"], raw.source.unit or "rad/s") * _sign(raw.source)
    up = raw.source.options.get("frame") in ("enu", "flu")
    return replace(raw, value=frames.flu_rate_to_yaw_rate(rate) if up else rate)


def _velocity(raw: Raw, columns: Mapping[str, FloatArray], rows: pd.DataFrame) -> Raw:
    source = raw.source
    if "speed" in columns:
        speed = _scale(columns["speed"], str(source.options.get("speed_unit", "m/s")))
        course = _scale(columns["course"], source.unit or "deg")
        return replace(raw, value=frames.course_to_north_east(speed, course))
    pair = ("north", "east") if "north" in columns else ("forward", "starboard")
    value = np.column_stack([_scale(columns[k], source.unit or "m/s") for k in pair])
    body = pair[0] == "forward"
    if body and source.options.get("frame") in ("enu", "flu"):
        value = frames.flu_to_body(value)
    return replace(raw, value=value, body=body)


def _wind(raw: Raw, columns: Mapping[str, FloatArray], rows: pd.DataFrame) -> Raw:
    source = raw.source
    speed = _scale(columns["speed"], str(source.options.get("speed_unit", "m/s")))
    direction = _scale(columns["direction"], source.unit or "deg")
    relative = str(source.options.get("reference", "true")) in ("relative", "apparent")
    flag = rows[source.fields["relative"]].to_numpy(dtype=float) if "relative" in source.fields else None
    if flag is not None:
        relative = bool(np.nanmean(flag) > 0.5)
        raw = replace(raw, flagged=raw.flagged | (flag != float(relative)))
    return replace(raw, value=np.column_stack([speed, direction]), relative=relative)


def _scalar(raw: Raw, columns: Mapping[str, FloatArray], rows: pd.DataFrame) -> Raw:
    return replace(
        raw, value=_scale(columns["value"], raw.source.unit or _DEFAULT_UNIT.get(raw.quantity, ""))
    )


_CONVERT = {
    "position": _position,
    "heading": _heading,
    "yaw_rate": _yaw_rate,
    "velocity": _velocity,
    "wind": _wind,
    "depth": _scalar,
    "rudder": _scalar,
    "propeller": _scalar,
}


def _sign(source: Source) -> float:
    return float(str(source.options.get("sign", 1.0)))


def _corrected(raw: Raw, sensor: Sensor | None, vessel: Vessel) -> Raw:
    """Take the declared offset off, add the magnetic variation, and keep strictly increasing times only."""
    value = raw.value
    if sensor is not None and sensor.offset and value.ndim == 1:
        value = value - sensor.offset
    if raw.quantity == "heading" and raw.source.options.get("magnetic"):
        value = value + vessel.magnetic_variation
    return strictly_increasing(replace(raw, value=value))


def strictly_increasing(raw: Raw) -> Raw:
    """Drop rows with no number, and all but the first of rows that share a time."""
    finite = np.isfinite(raw.value) if raw.value.ndim == 1 else np.isfinite(raw.value).all(axis=1)
    keep = np.array(finite, dtype=bool)
    t = raw.t[finite]
    first = np.ones(len(t), dtype=bool)
    first[1:] = np.diff(np.maximum.accumulate(t)) > 0 if len(t) else False
    keep[np.flatnonzero(finite)] = first
    return kept(raw, keep)
