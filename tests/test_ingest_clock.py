"""One clock for a log: restarts, broken stamps, gaps, leap seconds."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from ingest_tables import SECOND, table

from ingest.clock import continue_clock, duplicates, gaps, mended, timing_findings
from ingest.gps_time import gps_to_utc_ns, leap_seconds


def test_restart_is_continued():
    t = np.array([100.0, 100.1, 100.2, *np.arange(20) * 0.1]) * SECOND
    out, findings = continue_clock(t.astype(np.int64))
    assert (np.diff(out) > 0).all()
    assert out[3] - out[2] == 100_000_000
    assert findings[0].kind == "clock"


def test_late_records_are_no_restart():
    t = (np.array([0, 1, 2, 0.5, 3, 4, 5]) * SECOND).astype(np.int64)
    out, findings = continue_clock(t)
    assert (out == t).all()
    assert not findings


def test_shuffled_records_are_no_restarts():
    t = np.random.default_rng(1).permutation(np.arange(0, 120_000_000_000, 100_000_000))
    after, findings = continue_clock(t)
    assert np.array_equal(after, t)
    assert not findings


@pytest.mark.parametrize("spoilt", [0, 7, 49, 98, 99])
@pytest.mark.parametrize("value", [0, 2**61, 55 * SECOND])
def test_one_broken_stamp_is_mended(spoilt, value):
    t = np.arange(100, dtype=np.int64) * SECOND // 10 + 50_000 * SECOND
    bad = t.copy()
    bad[spoilt] = value
    out, findings = mended(bad, np.zeros(100, dtype=bool), np.arange(100))
    assert np.abs(out - t).max() <= SECOND // 5
    assert findings[0].count >= 1


def test_two_logs_one_after_the_other_are_continued():
    one = np.r_[np.arange(0, 60.0, 1.0), 90.0, 90.01, 150.0] * SECOND
    t = np.r_[one, one, one].astype(np.int64)
    out, findings = mended(t, np.zeros(len(t), bool), np.arange(len(t)))
    assert sum(f.count for f in findings) <= 3
    continued, restarts = continue_clock(out)
    assert len(restarts) == 2 and (np.diff(continued) >= 0).all()
    assert continued[-1] >= 3 * 90 * SECOND


def test_slow_records_are_no_strays():
    t = (np.r_[np.arange(10.0) * 3, np.arange(10.0) * 3] * SECOND).astype(np.int64)
    out, findings = mended(t, np.zeros(len(t), bool), np.arange(len(t)))
    assert not findings and (out == t).all()


def test_a_gap_in_good_time_is_not_mended():
    t = np.concatenate([np.arange(50), np.arange(50) + 10_000]) * SECOND
    out, findings = mended(t.astype(np.int64), np.zeros(100, dtype=bool), np.arange(100))
    assert (out == t).all()
    assert not findings


def test_gaps_and_duplicates():
    t = np.concatenate([np.arange(100), np.arange(110, 200)]) * 0.1
    frame = table(t, a=np.arange(190.0))
    (gap,) = gaps("A", frame)
    assert gap.count == 1
    assert "1.10 s after 9.90 s" in gap.message
    assert not gaps("A", table([0, 1, 5, 30, 31, 90] * 5, a=[0.0] * 30).sort_index())
    double = pd.concat([frame, frame.iloc[[3, 4]]]).sort_index(kind="stable")
    assert duplicates("A", double)[0].count == 2
    once = pd.concat([frame, frame.iloc[[3]]]).sort_index(kind="stable")
    assert duplicates("A", once)[0].message == "1 record was logged twice"
    assert {f.kind for f in timing_findings({"A": double})} == {"gap", "duplicate"}


def test_leap_seconds_of_the_date():
    assert gps_to_utc_ns(2290, 0) == 1_700_956_782 * SECOND
    assert gps_to_utc_ns(0, 0) == 315_964_800 * SECOND
    for week, leap in {1303: 13, 1357: 14, 1512: 14, 1513: 15, 1930: 17, 1931: 18}.items():
        assert leap_seconds((315_964_800 + week * 604_800) * SECOND) == leap


def test_leap_second_boundary():
    new_year = 1_483_228_800 * SECOND  # 2017-01-01T00:00:00Z
    gps_ns = new_year + 18 * SECOND
    assert leap_seconds(gps_ns) == 18
    assert leap_seconds(gps_ns - 1) == 17
