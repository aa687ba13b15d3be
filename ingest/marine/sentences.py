"""NMEA 0183 sentences to columns: one table per formatter, all its sentences parsed at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import SOURCE, Finding
from ingest.marine import fields as f
from ingest.marine.definitions import GNSS_TALKERS, WITH_SUBTYPE, Sentence, expand, sentence_of
from ingest.marine.derived import completed
from ingest.marine.scan import NMEA_UNCHECKED, Bytes, Records
from ingest.stacking import stacked

Integers = NDArray[np.int64]
DAY_NS, SECOND = 86_400_000_000_000, 1_000_000_000


@dataclass(frozen=True)
class Rows:
    """The records of one topic.

    Attributes
    ----------
    record : (n,) int64
        Index of each row among the records of the stream, ascending.
    table : DataFrame
        Columns as decoded, without an index yet.
    of_day : (n,) int64
        Time of day that the record itself states, ns; −1 where none.
    day : (n,) int64
        Days since 1970 that the record itself states; −1 where none.
    instance : (n,) int64 or 0
        Which of several shafts, devices or transducers the record is of, counted from 0.
    """

    record: Integers
    table: pd.DataFrame
    of_day: Integers
    day: Integers
    instance: Integers | int = 0


def sentence_rows(
    data: Bytes, records: Records, topics: frozenset[str] | None = None
) -> tuple[dict[str, Rows], list[Finding]]:
    """Decode every NMEA sentence of a stream.

    Parameters
    ----------
    data : (n,) uint8
        The stream.
    records : Records
        What ``scan`` found in it.
    topics : set of str, optional
        Decode only these (those that state a time or a date are always decoded).
    """
    chosen = np.flatnonzero(records.kind <= NMEA_UNCHECKED)
    if not len(chosen):
        return {}, []
    start, end = records.start[chosen] + 1, records.end[chosen]
    key = f.pack(data, start, end)
    sub = _subtypes(data, start, end, key)
    width = f.count_fields(data, start, end)
    parts: dict[str, list[Rows]] = {}
    talkers: dict[str, list[tuple[Sentence, Integers]]] = {}
    for rows in _alike(key, sub, width):
        first = rows[0]
        sentence = sentence_of(f.unpack(int(key[first])), f.unpack(int(sub[first])))
        if not sentence.topic or (topics is not None and not _needed(sentence, topics)):
            continue
        part = _decode(data, start[rows], end[rows], int(width[first]), sentence, chosen[rows])
        parts.setdefault(sentence.topic, []).append(part)
        talkers.setdefault(sentence.topic, []).append((sentence, chosen[rows]))
    tables, findings = {}, []
    for topic, pieces in parts.items():
        rows_of_topic, said = _with_talkers(topic, _join(pieces), talkers[topic])
        table, instance = completed(topic, rows_of_topic.table)
        tables[topic] = replace(rows_of_topic, table=table, instance=instance)
        findings += said
    return tables, findings


def _needed(sentence: Sentence, topics: frozenset[str]) -> bool:
    timed = {"TM", "DT", "DTL", "DM"} & {k for k in sentence.payload.values() if isinstance(k, str)}
    return sentence.topic in topics or bool(timed)


def _subtypes(data: Bytes, start: Integers, end: Integers, key: Integers) -> Integers:
    """Return the first field of the makers' sentences whose meaning it decides, packed; 0 elsewhere."""
    own = np.isin(key, [_packed(a) for a in WITH_SUBTYPE])
    sub = np.zeros(len(key), np.int64)
    if own.any():
        marks = f.split(data, start[own], end[own], 1)
        sub[own] = f.pack(data, marks[0], end[own], 4)
    return sub


def _packed(text: str) -> int:
    key = 0
    for letter in text.encode():
        key = (key << 7) | letter
    return key


def _alike(key: Integers, sub: Integers, width: Integers) -> list[Integers]:
    """Rows of the same address, subtype and number of fields, each group in the order of the stream."""
    codes = pd.factorize(key)[0].astype(np.int64)
    codes = codes * (1 + int(width.max())) + width
    if sub.any():
        codes = pd.factorize(codes)[0] * (1 + len(sub)) + pd.factorize(sub)[0]
    codes = np.asarray(pd.factorize(codes)[0])
    order = np.argsort(codes, kind="stable")
    cuts = np.flatnonzero(np.diff(codes[order])) + 1
    return [g for g in np.split(order, cuts) if len(g)]


def _decode(
    data: Bytes, start: Integers, end: Integers, width: int, sentence: Sentence, record: Integers
) -> Rows:
    columns: dict[str, object] = {}
    of_day = np.full(len(start), f.MISSING, np.int64)
    day = np.full(len(start), f.MISSING, np.int64)
    marks = f.split(data, start, end, width)
    layout = expand(sentence.payload, width)
    for i, (name, kind) in enumerate(layout):
        a, b = marks[i], marks[i + 1] - 1
        if kind in {"LA", "LN"}:
            side = _side(data, marks, i, layout)
            columns[name] = f.degrees(data, a, b, side)
        elif kind == "TM":
            time = f.times_of_day(data, a, b)
            columns[name] = np.where(time >= 0, time / SECOND, np.nan)
            of_day = np.where(of_day < 0, time, of_day)
        elif kind in {"DT", "DM", "DTL"}:
            day = f.dates(data, a, b, kind == "DM", kind == "DTL")
            columns[name] = _as_dates(day)
        elif kind in {"DE", "IN"}:
            columns[name] = f.decimals(data, a, b)
        elif kind == "??":
            columns[name] = _numbers_or_texts(data, a, b)
        elif kind not in {"LAD", "LND"} or name.startswith(("deviation", "variation", "mv")):
            columns[name] = f.texts(data, a, b)
    if {"day", "month", "year"} <= columns.keys():
        day = _civil(columns)
    return Rows(record, pd.DataFrame(columns), of_day, day)


def _side(data: Bytes, marks: Integers, i: int, layout: Sequence[tuple[str, str]]) -> Bytes:
    """Letters of the hemisphere field after a latitude or longitude."""
    if i + 1 < len(layout) and layout[i + 1][1] in {"LAD", "LND"}:
        return f.first_letters(data, marks[i + 1], marks[i + 2] - 1)
    return np.zeros(marks.shape[1], np.uint8)


def _as_dates(day: Integers) -> NDArray[np.datetime64]:
    dates = day.astype("datetime64[D]").astype("datetime64[s]")
    dates[day < 0] = np.datetime64("NaT")
    return dates


def _numbers_or_texts(data: Bytes, a: Integers, b: Integers) -> object:
    numbers = f.decimals(data, a, b)
    filled = b > a
    return numbers if np.isfinite(numbers[filled]).all() else f.texts(data, a, b)


def _civil(columns: Mapping[str, object]) -> Integers:
    """Days since 1970 from the columns ``year``, ``month`` and ``day``."""
    year, month, day = (
        np.nan_to_num(np.asarray(columns[c], float)).astype(np.int64) for c in ("year", "month", "day")
    )
    known = (year >= 1970) & (year < 2200) & (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    months = (np.where(known, year, 1970) - 1970) * 12 + np.where(known, month, 1) - 1
    days = months.astype("datetime64[M]").astype("datetime64[D]").astype(np.int64) + day - 1
    return np.where(known, days, f.MISSING)


def _join(parts: Sequence[Rows]) -> Rows:
    if len(parts) == 1:
        return parts[0]
    record = np.concatenate([p.record for p in parts])
    order = np.argsort(record, kind="stable")
    table = stacked([p.table for p in parts]).iloc[order].reset_index(drop=True)
    of_day, day = (np.concatenate([getattr(p, a) for p in parts])[order] for a in ("of_day", "day"))
    return Rows(record[order], table, of_day, day)


def _with_talkers(
    topic: str, rows: Rows, kinds: Sequence[tuple[Sentence, Integers]]
) -> tuple[Rows, list[Finding]]:
    """Add the talker, and where several devices send the topic, the column that tells them apart."""
    names = list(dict.fromkeys(s.talker for s, _ in kinds))
    if names == ["P"] or names == ["VN"]:
        return rows, []
    codes = np.zeros(len(rows.record), np.int64)
    for sentence, record in kinds:
        codes[np.searchsorted(rows.record, record)] = names.index(sentence.talker)
    table = rows.table.assign(talker=f.categorical(codes.astype(np.intp), names))
    devices = list(dict.fromkeys("GNSS" if n in GNSS_TALKERS else n for n in names))
    findings = []
    if len(devices) > 1 and topic != "RPM":
        number = [1 + devices.index("GNSS" if n in GNSS_TALKERS else n) for n in names]
        table[SOURCE] = np.array(number)[codes]
        told = ", ".join(f"{d} is source {i + 1}" for i, d in enumerate(devices))
        findings.append(Finding("note", f"several talkers send it: {told}", topic=topic))
    return Rows(rows.record, table, rows.of_day, rows.day), findings
