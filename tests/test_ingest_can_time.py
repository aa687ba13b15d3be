"""The clocks of CAN logs: which are UTC, and stamps to the nanosecond."""

import numpy as np
import pytest
from can_samples import (
    ACTISENSE,
    READER,
    SAMPLES,
    START_S,
    VOYAGE,
    candump,
    voyage,
    written,
    yacht_devices,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from nmea2000 import _canboat as canboat
from reader_checks import log_of

from ingest.canbus.lines import date_time_ns, milliseconds_ns, seconds_ns
from ingest.canbus.stamps import repaired_times
from ingest.canbus.trc import start_notes


def test_utc_of_each_clock():
    for name in ("candump", "can-csv"):
        assert log_of(READER[name], SAMPLES[name]).utc_ns == 1_700_000_000 * 10**9
    for name in ("asc", "trc", "blf", "ydraw"):
        assert log_of(READER[name], SAMPLES[name]).utc_ns == pytest.approx(START_S * 1e9, abs=10e6)


def test_local_time_in_a_header_is_not_taken_for_utc(monkeypatch):
    plain = [m for m in VOYAGE if canboat.can_id_decompose(m.arbitration_id)[1] != 129029]
    for suffix, name in ((".asc", "asc"), (".trc", "trc"), (".blf", "blf")):
        log = log_of(READER[name], written(plain, suffix))
        assert log.utc_ns is None
        assert any(f.kind == "clock" and "not used" in f.message for f in log.findings)


@pytest.mark.parametrize(
    ("said", "zone"), [("03.11.2026 10:15:00.123.0", True), ("2026-08-29 11:41:30.843000+00:00", False)]
)
def test_a_zone_that_a_header_states_is_not_called_unknown(said, zone):
    (finding,) = start_notes(f";   Start time: {said}\r\n".encode())
    assert said in finding.message
    assert ("unknown zone" in finding.message) is zone


def test_a_log_over_midnight():
    messages = voyage(4, start=1_700_006_398.0)
    log = log_of(READER["ydraw"], yacht_devices(messages))
    assert 3.9 < log.duration_s < 4.1
    assert log.utc_ns == pytest.approx(1_700_006_398 * 10**9, abs=10e6)


def test_a_computer_clock_that_is_wrong_is_said():
    messages = voyage(4)
    for m in messages:
        m.timestamp += 3600.0
    log = log_of(READER["candump"], candump(messages))
    assert any("+3600" in f.message for f in log.findings if f.kind == "clock")


def test_stamps_are_exact():
    assert seconds_ns([b"1502984866.421964", b"7", b"0.000000001"]).tolist() == [
        1502984866421964000,
        7 * 10**9,
        1,
    ]
    assert milliseconds_ns([b"48.6", b"1841"]).tolist() == [48_600_000, 1_841_000_000]
    assert date_time_ns([b"2026-08-03T05:05:27.966"]).tolist() == [1785733527966000000]
    assert date_time_ns([b"2020-02-29-23:59:59.5", b"1999-12-31 00:00:00"]).tolist() == [
        1583020799500000000,
        946598400000000000,
    ]


def test_stamps_beyond_64_bits_are_left_out():
    head = b"timestamp,arbitration_id,extended,remote,error,dlc,data\n"
    line = b"%d.5,0x9f11201,1,0,0,8,/3Ja/3//f/0=\n"
    stamps = [*range(1_700_000_000, 1_700_000_020), 9_999_999_999, *range(1_700_000_020, 1_700_000_040)]
    log = log_of(READER["can-csv"], head + b"".join(line % s for s in stamps))
    assert (log.messages, log.duration_s) == (40, 39.0)
    canboat_lines = ACTISENSE.replace(b"2023-11-14T22:13:22", b"9999-99-99T99:99:99")
    assert log_of(READER["actisense"], canboat_lines).messages >= 200


@given(st.lists(st.integers(-(2**62), 2**62), max_size=40), st.sampled_from(["utc", "day", "start"]))
@settings(max_examples=100, deadline=None)
def test_any_stamps_are_taken(stamps, clock):
    times, kept, _ = repaired_times(np.array(stamps, np.int64), clock)
    assert len(times) == kept.sum()
