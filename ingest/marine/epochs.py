"""The time of every record of a stream: from host stamps, or else from the records that state their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.clock import continue_clock
from ingest.gps_time import GPS_EPOCH_NS, leap_seconds
from ingest.log import Finding
from ingest.marine.bursts import in_bursts
from ingest.marine.cadence import by_rate
from ingest.marine.definitions import GNSS_TALKERS
from ingest.marine.sentences import Rows
from ingest.marine.stamps import Stamps
from ingest.marine.ubx import Messages

Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

SECOND = 1_000_000_000
DAY, WEEK = 86_400 * SECOND, 7 * 86_400 * SECOND
#: Dates before 2000 are those of receivers that do not know the date yet.
DAY_OF_2000 = 10_957
UNKNOWN = np.iinfo(np.int64).min


@dataclass(frozen=True)
class Timeline:
    """Time of every record.

    Attributes
    ----------
    ns : (n,) int64
        Nanoseconds.
    utc_of_zero : int, optional
        UTC where ``ns`` is 0, where it is known.
    stated : (n,) int64
        UTC (or the time of day, where no date is known) that a record itself states; ``UNKNOWN`` elsewhere.
    findings : tuple of Finding
        What was odd.
    unsure : (n,) float, optional
        By how many seconds the records of a device without a clock may be early or late, all together; None where
        a host wrote the time.
    of_day_of_zero : int, optional
        Time of day where ``ns`` is 0, where that is known and no date is.
    """

    ns: Integers
    utc_of_zero: int | None
    stated: Integers
    findings: tuple[Finding, ...] = ()
    unsure: Floats | None = None
    of_day_of_zero: int | None = None


def timeline(
    count: int, sentences: Mapping[str, Rows], messages: Mapping[str, Messages], host: Stamps | None
) -> Timeline:
    """Put every record of a stream on one time line.

    Parameters
    ----------
    count : int
        Number of records.
    sentences, messages : mapping of str to Rows, Messages
        The decoded records.
    host : Stamps, optional
        Time stamps of arrival; where they are there, they are the time line, and tell UTC if the host knew
        it.
    """
    stated, dated = stated_times(count, sentences, messages)
    of_day = not dated and any((rows.of_day >= 0).any() for rows in sentences.values())
    if host is not None:
        return _by_host(host, stated, dated, of_day)
    if not (stated != UNKNOWN).any():
        raise ValueError("no record states a time, and the host wrote none")
    known = np.flatnonzero(stated != UNKNOWN)
    mended, findings = continue_clock(stated[known])
    continuous = stated.copy()
    continuous[known] = mended
    kinds, device = _kinds(count, sentences, messages)
    own = np.isin(device, device[known])
    ns, unsure = spread(continuous, kinds, own)
    return Timeline(ns, 0 if dated else None, stated, tuple(findings), unsure, 0 if of_day else None)


def _by_host(host: Stamps, stated: Integers, dated: bool, of_day: bool) -> Timeline:
    place = np.flatnonzero(host.good)
    ns, findings = continue_clock(host.ns[place])
    every = np.interp(np.arange(len(host.ns)), place, ns - ns[0]).round().astype(np.int64) + ns[0]
    every[place] = ns
    if host.utc:
        return Timeline(every, 0, stated, (*host.findings, *findings))
    known = np.flatnonzero(stated != UNKNOWN)
    zero = int(np.median(stated[known] - every[known])) if (dated or of_day) and len(known) else None
    utc, since_midnight = (zero, None) if dated else (None, zero)
    return Timeline(every, utc, stated, (*host.findings, *findings), of_day_of_zero=since_midnight)


def _kinds(
    count: int, sentences: Mapping[str, Rows], messages: Mapping[str, Messages]
) -> tuple[Integers, Integers]:
    """Which records are of one kind (topic, instance and device), and which of one device; see ``_talkers``."""
    kinds, device = np.full(count, -1, np.int64), np.zeros(count, np.int64)
    pairs = [(r.record, r.instance) for r in sentences.values()] + [(m.record, 0) for m in messages.values()]
    first = 0
    for record, instance in pairs:
        kinds[record] = first + instance
        first += 1 + int(np.max(instance, initial=0))
    codes: dict[str, int] = {}
    for topic, rows in sentences.items():
        if "talker" in rows.table:
            device[rows.record] = _talkers(rows.table["talker"], codes)
        elif topic.startswith("VN"):
            device[rows.record] = codes.setdefault("VN", len(codes) + 1)
    return np.where(kinds < 0, -1, kinds * (1 + len(codes)) + device), device


def _talkers(talker: pd.Series, codes: dict[str, int]) -> Integers:
    """Number (n,) of each talker by ``codes``, which grow; 0 is the satellites' receiver by any of its names."""
    names = [str(n) for n in talker.cat.categories]
    own = [0 if n in GNSS_TALKERS else codes.setdefault(n, len(codes) + 1) for n in names]
    return np.array(own, np.int64)[talker.cat.codes.to_numpy()]


def stated_times(
    count: int, sentences: Mapping[str, Rows], messages: Mapping[str, Messages]
) -> tuple[Integers, bool]:
    """UTC that each record states (``UNKNOWN`` where none), and whether dates were known.

    Sentences with only a time of day take the date from the nearest record that has one.
    """
    of_day, day = np.full(count, -1, np.int64), np.full(count, -1, np.int64)
    for rows in sentences.values():
        of_day[rows.record], day[rows.record] = rows.of_day, rows.day
    stated = np.full(count, UNKNOWN, np.int64)
    for told in messages.values():
        if {"year", "month", "day", "hour", "min", "nano"} <= set(told.table.columns):
            utc = civil_ns(told.table)
            stated[told.record] = utc
            good = utc != UNKNOWN
            of_day[told.record[good]], day[told.record[good]] = utc[good] % DAY, utc[good] // DAY
    timed = np.flatnonzero(of_day >= 0)
    dated = bool((day[timed] >= 0).any())
    if len(timed):
        stated[timed] = with_dates(of_day[timed], day[timed])
    _time_of_week(stated, messages)
    return stated, dated


def with_dates(of_day: Integers, day: Integers) -> Integers:
    """Continuous time from times of day and the dates that some records state (−1 elsewhere)."""
    running = np.cumsum(np.rint(-np.diff(of_day, prepend=of_day[:1]) / DAY).astype(np.int64))
    dated = day >= DAY_OF_2000
    if not dated.any():
        return of_day + running * DAY
    base = pd.Series(np.where(dated, day - running, 0).astype(float)).where(dated)
    following, preceding = base.bfill(), base.ffill()
    next_time = pd.Series(of_day.astype(float)).where(dated).bfill()
    near = (np.abs(next_time - of_day) <= 2 * SECOND) | preceding.isna()
    chosen = following.where(near, preceding).fillna(preceding).to_numpy()
    return of_day + (running + chosen.astype(np.int64)) * DAY


def civil_ns(table: pd.DataFrame) -> Integers:
    """UTC of the rows of a UBX message with year … nanosecond; ``UNKNOWN`` where it is not valid."""
    second = table["second"] if "second" in table else table["sec"]
    year, month, day = (table[c].to_numpy(np.int64) for c in ("year", "month", "day"))
    valid = (year >= 1980) & (year < 2200) & (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    for flag in ("validDate", "validTime", "validUTC"):
        if flag in table:
            valid &= table[flag].to_numpy(np.int64) == 1
    months = (np.where(valid, year, 1980) - 1970) * 12 + np.where(valid, month, 1) - 1
    days = months.astype("datetime64[M]").astype("datetime64[D]").astype(np.int64) + day - 1
    clock = (table["hour"].to_numpy(np.int64) * 60 + table["min"].to_numpy(np.int64)) * 60 + second.to_numpy(
        np.int64
    )
    return np.where(valid, days * DAY + clock * SECOND + table["nano"].to_numpy(np.int64), UNKNOWN)


def _time_of_week(stated: Integers, messages: Mapping[str, Messages]) -> None:
    """Fill in the times of UBX messages that state only the time of the GPS week, by the week around them."""
    known = np.flatnonzero(stated != UNKNOWN)
    for told in messages.values():
        open_ = stated[told.record] == UNKNOWN
        if "iTOW" not in told.table or not open_.any():
            continue
        place = told.record[open_]
        tow = told.table["iTOW"].to_numpy(np.int64)[open_] * 1_000_000
        stated[place] = tow if not len(known) else _nearest_week(tow, stated[known], known, place)


def _nearest_week(tow: Integers, times: Integers, known: Integers, place: Integers) -> Integers:
    around = times[np.clip(np.searchsorted(known, place), 0, len(known) - 1)]
    if np.median(around) < GPS_EPOCH_NS:
        shift = int(np.median(np.mod(around - tow + DAY // 2, DAY) - DAY // 2))
        return np.asarray(around - np.mod(around - tow - shift + DAY // 2, DAY) + DAY // 2, np.int64)
    gps = around + leap_seconds(around) * SECOND - GPS_EPOCH_NS
    week = np.rint((gps - tow) / WEEK).astype(np.int64)
    in_gps = GPS_EPOCH_NS + week * WEEK + tow
    return np.asarray(in_gps - leap_seconds(in_gps) * SECOND, np.int64)


def spread(stated: Integers, kinds: Integers, own: Flags) -> tuple[Integers, Floats]:
    """Find times for the records that state none, and by how many seconds they may be early or late together.

    An epoch lasts from a record with a new time to the next such record. What the device sends that tells the time
    belongs to its epoch: of a kind that comes once per epoch, each record has the time of its epoch; of one that comes
    k times, the j-th is j/k of the epoch later. Any other device runs by itself, and only the order of arrival tells
    when: at its own rate where it has one (``ingest.marine.cadence``), else in the middle of its share of the epoch. So
    with what the first sends long after its burst (``ingest.marine.bursts``), between what all others sent.

    Parameters
    ----------
    stated : (n,) int64
        Times, ``UNKNOWN`` where a record has none.
    kinds : (n,) int64
        Which records are of one kind.
    own : (n,) bool
        Which come from a device that states times.

    Notes
    -----
    It is assumed that the first record of an epoch takes as long from the moment that it states to the file as the
    records between take from theirs. If it takes longer by a constant time, a device of its own seems early by that:
    the order cannot tell.
    """
    known = np.flatnonzero(stated != UNKNOWN)
    leader = known[np.concatenate(([True], np.diff(np.maximum.accumulate(stated[known])) > 0))]
    times = stated[leader]
    steps = np.diff(times)
    usual = int(np.median(steps)) if len(steps) else SECOND
    aside = own & ~in_bursts(leader, kinds, own, stated != UNKNOWN)
    own = own & ~aside
    epoch = np.searchsorted(leader, np.arange(len(stated)), side="right") - 1
    group = pd.DataFrame({"epoch": epoch, "kind": kinds}).groupby(["epoch", "kind"], sort=False)["epoch"]
    rank, size = group.cumcount().to_numpy(np.int64), group.transform("size").to_numpy(np.int64)
    last = len(times) - 1
    inner = (rank == 0) & (epoch >= 0) & (epoch < last)
    before, after = (usual * _epochs_in(epoch == e, inner, kinds, size) for e in (-1, last))
    begins = np.concatenate(([times[0] - before], times))
    lasts = np.concatenate(([before], steps, [after]))
    share = lasts[epoch + 1] // size
    shared = begins[epoch + 1] + lasts[epoch + 1] * rank // size + np.where(own, 0, share // 2)
    unsure = np.where(own | (stated != UNKNOWN), 0.0, 0.5 * share)
    within = np.concatenate(([-np.inf], times - times[0], [np.inf]))
    shared = np.where(stated == UNKNOWN, shared, stated)
    for some in (~own & ~aside, aside):
        others = _between(shared - times[0], ~aside) if some is aside else None
        lower, upper = others or (within[epoch + 1], within[epoch + 2])
        for mine in _each_kind(kinds, some & (stated == UNKNOWN)):
            rough = (shared[mine] - times[0]).astype(float)
            found, half = by_rate(lower[mine], upper[mine], rough)
            good = np.isfinite(found)
            shared[mine[good]] = times[0] + np.rint(found[good]).astype(np.int64)
            unsure[mine[good]] = half[good]
    return shared, unsure / SECOND


def _between(times: Integers, known: Flags) -> tuple[Floats, Floats]:
    """Between which of the records (n,) whose times are ``known`` each came, as far as these are in order."""
    before, after = np.where(known, times, -np.inf), np.where(known, times, np.inf)
    return np.maximum.accumulate(before), np.minimum.accumulate(after[::-1])[::-1]


def _each_kind(kinds: Integers, chosen: Flags) -> list[Integers]:
    """Places of the chosen records, kind by kind, in order; of no known kind, none."""
    place = np.flatnonzero(chosen & (kinds >= 0))
    place = place[np.argsort(kinds[place], kind="stable")]
    return [p for p in np.split(place, 1 + np.flatnonzero(np.diff(kinds[place]))) if len(p)]


def _epochs_in(chosen: Flags, inner: Flags, kinds: Integers, size: Integers) -> int:
    """How many epochs the chosen records span, by how many of their kind there are in the ``inner`` ones."""
    longest = 1
    for kind in np.unique(kinds[chosen]):
        mine = kinds == kind
        usual = float(np.median(size[mine & inner])) if (mine & inner).any() else np.inf
        longest = max(longest, round(float(size[mine & chosen].max()) / usual))
    return longest
