"""Logs that know the time of day and no date belong to the campaign's day."""

from __future__ import annotations

from pathlib import Path

import pytest

from ingest import read_log
from ingest.log import Log
from preprocess.run_of_log import LoggedRun
from preprocess.same_day import on_one_day, said_of_day

HOUR = 3600 * 10**9
MIDNIGHT = 20_000 * 24 * HOUR


def run(utc: float | None = None, of_day: float | None = None, start: float | None = None) -> LoggedRun:
    """A log that began so many hours after midnight, by a clock with a date or without."""
    log = Log(
        Path("a"), "nmea0183", {},
        utc_ns=None if utc is None else MIDNIGHT + int(utc * HOUR),
        of_day_ns=None if of_day is None else int(of_day * HOUR),
    )  # fmt: skip
    return LoggedRun("a", log, None, start=start)


@pytest.mark.parametrize(
    ("runs", "starts"),
    [
        ([run(10.0), run(of_day=11.5), run(of_day=9.0)], [None, 1.5, -1.0]),
        ([run(of_day=11.5), run(10.0), run(12.0)], [1.5, None, None]),
        ([run(22.0), run(of_day=1.0), run(25.0)], [None, 3.0, None]),
        ([run(1.0), run(-3.0), run(of_day=23.0)], [None, None, -2.0]),
        ([run(of_day=10.0), run(of_day=11.0), run(of_day=8.0)], [0.0, 1.0, -2.0]),
        ([run(of_day=23.0), run(of_day=0.5)], [0.0, 1.5]),
        ([run(10.0), run(of_day=11.5, start=7.0)], [None, None]),
    ],
)
def test_they_begin_when_their_time_of_day_is_nearest_to_that_of_the_others(runs, starts):
    found = on_one_day(runs)
    declared = [None if r.start is None else r.start / 3600 for r in runs]
    expected = [s if s is not None else d for s, d in zip(starts, declared, strict=True)]
    for one, hours, as_declared in zip(found, expected, declared, strict=True):
        if as_declared is not None:
            assert one.start == 3600 * as_declared
        elif hours is None:
            assert one.start is None
        else:
            assert one.start == pytest.approx(3600 * hours)


def test_it_is_said_where_a_log_has_no_date():
    dated, undated = on_one_day([run(10.0), run(of_day=11.5)])
    assert said_of_day(dated) == []
    assert said_of_day(undated) == ["No record has a date: it began at 5400 s of campaign time."]


POSITIONS = [
    "$GPGGA,080401.21,6326.0594481,N,01024.9008671,E,4,14,0.8,12.1,M,45.0,M,,*5B",
    "$GPGGA,080401.72,6326.0592186,N,01024.9011018,E,4,14,0.8,12.1,M,45.0,M,,*58",
]
DATE = "$GPZDA,065017.44,21,10,2024,00,00*65"


@pytest.mark.parametrize("dated", [True, False])
def test_positions_tell_the_time_of_day_where_nothing_tells_the_date(tmp_path, dated):
    file = tmp_path / "a.nmea"
    file.write_text("\r\n".join(([DATE] if dated else []) + POSITIONS) + "\r\n")
    log = read_log(file)
    assert (log.utc_ns is not None) is dated
    assert log.of_day_ns == (None if dated else (8 * 3600 + 4 * 60) * 10**9 + 1_210_000_000)


def test_a_host_that_counts_from_its_own_start_leaves_the_time_of_day(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("".join(f"{t:.3f} {line}\r\n" for t, line in zip((5.0, 5.51), POSITIONS, strict=True)))
    log = read_log(file)
    assert log.utc_ns is None
    assert log.of_day_ns == pytest.approx((8 * 3600 + 4 * 60 + 1.21) * 1e9, abs=1e7)
