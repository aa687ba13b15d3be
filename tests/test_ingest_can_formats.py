"""The transports of CAN logs: frames as they were written, in every wording of each format."""

import datetime
import sys
from pathlib import Path

import numpy as np
import pytest
from can_samples import (
    READER,
    SAMPLES,
    START_S,
    VOYAGE,
    console,
    expected,
    identity,
    message,
    transport,
    written,
)
from reader_checks import check_reader, log_of

from ingest.canbus import READERS, n2k
from ingest.canbus.mf4 import ExtraMissing
from ingest.reader import ReadOptions


@pytest.mark.parametrize("name", SAMPLES)
def test_every_reader_passes_the_common_checks(name):
    check_reader(READER[name], SAMPLES[name], rounds=2, cuts=12)


@pytest.mark.parametrize("name", [n for n in SAMPLES if n != "actisense"])
def test_frames_are_those_written(name):
    frames = transport(name, SAMPLES[name])
    assert identity(frames) == expected(VOYAGE)
    seconds = np.array([m.timestamp for m in VOYAGE]) - VOYAGE[0].timestamp
    resolution = 1e-3 if name == "ydraw" else 1e-6
    assert np.abs((frames.time_ns - frames.time_ns[0]) * 1e-9 - seconds).max() <= resolution


def test_each_format_is_recognised_before_the_others():
    for name, data in SAMPLES.items():
        best = max(READERS, key=lambda r: r.sniff(data[: 1 << 16]))
        assert best.name == name


@pytest.mark.parametrize(
    "stamp",
    [
        lambda t: f" ({t:.6f})",
        lambda t: f" ({t - START_S:010.6f})",
        lambda t: f" ({datetime.datetime.fromtimestamp(t, datetime.UTC):%Y-%m-%d %H:%M:%S.%f})",
        lambda t: "",
    ],
    ids=["absolute", "zero", "date", "none"],
)
def test_console_styles_of_candump(stamp):
    frames = transport("candump", console(VOYAGE, stamp))
    assert identity(frames) == expected(VOYAGE)
    if stamp(1.0):
        seconds = np.array([m.timestamp for m in VOYAGE]) - VOYAGE[0].timestamp
        assert np.abs((frames.time_ns - frames.time_ns[0]) * 1e-9 - seconds).max() <= 1e-6


def test_console_style_with_time_differences():
    last = [START_S]

    def stamp(t):
        step, last[0] = t - last[0], t
        return f" ({step:010.6f})"

    frames = transport("candump", console(VOYAGE, stamp))
    assert frames.time_ns[-1] * 1e-9 == pytest.approx(VOYAGE[-1].timestamp - START_S, abs=1e-3)


def test_standard_identifiers_channels_and_other_frames():
    text = (
        b"(1.000000) can0 123#0102\n(1.100000) vcan1 00000123#\n(1.2) can0 123#R\n(1.3) can0 123##1AABB\n"
        b"(1.4) can0 20000080#0000000000000000\n(1.5) can0 7FF#11 R\n"
    )
    frames = transport("candump", text)
    assert identity(frames) == [(0x123, False, b"\1\2"), (0x123, True, b""), (0x7FF, False, b"\x11")]
    assert [frames.channels[i] for i in frames.channel] == ["can0", "vcan1", "can0"]
    assert frames.time_ns.tolist() == [1_000_000_000, 1_100_000_000, 1_500_000_000]


def test_trc_versions():
    frame_of = {
        "1.0": b"     1)      1841  0001  8  00 01 02 03 04 05 06 07 \r\n"
        b"     2)      1842  09F11201  2  AA BB\r\n",
        "1.1": b"     1)      1841.5  Rx         0001  8  00 01 02 03 04 05 06 07 \r\n"
        b"     2)      1842.5  Tx     09F11201  2  AA BB \r\n"
        b"     3)   1843.0  Warng  FFFFFFFF  4  00 00 00 08  BUSLIGHT\r\n",
        "1.3": b"     1)      1841.500 1  Rx        0001 -  8    00 01 02 03 04 05 06 07 \r\n"
        b"     2)      1842.500 2  Tx    09F11201 -  2    AA BB \r\n",
        "2.0": b"      1      1841.500 DT     0001 Rx 8  00 01 02 03 04 05 06 07 \r\n"
        b"      2      1842.500 DT 09F11201 Tx 2  AA BB \r\n"
        b"      3      1843.000 ST          Rx    00 00 00 08\r\n",
        "2.1": b"      1      1841.500 DT 1      0001 Rx -  8    00 01 02 03 04 05 06 07 \r\n"
        b"      2      1842.500 DT 2  09F11201 Tx -  2    AA BB \r\n",
    }
    for version, text in frame_of.items():
        header = b";$FILEVERSION=" + version.encode() + b"\r\n;$STARTTIME=45244.5\r\n;\r\n"
        frames = transport("trc", header + text)
        assert identity(frames) == [(1, False, bytes(range(8))), (0x9F11201, True, b"\xaa\xbb")], version
        assert np.diff(frames.time_ns)[0] == pytest.approx(1e9 * 1e-3), version


def test_asc_in_decimal_with_relative_stamps():
    text = (
        b"date Thu Aug 17 03:47:46.421 pm 2017\nbase dec  timestamps relative\nno internal events logged\n"
        b"   0.500000 1  167055820x      Rx   d 8 255 114 90 255 127 255 127 253  Length = 256\n"
        b"   0.250000 2  291             Tx   d 2 1 16\n   0.1 1  ErrorFrame\n"
    )
    frames = transport("asc", text)
    assert identity(frames) == [(167055820, True, b"\xffrZ\xff\x7f\xff\x7f\xfd"), (291, False, b"\x01\x10")]
    assert frames.time_ns.tolist() == [500_000_000, 750_000_000]
    assert [frames.channels[c] for c in frames.channel] == ["1", "2"]


def test_actisense_ascii():
    lines = [f"A173321.{i:03} 23FF2 1F112 00{10000 + i:04X}"[:-4] for i in range(3)]
    text = "".join(
        f"{line}{v:02X}27FF7FFF7FFD\r\n" for line, v in zip(lines, (0x10, 0x11, 0x12), strict=True)
    )
    log = log_of(READER["actisense"], text.encode())
    assert log.tables["vesselHeading"]["heading"].tolist() == pytest.approx([1.0, 1.0001, 1.0002])
    assert set(log.tables["vesselHeading"][n2k.SOURCE]) == {0x23}


def test_canboat_text_with_fast_packets_frame_by_frame():
    frames = [m for k in range(4) for m in message(START_S + k, "gnssPositionData", {"latitude": 5.0 + k}, 9)]
    text = "".join(
        f"{datetime.datetime.fromtimestamp(m.timestamp, datetime.UTC):%Y-%m-%dT%H:%M:%S.%f}"[:-3]
        + f"Z,3,129029,9,255,8,{m.data.hex(',')}\n"
        for m in frames
    )
    table = log_of(READER["actisense"], text.encode()).tables["gnssPositionData"]
    assert table["latitude"].tolist() == pytest.approx([5.0, 6.0, 7.0, 8.0])


def test_that_memory_ran_out_is_no_damage_of_an_mf4(monkeypatch):
    from can.io import MF4Reader

    data = written(VOYAGE[:60], ".mf4")

    def fails_with(error):
        def frames(reader):
            raise error

        monkeypatch.setattr(MF4Reader, "__iter__", frames)

    fails_with(MemoryError())
    with pytest.raises(MemoryError):
        READER["mf4"].read(Path("x.mf4"), memoryview(data), ReadOptions())
    fails_with(KeyError("channel"))
    with pytest.raises(ValueError, match="no CAN frames that asammdf can read"):
        READER["mf4"].read(Path("x.mf4"), memoryview(data), ReadOptions())


def test_mf4(monkeypatch):
    data = written(VOYAGE[:60], ".mf4")
    assert READER["mf4"].sniff(data) > 0.9
    log = log_of(READER["mf4"], data)
    assert len(log.tables["vesselHeading"]) == sum(m.arbitration_id == 0x09F1120A for m in VOYAGE[:60])
    monkeypatch.setitem(sys.modules, "asammdf", None)
    with pytest.raises(ExtraMissing, match=r"seatrial\[mf4\]"):
        READER["mf4"].read(Path("x.mf4"), memoryview(data), ReadOptions())
