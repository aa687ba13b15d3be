"""The time line of serial logs: from the sentences, host stamps, tag blocks, arrival, and UBX's time of week."""

from functools import reduce

import numpy as np
import pytest
from marine_samples import SECOND, UTC_0, drive, epoch, nmea, pvt
from pyubx2 import GET, UBXMessage

from ingest.marine.stream import decode_stream


def test_time_from_the_sentences_themselves():
    stream = decode_stream(b"".join(drive(50)))
    assert stream.utc_of_zero == 0
    expected = UTC_0 + 43200 * SECOND + np.arange(50) * SECOND // 5
    for topic in ("GGA", "RMC", "VTG", "HDT"):
        np.testing.assert_array_equal(stream.tables[topic].index, expected)


def test_sentences_faster_than_the_epochs_are_spread_over_them():
    lines = [
        x for i in range(20) for x in (*epoch(i)[:2], *(nmea(f"HEHDT,{i + j / 10:.2f},T") for j in range(10)))
    ]
    stream = decode_stream(b"".join(lines))
    table = stream.tables["HDT"]
    np.testing.assert_allclose(np.diff(table.index), SECOND // 10, rtol=1e-3)
    # ten in step with each epoch: any moment of a tenth of a second is as likely as any other
    np.testing.assert_allclose(table["headingT"] + 0.05, (table.index - UTC_0) / SECOND, atol=2e-3)
    assert 0.04 < stream.unsure["HDT"] <= 0.05


def test_what_the_receiver_itself_sends_belongs_to_its_epoch():
    lines = [
        x for i in range(20) for x in (*epoch(i)[:2], *(nmea(f"GPROT,{j / 10:.2f},A") for j in range(10)))
    ]
    stream = decode_stream(b"".join(lines))
    np.testing.assert_array_equal(stream.tables["ROT"].index, UTC_0 + np.arange(200) * SECOND // 10)
    assert not stream.unsure


@pytest.mark.parametrize(
    ("topic", "bodies"),
    [
        ("RPM", ("IIRPM,S,1,{},45.0,A", "IIRPM,S,2,{},45.0,A")),
        ("RPM", ("IIRPM,S,1,{},45.0,A", "IIRPM,E,1,{},45.0,A")),
        ("XDR", ("YXXDR,A,{},D,PTCH", "YXXDR,A,{},D,ROLL")),
        ("XDR", ("YXXDR,C,{},C,ENGINE", "YXXDR,P,{},B,ENGINE")),
        ("MWV", ("WIMWV,{},R,5.0,M,A", "WIMWV,{},T,5.0,M,A")),
        ("HDT", ("HEHDT,{},T", "HCHDT,{},T")),
    ],
)
@pytest.mark.parametrize("often", [1, 2])
def test_instances_of_one_formatter_are_timed_each_by_itself(topic, bodies, often):
    both = [nmea(body.format(7.5)) for body in bodies]
    raw = b"".join(s for i in range(20) for s in (*epoch(43200 + i)[:2], *both * often))
    index = decode_stream(raw).tables[topic].index.to_numpy()
    expected = UTC_0 + 43200 * SECOND + (np.arange(20 * often) + 0.5) * SECOND / often
    np.testing.assert_allclose(index, np.repeat(expected, 2), rtol=0, atol=0.02 * SECOND)


def test_a_compass_that_runs_before_the_first_fix_and_after_the_last():
    lone = [nmea(f"HEHDT,{i},T") for i in range(100)]
    table = decode_stream(b"".join([*lone, *drive(50), *lone])).tables["HDT"]
    table = table[table["talker"] == "HE"]
    assert np.diff(table.index[:100]).max() < SECOND
    drive_ns = [s for s in drive(50) if b"HDT" not in s]
    with_own = [x for s in drive_ns for x in ([s, lone[0]] if b"GGA" in s else [s])]
    index = decode_stream(b"".join([*lone, *with_own, *lone])).tables["HDT"].index.to_numpy()
    np.testing.assert_allclose(np.diff(index)[1:-1], SECOND / 5, rtol=0.03)
    assert (np.diff(index) >= 0).all()


@pytest.mark.parametrize("with_date", [True, False])
def test_midnight(with_date):
    lines = [s for i in range(100) for s in epoch(86400 - 10 + i / 5)]
    raw = b"".join(s for s in lines if with_date or b"RMC" not in s)
    stream = decode_stream(raw)
    assert set(np.diff(stream.tables["GGA"].index)) == {SECOND // 5}
    assert (stream.utc_of_zero == 0) == with_date


@pytest.mark.parametrize(
    ("stamp", "utc"),
    [
        (lambda t: f"2024-06-01T12:{int(t // 60):02d}:{t % 60:06.3f}Z ", True),
        (lambda t: f"[2024-06-01 14:{int(t // 60):02d}:{t % 60:06.3f}+02:00] ", True),
        (lambda t: f"{1717243200 + t:.6f} ", True),
        (lambda t: f"{int((1717243200 + t) * 1000)},", True),
        (lambda t: f"[12:{int(t // 60):02d}:{t % 60:06.3f}] ", False),
        (lambda t: f"{int(t * 1000)}\t", False),
    ],
)
def test_host_stamps(stamp, utc):
    lines = [stamp(i / 8).encode() + s for i in range(80) for s in epoch(43200 + i / 8 - 0.125)]
    stream = decode_stream(b"".join(lines))
    index = stream.tables["GGA"].index.to_numpy()
    np.testing.assert_allclose(np.diff(index) * 1e-9, 0.125, atol=1e-3)
    assert stream.utc_of_zero is not None
    arrived = stream.utc_of_zero + index[0] - UTC_0 - 43200 * SECOND
    assert arrived == pytest.approx(0.0 if utc else -0.125e9, abs=2e7)
    assert not [f for f in stream.findings if f.kind == "damaged"]


def test_lost_zeros_of_host_stamps_are_put_back():
    times = [1_717_243_200_000_000_000 + i * 53_111_000 for i in range(400)]
    lines = [f"{t // SECOND}.{t % SECOND} ".encode() + epoch(43200 + i)[0] for i, t in enumerate(times)]
    stream = decode_stream(b"".join(lines))
    np.testing.assert_array_equal(stream.tables["GGA"].index, times)
    assert any("leading zeros" in f.message for f in stream.findings)


def test_a_host_stamp_that_is_damaged_moves_no_record():
    """A stamp has no checksum of its own: one flipped bit of a date would make a log of ten days."""
    lines = [
        f"2024-06-{11 if i == 40 and b'GGA' in s else 1:02d}T12:00:{i / 8:06.3f}Z ".encode() + s
        for i in range(80)
        for s in epoch(43200 + i / 8)
    ]
    stream = decode_stream(b"".join(lines))
    index = stream.tables["GGA"].index.to_numpy()
    assert len(index) == 80
    np.testing.assert_allclose(np.diff(index) * 1e-9, 0.125, atol=0.07)
    assert np.ptp(index) == pytest.approx(79 / 8 * SECOND, abs=2e6)
    [said] = [f for f in stream.findings if "contradict" in f.message]
    assert said.kind == "clock"
    assert said.count == 1


def test_tag_blocks():
    def tagged(t: int, sentence: bytes) -> bytes:
        block = f"s:r1,c:{1717243200 + t}"
        return f"\\{block}*{reduce(lambda x, c: x ^ c, block.encode(), 0):02X}\\".encode() + sentence

    stream = decode_stream(b"".join(tagged(i, epoch(43200 + i)[0]) for i in range(30)))
    np.testing.assert_array_equal(np.diff(stream.tables["GGA"].index), SECOND)
    assert stream.bytes_damaged == 0


def test_arrival_times_of_a_live_port():
    pieces = [b"".join(epoch(43200 + i)) for i in range(10)]
    offsets = np.cumsum([0, *map(len, pieces[:-1])])
    arrived = UTC_0 + 43200 * SECOND + np.arange(10) * SECOND + 50_000_000
    stream = decode_stream(b"".join(pieces), arrival=(offsets, arrived))
    np.testing.assert_array_equal(stream.tables["HDT"].index, arrived)


def test_time_of_ubx():
    raw = b"".join(
        pvt(43200 + i / 10) + UBXMessage("NAV", "NAV-VELNED", GET,
            iTOW=int((561600 + i / 10 + 18.05) * 1000)).serialize()
        for i in range(30)
    )  # fmt: skip
    stream = decode_stream(raw)
    exact = UTC_0 + 43200 * SECOND + np.arange(30) * SECOND // 10
    np.testing.assert_allclose(stream.tables["NAV-PVT"].index, exact, atol=2, rtol=0)
    np.testing.assert_allclose(stream.tables["NAV-VELNED"].index, exact + 50_000_000, atol=1_000_000, rtol=0)


def test_a_time_of_week_that_begins_anew():
    times = 86400 - 18 - 1 + np.arange(30) / 10  # the GPS week ends 18 s before the day
    raw = b"".join(
        pvt(t)
        + UBXMessage(
            "NAV", "NAV-VELNED", GET, iTOW=round((6 * 86400 + t + 18.05) * 1000) % 604_800_000
        ).serialize()
        for t in times
    )
    stream = decode_stream(raw)
    assert stream.tables["NAV-VELNED"]["iTOW"].min() < 10_000
    exact = UTC_0 + np.rint((times + 0.05) * SECOND).astype(np.int64)
    np.testing.assert_allclose(stream.tables["NAV-VELNED"].index, exact, atol=1_000_000, rtol=0)
