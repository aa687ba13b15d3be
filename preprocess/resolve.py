"""Names to columns: where in a log a quantity or an input is taken from."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from ingest.errors import CampaignError, MissingQuantity, MissingSignal
from ingest.log import SOURCE, Log, Source
from ingest.sender import sender_of
from ingest.tabular.naming import latitude_and_longitude, sources_of
from ingest.tabular.positions import POLE, no_degrees
from ingest.units import measures
from preprocess.trial import FloatArray
from preprocess.vessel import Sensor

_INSTANCE = re.compile(r"(\[\d+\])+$")
_INDEX = re.compile(r"^(?P<field>.*)\[(?P<index>\d+)\]$")


@dataclass(frozen=True)
class Column:
    """A place in a log: topic, column and, for arrays, the element."""

    topic: str
    field: str
    element: int | None = None


def find_column(log: Log, signal: str, key: str) -> Column:
    """Return the column that ``TOPIC.FIELD`` (or ``FIELD``, or ``TOPIC.FIELD[2]``) names.

    Parameters
    ----------
    log : Log
    signal : str
        As ``seatrial inspect`` prints it.
    key : str
        Key of the campaign that names it, for the message.

    Raises
    ------
    MissingSignal
        With the nearest names.
    """
    for topic in sorted(log.tables, key=len, reverse=True):
        prefix = f"{topic}." if topic else ""
        if signal.startswith(prefix):
            found = _column_of(log.tables[topic], topic, signal[len(prefix) :])
            if found is not None:
                return found
    raise MissingSignal(log.path, key, signal, log.signals)


def _column_of(table: pd.DataFrame, topic: str, field: str) -> Column | None:
    if field in table.columns and field != SOURCE:
        return Column(topic, field)
    match = _INDEX.match(field)
    if match and match["field"] in table.columns:
        return Column(topic, match["field"], int(match["index"]))
    return None


def rows_of(log: Log, topic: str, device: int | None, key: str, signal: str) -> pd.DataFrame:
    """Return the rows of a topic that one device sent (all, where none is named).

    Raises
    ------
    MissingSignal
        If the device sent nothing.
    """
    table = log.tables[topic]
    if device is None:
        return table
    if SOURCE not in table.columns:
        if topic.endswith(f"[{device}]"):
            return table
        raise MissingSignal(
            log.path, key, signal, log.signals, f" from source {device} (it names no sources)"
        )
    chosen = table[table[SOURCE] == device]
    if chosen.empty:
        there = ", ".join(str(int(s)) for s in pd.unique(table[SOURCE].dropna()))
        raise MissingSignal(log.path, key, signal, log.signals, f" from source {device} (there: {there})")
    return chosen


def topic_of(log: Log, column: Column, device: int | None) -> str:
    """Return the topic in which a device's rows of a column are: ``GPS[1]`` beside ``GPS``, where there is one."""
    own = f"{column.topic}[{device}]"
    table = log.tables[column.topic]
    if device is None or own not in log.tables or column.field not in log.tables[own].columns:
        return column.topic
    here = SOURCE in table.columns and bool((table[SOURCE] == device).any())
    return column.topic if here else own


def rows_where(rows: pd.DataFrame, options: Mapping[str, object]) -> pd.DataFrame:
    """Return the rows that a source's option ``where`` ({column: value}) selects."""
    where = options.get("where", {})
    if not isinstance(where, Mapping):
        return rows
    for column, value in where.items():
        if column in rows.columns:
            rows = rows[rows[column] == value]
    return rows


def numbers(rows: pd.DataFrame, column: Column) -> FloatArray:
    """Return the column as floats, (n,); what is not a number becomes NaN."""
    values = rows[column.field]
    if column.element is not None:
        values = values.str[column.element]
    return np.asarray(pd.to_numeric(values, errors="coerce"), dtype=float)


def choose_source(log: Log, quantity: str, sensor: Sensor | None, key: str = "") -> Source | None:
    """Return the best detected source of a quantity; of the declared device, where one is declared.

    A device's number is that of the sender; where none has it, that of an instance that one sender has several of.
    ``key`` is where a campaign declares it: ``sensors.QUANTITY`` unless it says otherwise.

    Raises
    ------
    MissingSignal
        No device of that number sends it.
    """
    candidates = [s for s in log.sources if s.quantity == quantity and s.topic in log.tables]
    if sensor is not None and sensor.source is not None:
        every, end = candidates, f"[{sensor.source}]"
        candidates = [s for s in every if s.device == sensor.source]
        candidates = candidates or [s for s in every if s.topic.endswith(end)]
        if not candidates:
            known = [s.name for s in log.sources if s.quantity == quantity] or log.signals
            place = f"{key or f'sensors.{quantity}'}.source"
            raise MissingSignal(log.path, place, f"{quantity} of {sensor.source}", known)
    return max(candidates, key=lambda s: s.rank, default=None)


def declared_source(log: Log, sensor: Sensor) -> Source:
    """Return a ``Source`` for signals that the campaign names; what a reader knows of them is taken over.

    Raises
    ------
    MissingSignal, CampaignError
    """
    key = f"sensors.{sensor.quantity}"
    columns = {_component(c): find_column(log, s, f"{key}.{c}") for c, s in sensor.signals.items()}
    topics = {topic_of(log, c, sensor.source) for c in columns.values()}
    topic = next(iter(topics))
    if len(topics) > 1:
        names = ", ".join(sensor.signals.values())
        raise MissingSignal(log.path, key, names, log.signals, " in one topic")
    fields = {k: c.field if c.element is None else f"{c.field}[{c.element}]" for k, c in columns.items()}
    known = _known(log, sensor, topic, fields)
    unit = sensor.unit or (known.unit if known else None) or _stated_unit(log, sensor, topic, fields) or ""
    options: dict[str, object] = dict(known.options) if known else {}
    if sensor.reference:
        options["reference"] = sensor.reference
        options["magnetic"] = sensor.reference == "magnetic"
    return Source(sensor.quantity, topic, fields, unit, sensor.source, float("inf"), options)


def _component(name: str) -> str:
    return "value" if name == "signal" else name


def _known(log: Log, sensor: Sensor, topic: str, fields: Mapping[str, str]) -> Source | None:
    same = [
        s
        for s in log.sources
        if (s.quantity, s.topic, dict(s.fields)) == (sensor.quantity, topic, dict(fields))
        and sensor.source in (None, s.device)
    ]
    return replace(same[0], device=sensor.source) if same else None


def _stated_unit(log: Log, sensor: Sensor, topic: str, fields: Mapping[str, str]) -> str | None:
    """The unit that the log states of a quantity's columns.

    Raises
    ------
    CampaignError
        It is none that the quantity could have.
    """
    for field in reversed(list(fields.values())):
        unit = log.units.get((topic, field)) or _unit_in_name(field)
        if unit and not measures(sensor.quantity, unit):
            key = f"sensors.{sensor.quantity}.unit"
            raise CampaignError(log.path, key, f"the unit of '{field}'", f"none, and the log states '{unit}'")
        if unit:
            return unit
    return None


def _unit_in_name(field: str) -> str | None:
    for ending, unit in (
        ("_deg_s", "deg/s"),
        ("_rad_s", "rad/s"),
        ("_deg", "deg"),
        ("_rad", "rad"),
        ("_rpm", "rpm"),
    ):
        if field.lower().endswith(ending):
            return unit
    return None


def source_of(log: Log, quantity: str, sensor: Sensor | None) -> Source | None:
    """Where a quantity comes from: as declared, else the best that was detected, else None."""
    if sensor is not None and sensor.signals:
        return declared_source(log, sensor)
    return choose_source(log, quantity, sensor)


def chosen(sensor: Sensor | None) -> bool:
    """Whether a campaign says which signals or which device a quantity is taken from."""
    return sensor is not None and (bool(sensor.signals) or sensor.source is not None)


def of_one_receiver(log: Log, velocity: Source, position: str) -> Source | None:
    """The velocity of the receiver (as ``sender_of`` names it) that positions come from, not of another of its kind.

    That stands elsewhere aboard, nobody knows where: what a turn adds to its velocity cannot be taken off. None where
    it alone measures one.
    """
    if _kind(sender_of(log, velocity)) != _kind(position):
        return velocity
    there = [s for s in log.sources if s.quantity == "velocity" and s.topic in log.tables]
    return max((s for s in there if sender_of(log, s) == position), key=lambda s: s.rank, default=None)


def _kind(sender: str) -> str:
    return _INSTANCE.sub("", sender)


def require(log: Log, quantity: str, source: Source | None) -> Source:
    """Return the source, or the error that says what follows from its absence.

    Raises
    ------
    MissingQuantity
    """
    if source is not None:
        return source
    follows = {
        "position": "where the vessel went cannot be known",
        "heading": "the drift angle, and with it sway and surge apart, cannot be known",
    }
    raise MissingQuantity(log.path, quantity, follows.get(quantity, "it is needed"), cure(log, quantity))


def cure(log: Log, quantity: str) -> str:
    """What to do about a quantity that a log does not have."""
    still = ", ".join(silent_columns(log, quantity))
    if still:
        return f"{still}: zero throughout, as of a vessel that never moves or a sensor that has no fix."
    beyond = latitudes_beyond(log) if quantity == "position" else ""
    return (
        f"{beyond}."
        if beyond
        else f"Name the signal under [sensors.{quantity}] if the log has one that was not recognised."
    )


def silent_columns(log: Log, quantity: str) -> tuple[str, ...]:
    """Columns whose names say a quantity and that hold nothing but zeros, which is why they were not taken."""
    for topic, table in log.tables.items():
        columns = table.select_dtypes("number")
        ones = {str(c): 1.0 for c in columns if (columns[c] == 0).all()}
        units = {field: unit for (of, field), unit in log.units.items() if of == topic}
        for source in sources_of(columns.assign(**ones), units, topic):
            if source.quantity == quantity and set(source.fields.values()) <= set(ones):
                return tuple(source.fields.values())
    return ()


def latitudes_beyond(log: Log) -> str:
    """What is wrong with a column that is called a latitude and has values beyond the poles; "" where there is none."""
    for topic, table in log.tables.items():
        stated = {field: unit for (of, field), unit in log.units.items() if of == topic}
        for name, _ in latitude_and_longitude(table, stated):
            values = numbers(table, Column(topic, name))
            values = values[np.isfinite(values) & (values != 0.0)]
            if len(values) and np.median(np.abs(values)) > POLE:
                return no_degrees(name, values)
    return ""
