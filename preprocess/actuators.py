"""Inputs: from the log's numbers to physical values, by calibration or by unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ingest.errors import CampaignError, NoStandardMessage
from ingest.log import Log, Source
from ingest.tabular.unstated import LARGEST_RUDDER, ONE_TURN
from ingest.units import UnknownUnit, factor_to_si
from preprocess.raw import Raw, strictly_increasing
from preprocess.resolve import choose_source, find_column, numbers, rows_of, rows_where, topic_of
from preprocess.trial import BoolArray, FloatArray
from preprocess.vessel import Input, Sensor
from preprocess.wild import said, wild

_ANGLES = ("rudder", "azimuth")
_FORCES = ("thruster", "tunnel")
#: Angles up to these are taken for radians, by kind: an azimuth may go round; and up to this for degrees.
_RADIANS, _DEGREES = {"rudder": LARGEST_RUDDER, "azimuth": ONE_TURN}, 400.0
#: Commands up to this are shares of the largest, a little over; more are percent.
_SHARE = 1.5


def read_input(log: Log, declared: Input) -> tuple[Raw, str]:
    """Return samples of one input in physical values, and the conversion in words.

    Parameters
    ----------
    log : Log
    declared : Input

    Returns
    -------
    raw : Raw
        Values in rad (rudder, azimuth), rev/s (propeller), -1…1 or N (thruster, tunnel); without the numbers that are
        no value, of which its remarks tell.
    how : str
        ``"calibration"`` or the unit.

    Raises
    ------
    MissingSignal
        The signal, or a standard source of this kind, is not in the log.
    CampaignError
        The values need a calibration or another unit.
    """
    source, column_numbers, t = logged_values(log, declared)
    aside = wild(t, column_numbers, declared.pwm)
    values, how = _physical(log, declared, source.unit, column_numbers, aside)
    values = np.where(aside, np.nan, values)
    raw = Raw(declared.name, t, values, np.zeros(len(t), dtype=bool), source)
    words = (said(declared.name, source.name, column_numbers, aside),) if aside.any() else ()
    raw = replace(raw, unsure=log.unsure.get(source.topic, 0.0), ordered=bool(declared.pwm), remarks=words)
    return strictly_increasing(raw), how


def logged_values(log: Log, declared: Input) -> tuple[Source, FloatArray, FloatArray]:
    """Where an input comes from, its numbers (n,) as logged, and their times (n,), s."""
    key = f"inputs.{declared.name}"
    if declared.signal is None:
        source = _standard(log, declared)
        rows = rows_where(rows_of(log, source.topic, source.device, key, source.name), source.options)
        column = find_column(log, _joined(source.topic, source.fields["value"]), key)
    else:
        column = find_column(log, declared.signal, f"{key}.signal")
        topic = topic_of(log, column, declared.source)
        rows = rows_of(log, topic, declared.source, f"{key}.source", declared.signal)
        unit = log.units.get((topic, column.field), "")
        source = Source(
            declared.kind,
            topic,
            {"value": _label(declared.signal, column.topic)},
            unit,
            declared.source,
        )
    return source, numbers(rows, column), np.asarray(rows.index.to_numpy(dtype=np.int64) * 1e-9, float)


def _joined(topic: str, field: str) -> str:
    return f"{topic}.{field}" if topic else field


def _label(signal: str, topic: str) -> str:
    return signal[len(topic) + 1 :] if topic else signal


def _standard(log: Log, declared: Input) -> Source:
    """Return the detected source of this kind (and device)."""
    key = f"inputs.{declared.name}"
    sensor = Sensor(declared.kind, source=declared.source)
    standard = declared.kind in ("rudder", "propeller")
    found = choose_source(log, declared.kind, sensor, key) if standard else None
    if found is None:
        raise NoStandardMessage(log.path, declared.name, declared.kind, log.signals)
    return found


def _physical(
    log: Log, declared: Input, stated: str, values: FloatArray, aside: BoolArray
) -> tuple[FloatArray, str]:
    if declared.pwm:
        return calibrate(values, declared.pwm, declared.value), "calibration"
    told = values[~aside]
    unit = declared.unit or usable_unit(declared.kind, stated) or guessed_unit(declared.kind, told)
    if unit is None:
        low, high = np.nanmin(told, initial=np.inf), np.nanmax(told, initial=-np.inf)
        raise CampaignError(
            log.path,
            f"inputs.{declared.name}",
            f"a calibration (pwm = […], value = […]) or a unit for this {declared.kind}",
            f"raw values from {low:g} to {high:g} and neither",
        )
    return _scaled(log, declared, values, unit), unit


def usable_unit(kind: str, stated: str) -> str | None:
    """Return the unit that the log states, where it is one of this kind of input."""
    allowed = {
        "rudder": ("rad", "deg"),
        "azimuth": ("rad", "deg"),
        "propeller": ("rpm", "RPM", "rev/s", "Hz", "rps"),
    }
    plain = stated.strip()
    if plain in ("percent", "%") and kind in _FORCES:
        return "percent"
    if plain.lstrip("cdm") in ("rad", "deg", "eg") and kind in _ANGLES:
        return plain
    return plain if plain in allowed.get(kind, ("N",)) else None


def guessed_unit(kind: str, values: FloatArray) -> str | None:
    """Return a unit from the size of the values (n,), best those of all logs, where none is stated."""
    most = float(np.nanmax(np.abs(values), initial=0.0))
    if kind in _ANGLES:
        return "rad" if most <= _RADIANS[kind] else "deg" if most <= _DEGREES else None
    if kind == "propeller":
        return "rev/s" if most <= 60.0 else None
    return "1" if most <= _SHARE else "percent" if most <= 100.0 else None


def _scaled(log: Log, declared: Input, values: FloatArray, unit: str) -> FloatArray:
    try:
        factor, offset = factor_to_si(unit)
    except UnknownUnit as error:
        expected = "rad, deg, rev/s, rpm, percent or N"
        raise CampaignError(log.path, f"inputs.{declared.name}.unit", expected, f"'{unit}'") from error
    return values * factor + offset


def calibrate(raw: FloatArray, pwm: tuple[float, ...], value: tuple[float, ...]) -> FloatArray:
    """Piecewise-linear calibration, held at its ends.

    Parameters
    ----------
    raw : (n,)
    pwm : (k,)
        Raw values, monotonic in either direction.
    value : (k,)
        Physical values at them, any.
    """
    order = np.argsort(pwm, kind="stable")
    out = np.interp(raw, np.asarray(pwm, float)[order], np.asarray(value, float)[order])
    return np.where(np.isfinite(raw), out, np.nan)
