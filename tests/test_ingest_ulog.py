"""ULog: as pyulog decodes it, and better next to damage."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest
from mavlink_peers import ULOG, assert_as_pyulog, spots_of
from mavlink_samples import (
    START_US,
    ulog_body,
    ulog_head,
)  # fmt: skip
from reader_checks import log_of

from ingest import read_log


def test_ulog_as_pyulog(tmp_path):
    path = tmp_path / "a.ulg"
    path.write_bytes(ulog_head() + b"".join(ulog_body()))
    log = read_log(path)
    assert log.format == "ulog"
    assert_as_pyulog(log, path)
    assert set(log.tables["sensor_gps[1]"]["source"]) == {1}
    assert np.allclose(log.tables["vehicle_attitude"]["heading"], np.arange(150) / 100, atol=1e-6)
    assert log.utc_ns == pytest.approx((START_US + 5_000_000) * 1000, abs=1000)
    assert {s.quantity for s in log.sources} == {"position", "heading", "yaw_rate"}
    assert any("dropout" in f.message and "40 ms" in f.message for f in log.findings)


@pytest.mark.parametrize("seed", range(3))
def test_ulog_recovers_next_to_damage(seed):
    rng = random.Random(seed)
    body = ulog_body()
    spots = spots_of(body, 20, seed)
    junk = b"".join(rng.randbytes(rng.randrange(1, 70)) + r if i in spots else r for i, r in enumerate(body))
    lost = b"".join(r[:9] + r[15:] if i in spots and i - 1 not in spots else r for i, r in enumerate(body))
    good = log_of(ULOG, ulog_head() + b"".join(body))
    for data, least in ((junk, 0), (lost, 20)):
        log = log_of(ULOG, ulog_head() + data)
        assert good.messages - least <= log.messages <= good.messages + 2
        assert log.bytes_damaged > 0


def test_ulog_text_messages_swallow_no_data():
    """Junk that looks like a long text message, followed by what looks like another."""
    body = b"".join(ulog_body())
    fake = struct.pack("<HB", 3_000, ord("I")) + b"junk"
    data = body[: len(body) // 2]
    whole = ulog_head() + body
    cut = next(k for k in range(len(data), 0, -1) if log_of(ULOG, ulog_head() + data[:k]).bytes_damaged == 0)
    end = cut + 3 + 3_000 - len(fake)
    spoilt = body[:cut] + fake + body[cut:end] + struct.pack("<HB", 20, ord("I")) + body[end:]
    good, log = log_of(ULOG, whole), log_of(ULOG, ulog_head() + spoilt)
    assert good.messages - 2 <= log.messages <= good.messages + 1


def test_ulog_twice_in_one_file(tmp_path):
    whole = ulog_head() + b"".join(ulog_body())
    one, two = log_of(ULOG, whole), log_of(ULOG, whole + whole)
    assert two.messages == 2 * one.messages
    assert two.duration_s == pytest.approx(2 * one.duration_s, rel=0.05)
    assert sum(f.kind == "clock" for f in two.findings) == 1


def test_ulog_zero_and_absurd_stamps():
    body = ulog_body()
    body[30] = body[30][:5] + bytes(8) + body[30][13:]
    body[33] = body[33][:5] + b"\xff" * 7 + b"\0" + body[33][13:]
    log = log_of(ULOG, ulog_head() + b"".join(body))
    assert log.duration_s == pytest.approx(1.49, abs=0.02)


def test_lying_lengths_allocate_nothing():
    hostile = ulog_head() + struct.pack("<HB", 65535, ord("D")) * 50
    hostile += struct.pack("<HB", 60, ord("F")) + b"inner:" + b"inner[9999999] a;".ljust(54, b" ")
    assert log_of(ULOG, hostile) is None
