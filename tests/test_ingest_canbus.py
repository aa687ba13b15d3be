"""CAN logs: transports against python-can, PGNs against nmea2000, DBC against cantools; damage."""

import datetime
import logging
import random
import sys
import time
from collections import defaultdict
from pathlib import Path

import can
import numpy as np
import pytest
from can_samples import (
    START_S,
    candump,
    candump_line,
    console,
    frame,
    message,
    voyage,
    written,
    yacht_devices,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from nmea2000 import _canboat as canboat
from nmea2000 import backend
from reader_checks import check_log, check_reader, log_of

from ingest import read_log
from ingest.canbus import READERS, n2k
from ingest.canbus.fastpacket import assemble
from ingest.canbus.frames import Frames, Packets
from ingest.canbus.layout import layout, telling_places
from ingest.canbus.lines import date_time_ns, milliseconds_ns, seconds_ns
from ingest.canbus.mf4 import ExtraMissing
from ingest.canbus.stamps import repaired_times
from ingest.errors import UsageError
from ingest.reader import ReadOptions

logging.getLogger("nmea2000").setLevel(logging.CRITICAL)
FORMATS = Path(__file__).parents[2] / "shared" / "data" / "formats"
READER = {r.name: r for r in READERS}
VOYAGE = voyage()
ACTISENSE = b"".join(
    f"2023-11-14T22:13:{20 + i / 10:06.3f}Z,2,127250,10,255,8,00,{(10000 + i) & 255:02x},"
    f"{(10000 + i) >> 8:02x},ff,7f,ff,7f,fc\r\n".encode()
    for i in range(300)
)
SAMPLES = {
    "candump": candump(VOYAGE),
    "asc": written(VOYAGE, ".asc"),
    "blf": written(VOYAGE, ".blf"),
    "trc": written(VOYAGE, ".trc"),
    "can-csv": written(VOYAGE, ".csv"),
    "ydraw": yacht_devices(VOYAGE),
    "actisense": ACTISENSE,
}


def transport(name: str, data: bytes) -> Frames:
    """Frames as the format's transport yields them."""
    read = READER[name].read
    module = sys.modules[f"ingest.canbus.{ {'can-csv': 'can_table'}.get(name, name) }"]
    assert read is not None
    return module.read(memoryview(data)).frames


def identity(frames: Frames) -> list[tuple[int, bool, bytes]]:
    """What a frame is, apart from its time."""
    rows = zip(
        frames.can_id.tolist(), frames.extended.tolist(), frames.data, frames.dlc.tolist(), strict=True
    )
    return [(i, e, bytes(d[:n])) for i, e, d, n in rows]


def expected(messages: list[can.Message]) -> list[tuple[int, bool, bytes]]:
    return [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in messages]


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


# --- damage --------------------------------------------------------------------------------------------


def test_glued_lines_come_apart():
    lines = [candump_line(m) for m in VOYAGE]
    text = b"".join(line[:-1] if i % 5 == 0 else line for i, line in enumerate(lines))
    assert identity(transport("candump", text)) == expected(VOYAGE)
    assert log_of(READER["candump"], text).bytes_damaged == 0


@pytest.mark.parametrize("junk", [b"# a remark", b"\x00\xff", b"!!", b" what?"])
def test_junk_right_after_a_record_costs_nothing(junk):
    lines = [candump_line(m) for m in VOYAGE]
    text = b"".join(line.rstrip() + junk + b"\n" if i % 7 == 3 else line for i, line in enumerate(lines))
    assert identity(transport("candump", text)) == expected(VOYAGE)


def test_a_line_cut_and_glued_costs_itself_only():
    lines = [candump_line(m) for m in VOYAGE]
    for cut in range(1, len(lines[50])):
        text = b"".join([*lines[:50], lines[50][:cut], *lines[51:]])
        log = log_of(READER["candump"], text)
        intact = 402 if cut == len(lines[50]) - 1 else 401
        assert len(identity(transport("candump", text))) == intact, lines[50][:cut]
        found = [f for f in log.findings if f.kind in ("damaged", "truncated")]
        if intact == 401:
            assert [(f.offset, f.length) for f in found] == [(len(b"".join(lines[:50])), cut)]


def test_truncation_at_every_byte_keeps_every_whole_line():
    text = SAMPLES["candump"][:3000]
    for cut in range(len(text)):
        whole = text[:cut].count(b"\n")
        more = cut < len(text) and text[cut : cut + 1] == b"\n"
        assert len(transport("candump", text[:cut])) == whole + more, text[:cut][-60:]


@pytest.mark.parametrize("name", ["candump", "asc", "trc", "can-csv", "ydraw", "actisense"])
def test_junk_between_lines_costs_nothing(name):
    rng = random.Random(name)
    lines = SAMPLES[name].splitlines(keepends=True)
    whole = log_of(READER[name], SAMPLES[name])
    for _ in range(20):
        at = rng.randrange(30, len(lines))
        junk = bytes(rng.choice(b"\x00\x01\xfe~<>|{}xyz") for _ in range(rng.randrange(1, 40))) + b"\n"
        text = b"".join([*lines[:at], junk, *lines[at:]])
        log = log_of(READER[name], text)
        assert log.messages == whole.messages
        offset = sum(map(len, lines[:at]))
        found = [f for f in log.findings if f.kind in ("damaged", "truncated")]
        assert found and all(offset <= f.offset < offset + len(junk) for f in found)
        assert log.bytes_damaged == sum(f.length for f in found)


def test_damage_inside_lines_loses_only_those_lines():
    rng = random.Random(4)
    lines = [candump_line(m) for m in VOYAGE]
    spoilt = set(rng.sample(range(len(lines)), 40))
    for i in spoilt:
        at = rng.randrange(len(lines[i]) - 1)
        lines[i] = lines[i][:at] + b"\x80" + lines[i][at + 1 :]
    frames = transport("candump", b"".join(lines))
    assert identity(frames) == expected([m for i, m in enumerate(VOYAGE) if i not in spoilt])


def test_a_damaged_stamp_does_not_move_the_clock():
    messages = voyage(3)
    messages[70].timestamp += 4e8
    messages[100].timestamp -= 3e7
    log = log_of(READER["candump"], candump(messages))
    assert log.duration_s < 3.1
    assert [f.count for f in log.findings if f.kind == "clock" and "contradict" in f.message] == [2]


def test_a_restart_of_the_clock_is_continued_and_said():
    first, second = voyage(3), voyage(3, start=START_S - 1000)
    log = log_of(READER["candump"], candump(first + second))
    assert len(log.tables["rudder"]) == 60
    assert 5.7 < log.duration_s < 6.1
    assert any(f.kind == "clock" and "went back" in f.message for f in log.findings)


def test_half_a_blf_gives_its_half_and_says_so():
    data = written(voyage(300), ".blf")
    whole, half = transport("blf", data), transport("blf", data[: len(data) // 2])
    assert 0.3 * len(whole) < len(half) < 0.7 * len(whole)
    assert identity(half) == identity(whole)[: len(half)]
    log = log_of(READER["blf"], data[: len(data) // 2])
    assert any(f.kind == "truncated" for f in log.findings)


def test_a_spoilt_blf_container_costs_itself_only():
    data = bytearray(written(voyage(300), ".blf"))
    whole = transport("blf", bytes(data))
    at = data.index(b"LOBJ", data.index(b"LOBJ") + 4) + 4000
    data[at : at + 8] = b"\xaa" * 8
    frames = transport("blf", bytes(data))
    assert len(whole) - 3500 < len(frames) < len(whole)
    assert identity(frames)[-2000:] == identity(whole)[-2000:]


@pytest.mark.parametrize("name", ["asc", "trc", "can-csv", "ydraw", "actisense"])
def test_pieces_of_a_file_make_the_same_log(name, monkeypatch):
    whole = log_of(READER[name], SAMPLES[name])
    monkeypatch.setattr("ingest.canbus.lines.CHUNK", 700)
    pieces = log_of(READER[name], SAMPLES[name])
    assert whole.findings == pieces.findings
    assert all(table.equals(pieces.tables[topic]) for topic, table in whole.tables.items())


@pytest.mark.parametrize(
    "filler", [b"7", b" ", b"(", b"(1.0) ", b"a", b"ff,", b"LOBJ", b"#", b"1 ", b"0123456789 "]
)
def test_no_filler_takes_long(filler):
    noise = (filler * (1 << 19))[: 1 << 19]
    begin = time.process_time()
    for name in SAMPLES:
        if name != "actisense":
            transport(name, noise)
    assert time.process_time() - begin < 20.0


@given(st.lists(st.sampled_from(list(SAMPLES)), min_size=1, max_size=2), st.randoms())
@settings(max_examples=40, deadline=None)
def test_spliced_and_shuffled_logs_are_read(names, rng):
    text = b"".join(SAMPLES[n][rng.randrange(2000) : 2000 + rng.randrange(2000)] for n in names)
    for reader in READERS:
        if reader.name != "mf4":
            log = log_of(reader, text)
            if log is not None and log.tables:
                check_log(log, len(text))


@given(st.binary(max_size=400))
@settings(max_examples=60, deadline=None)
def test_nothing_makes_a_reader_raise(noise):
    for reader in READERS:
        if reader.name != "mf4":
            assert 0 <= reader.sniff(noise) <= 1
            log_of(reader, noise)


# --- NMEA 2000 -----------------------------------------------------------------------------------------


def frames_of(messages: list[can.Message]) -> Frames:
    return transport("candump", candump(messages))


def peer_value(field) -> object:
    """A field's value as the peer has it: NaN where it has none, codes of lookups, raw times."""
    kind = field.type.name
    if kind in ("LOOKUP", "INDIRECT_LOOKUP", "BITLOOKUP"):
        return field.raw_value
    if kind.startswith("STRING"):
        return field.value or ""
    return np.nan if field.value is None else field.raw_value


def differences(table, row, peer) -> list[tuple[str, object, object]]:
    """Fields in which a row is not what the peer decoded."""
    out = []
    for field in peer.fields:
        name = "source_" if field.id == "source" else field.id
        if name not in table.columns or isinstance(field.value, list):
            continue
        ours, theirs = table[name].iloc[row], peer_value(field)
        missing_code = isinstance(ours, float) and ours != ours and field.value is None
        same = ours == theirs or (ours != ours and (theirs is None or theirs != theirs)) or missing_code
        if not same and field.type.name not in ("PGN", "FLOAT"):
            out.append((field.id, ours, theirs))
    return out


PGNS = sorted({p.pgn for p in backend.DATABASE.pgns()})
WIDE_UNSIGNED = {130833}  # the peer reads 64-bit unsigned integers as signed


def random_payload(rng: random.Random, info) -> bytes:
    """Random bits, with missing-value codes here and there, and the codes that make it this variant."""
    placed = [f for f in info.fields if f.bit_offset is not None and f.bit_length]
    size = min(max(((f.bit_offset + f.bit_length + 7) // 8 for f in placed), default=8), 223)
    number = rng.getrandbits(8 * size)
    for f in placed:
        mask = ((1 << f.bit_length) - 1) << f.bit_offset
        if rng.random() < 0.25:
            top = rng.choice([0, 1, 2, 3])
            number = number & ~mask | (
                (((1 << f.bit_length - rng.randrange(2)) - 1 - top) << f.bit_offset) & mask
            )
    try:
        empty = int.from_bytes(backend.DATABASE.encode(info.id, {}), "little")
    except canboat.EncodeError:
        return (number & (1 << 8 * size) - 1).to_bytes(size, "little")
    for bit, bits in telling_places(info.pgn):
        mask = ((1 << bits) - 1) << bit
        number = number & ~mask | empty & mask
    return (number & (1 << 8 * size) - 1).to_bytes(size, "little")


def test_every_pgn_of_the_database_decodes_as_the_peer_decodes_it():
    rng = random.Random(7)
    compared = 0
    for pgn in PGNS:
        payloads = [
            random_payload(rng, info) for info in backend.DATABASE.pgn_variants(pgn) for _ in range(3)
        ]
        width = max(map(len, payloads))
        block = np.frombuffer(b"".join(p.ljust(width, b"\0") for p in payloads), np.uint8).reshape(-1, width)
        count = len(payloads)
        sizes = np.array([len(p) for p in payloads])
        packets = Packets(np.arange(count), np.zeros(count, np.uint8), sizes, block)
        rows = {}
        for name, part in n2k.by_variant(pgn, packets):
            table = n2k.table_of(layout(pgn, name, n2k.sample_of(part)), part)
            rows |= {int(i): (name, table, k) for k, i in enumerate(part.time_ns)}
        for i, payload in enumerate(payloads):
            peer = backend.decode(pgn, payload)
            assert (peer is None) == (i not in rows), (pgn, payload.hex())
            if peer is not None and pgn not in WIDE_UNSIGNED:
                name, table, k = rows[i]
                assert name == peer.id
                assert differences(table, k, peer) == [], (name, payload.hex())
                compared += len(peer.fields)
    assert compared > 8000


def test_values_that_the_peer_encodes():
    log = log_of(READER["candump"], SAMPLES["candump"])
    assert log.tables["vesselHeading"]["heading"].to_numpy() == pytest.approx(1.0 + 0.001 * np.arange(60))
    assert log.tables["rudder"]["position"].to_numpy() == pytest.approx(
        0.3 * np.sin(0.1 * np.arange(60)), abs=1e-4
    )
    gnss = log.tables["gnssPositionData"]
    assert gnss["latitude"].to_numpy() == pytest.approx(52.0 + 1e-4 * np.arange(6))
    assert gnss["time"].to_numpy() == pytest.approx(START_S % 86400 + np.arange(6))
    assert set(log.tables["windData"][n2k.SOURCE]) == {40}
    assert log.units["rudder", "position"] == "rad"
    assert log.tables["vesselHeading"]["variation"].isna().all()


def test_fields_beyond_a_short_payload_are_missing():
    log = log_of(READER["candump"], b"(1.0) can0 09F11201#0010270102\n(2.0) can0 09F11201#0010270102\n")
    heading = log.tables["vesselHeading"]
    assert heading["heading"].tolist() == [1.0, 1.0]
    assert heading["variation"].isna().all() and heading["reference"].isna().all()


def test_fast_packets_of_interleaved_senders():
    a = message(START_S, "gnssPositionData", {"latitude": 1.0}, 1, sequence=3)
    b = message(START_S, "gnssPositionData", {"latitude": 2.0}, 2, sequence=3)
    c = message(START_S, "gnssPositionData", {"latitude": 3.0}, 1, sequence=4)
    mixed = [m for trio in zip(a, b, c, strict=True) for m in trio]
    packets, lost = assemble(frames_of(mixed))
    assert (len(packets), lost) == (3, 0)
    assert packets.source.tolist() == [1, 2, 1]
    assert set(packets.length.tolist()) == {43}


@pytest.mark.parametrize("missing", range(7))
def test_a_lost_frame_loses_its_packet_only_and_is_counted(missing):
    packets = [
        message(START_S + k, "gnssPositionData", {"latitude": float(k)}, 1, sequence=k % 8) for k in range(20)
    ]
    assert len(packets[9]) == 7
    del packets[9][missing]
    text = candump([m for p in packets for m in p])
    table = log_of(READER["candump"], text).tables["gnssPositionData"]
    assert table["latitude"].to_numpy() == pytest.approx([k for k in range(20) if k != 9])
    assert [f.count for f in log_of(READER["candump"], text).findings if "frame missing" in f.message] == [1]


def test_two_torn_packets_do_not_make_one():
    a = message(START_S, "gnssPositionData", {"latitude": 1.0}, 1, sequence=5)
    b = message(START_S + 0.1, "gnssPositionData", {"latitude": 2.0}, 1, sequence=5)
    packets, lost = assemble(frames_of([*a[:3], *a[4:], *b[1:]]))
    assert (len(packets), lost) == (0, 1)
    late = message(START_S + 8.0, "gnssPositionData", {"latitude": 2.0}, 1, sequence=5)
    packets, lost = assemble(frames_of([*a[:4], *late[4:]]))
    assert (len(packets), lost) == (0, 2)


def test_a_frame_that_looks_like_a_blf_object():
    frames = [frame(START_S + 0.01 * k, 0x09F11201, b"LOBJ\x20\0\1\0") for k in range(5)]
    assert identity(transport("blf", written(frames, ".blf"))) == expected(frames)


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 7)), min_size=1, max_size=30), st.randoms())
@settings(max_examples=60, deadline=None)
def test_fast_packets_agree_with_the_peer(plan, rng):
    streams = defaultdict(list)
    for k, (source, sequence) in enumerate(plan):
        payload = {"latitude": float(k), "numberOfSvs": k}
        streams[source] += message(START_S + k, "gnssPositionData", payload, source, sequence=sequence)
    frames = []
    while any(streams.values()):
        queue = streams[rng.choice([s for s in streams if streams[s]])]
        frames.append(queue.pop(0))
    for k, m in enumerate(frames):
        m.timestamp = round(START_S + 1e-3 * k, 6)
    peer = canboat.Reassembler()
    theirs = [peer.push(129029, bytes(m.data), m.arbitration_id & 255) for m in frames]
    ours, lost = assemble(frames_of(frames))
    whole = sorted(bytes(p[:n]) for p, n in zip(ours.payload, ours.length, strict=True))
    assert whole == sorted(t for t in theirs if t is not None)
    assert lost == 0


def test_repeated_fields_become_numbered_columns():
    sets = [{"prn": 5, "elevation": 0.5, "snr": 40.0}, {"prn": 9, "elevation": 0.25, "snr": 30.0}]
    payload = bytes(backend.DATABASE.encode("gnssSatsInView", {}, sets=[sets]))
    can_id = canboat.can_id_compose(6, 129540, 7, 255)
    frames = [
        frame(1 + 1e-3 * k, can_id, bytes(p)) for k, p in enumerate(canboat.fast_packet_fragment(0, payload))
    ]
    table = log_of(READER["candump"], candump(frames)).tables["gnssSatsInView"]
    assert (table["prn[0]"].item(), table["prn[1]"].item()) == (5.0, 9.0)
    assert table["elevation[1]"].item() == pytest.approx(0.25)
    assert "prn[2]" not in table


def test_topics_by_number():
    log = log_of(READER["candump"], SAMPLES["candump"], options=ReadOptions(topics=frozenset({"127245"})))
    assert set(log.tables) == {"rudder"}


# --- time ----------------------------------------------------------------------------------------------


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


# --- other words of the formats ------------------------------------------------------------------------


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


def test_mf4(monkeypatch):
    data = written(VOYAGE[:60], ".mf4")
    assert READER["mf4"].sniff(data) > 0.9
    log = log_of(READER["mf4"], data)
    assert len(log.tables["vesselHeading"]) == sum(m.arbitration_id == 0x09F1120A for m in VOYAGE[:60])
    monkeypatch.setitem(sys.modules, "asammdf", None)
    with pytest.raises(ExtraMissing, match=r"seatrial\[mf4\]"):
        READER["mf4"].read(Path("x.mf4"), memoryview(data), ReadOptions())


# --- sources -------------------------------------------------------------------------------------------


def sources_of(messages: list[can.Message]) -> dict[str, list]:
    out = defaultdict(list)
    for source in log_of(READER["candump"], candump(messages)).sources:
        out[source.quantity].append(source)
    return out


def test_every_quantity_is_found():
    found = sources_of(VOYAGE)
    assert set(found) == {"heading", "yaw_rate", "position", "velocity", "rudder", "wind"}
    assert found["wind"][0].options["reference"] == "relative"
    assert [s.topic for s in found["position"]] == ["positionRapidUpdate", "gnssPositionData"]
    assert found["position"][1].options["hdop"] == "hdop"
    assert "magnetic" not in found["heading"][0].options


def test_devices_and_instances_are_told_apart():
    messages = []
    for i in range(40):
        t = START_S + 0.1 * i
        messages += message(t, "vesselHeading", {"heading": 1.0 + 0.01 * i, "reference": "Magnetic"}, 1)
        messages += message(t, "vesselHeading", {"heading": 1.1 + 0.01 * i, "reference": "True"}, 2)
        messages += message(t, "vesselHeading", {"heading": 1.2 + 0.01 * i}, 3)
        messages += message(t, "rudder", {"instance": 0, "position": -1.8326}, 4)
        messages += message(t, "rudder", {"instance": 0, "position": 0.01 * i}, 5)
        for engine, speed in (
            ("Single Engine or Dual Engine Port", 1500.0 + i),
            ("Dual Engine Starboard", 900.0 + i),
        ):
            messages += message(
                t, "engineParametersRapidUpdate", {"instance": engine, "speed": speed / 60.0}, 6
            )
    found = sources_of(messages)
    assert [(s.device, bool(s.options.get("magnetic"))) for s in found["heading"]] == [
        (2, False),
        (3, False),
        (1, True),
    ]
    assert [s.device for s in found["rudder"]] == [5, 4]
    assert found["rudder"][1].rank < found["rudder"][0].rank - 20
    assert [s.topic for s in found["propeller"]] == [f"engineParametersRapidUpdate[{k}]" for k in (0, 1)]
    log = log_of(READER["candump"], candump(messages))
    starboard = log.tables["engineParametersRapidUpdate[1]"]["speed"]
    assert starboard.to_numpy() == pytest.approx(900.0 + np.arange(40))
    assert len(log.tables["engineParametersRapidUpdate"]) == 80
    assert log.units["engineParametersRapidUpdate[1]", "speed"] == "rpm"
    assert found["propeller"][0].unit == "rpm"


# --- DBC -----------------------------------------------------------------------------------------------

DBC = """VERSION ""
NS_ :
BS_:
BU_: Node
BO_ 291 Engine: 8 Node
 SG_ Speed : 0|16@1+ (0.25,0) [0|16000] "rpm" Node
 SG_ Torque : 23|12@0- (0.1,-5) [-200|200] "Nm" Node
 SG_ Hot : 40|1@1+ (1,0) [0|1] "" Node
BO_ 292 Paged: 8 Node
 SG_ Page M : 0|8@1+ (1,0) [0|255] "" Node
 SG_ Oil m0 : 8|16@1- (0.01,0) [-300|300] "degC" Node
 SG_ Volt m1 : 8|16@1+ (0.001,0) [0|60] "V" Node
BO_ 2566834430 Thruster: 8 Node
 SG_ Force : 0|32@1- (1,0) [-1E9|1E9] "N" Node
SIG_VALTYPE_ 2566834430 Force : 1;
"""


def test_frames_that_no_table_holds_are_said():
    text = SAMPLES["candump"] + b"(1700000007.0) can0 123#0102\n"
    found = [f for f in log_of(READER["candump"], text).findings if f.kind == "unknown"]
    assert [(f.count, "11-bit" in f.message) for f in found] == [(1, True)]


def test_dbc_against_cantools(tmp_path):
    import cantools

    path = tmp_path / "boat.dbc"
    path.write_text(DBC)
    database = cantools.database.load_file(path)
    rng = random.Random(1)
    kinds = [(291, False), (292, False), (2566834430 & 0x1FFFFFFF, True)]
    frames = []
    for k in range(90):
        can_id, extended = kinds[k % 3]
        data = bytes([k % 2]) + rng.randbytes(7) if can_id == 292 else rng.randbytes(8)
        if extended:
            data = np.float32(rng.gauss(0, 100)).tobytes() + bytes(4)
        frames.append(frame(1 + 0.01 * k, can_id, data, extended=extended))
    log = log_of(READER["candump"], candump(frames), options=ReadOptions(dbc=path))
    assert set(log.tables) == {"Engine", "Paged", "Thruster"}
    assert log.units["Engine", "Speed"] == "rpm"
    for name, table in log.tables.items():
        known = database.get_message_by_name(name)
        sent = [m for m in frames if m.arbitration_id == known.frame_id]
        for row, m in enumerate(sent):
            peer = known.decode(m.data, decode_choices=False)
            for signal in known.signals:
                ours = table[signal.name].iloc[row]
                assert ours == pytest.approx(peer[signal.name]) if signal.name in peer else np.isnan(ours)


def test_dbc_by_pgn_and_beside_nmea_2000(tmp_path):
    path = tmp_path / "boat.dbc"
    path.write_text(DBC.replace("2566834430", str(0x80000000 | 0x1CFF4FFE)))
    frames = [
        *VOYAGE,
        *(frame(START_S + k, 0x1CFF4F05, np.float32(k).tobytes() + bytes(4)) for k in range(5)),
    ]
    log = log_of(
        READER["candump"], candump(sorted(frames, key=lambda m: m.timestamp)), options=ReadOptions(dbc=path)
    )
    assert log.tables["Thruster"]["Force"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert set(log.tables["Thruster"]["source"]) == {5}
    assert len(log.tables["rudder"]) == 60


def test_dbc_messages_of_several_senders_and_buses(tmp_path):
    path = tmp_path / "boat.dbc"
    path.write_text(DBC.replace("Speed", "EngineSpeed"))
    exact, other = 2566834430 & 0x1FFFFFFF, (2566834430 & 0x1FFFFF00) | 5
    frames = [frame(k, (exact, other)[k % 2], np.float32(k).tobytes() + bytes(4)) for k in range(10)]
    engines = b"".join(b"(%d.5) can%d 123#%02X01000000000000\n" % (k, k % 2, k) for k in range(10))
    log = log_of(READER["candump"], candump(frames) + engines, options=ReadOptions(dbc=path))
    table = log.tables["Thruster"]
    assert table["Force"].tolist() == list(range(10))
    assert table["source"].tolist() == [exact & 255, 5] * 5
    engine = log.tables["Engine"]
    assert engine.loc[engine["source"] == 1, "EngineSpeed"].tolist() == [
        (256 + k) / 4 for k in range(1, 10, 2)
    ]
    assert any("can1 is source 1" in f.message and f.topic == "Engine" for f in log.findings)
    found = {(s.quantity, s.topic, s.device, s.unit) for s in log.sources}
    assert {("propeller", "Engine", k, "rpm") for k in (0, 1)} <= found


def test_a_dbc_file_that_is_none(tmp_path):
    bad = tmp_path / "bad.dbc"
    bad.write_text("this is no database {")
    for path in (bad, tmp_path / "absent.dbc"):
        with pytest.raises(UsageError, match=r"\[can\] dbc"):
            log_of(READER["candump"], SAMPLES["candump"], options=ReadOptions(dbc=path))


def test_frames_of_an_unknown_protocol_ask_for_a_dbc_file():
    text = b"(1.0) can0 123#0102030405060708\n" * 5
    with pytest.raises(ValueError, match="dbc"):
        READER["candump"].read(Path("x.log"), memoryview(text), ReadOptions())


# --- measured logs -------------------------------------------------------------------------------------

real = [
    pytest.mark.real,
    pytest.mark.skipif(not FORMATS.is_dir(), reason=f"no measured logs in {FORMATS}"),
]


def peer_frames(path: Path, folder: Path) -> list[can.Message]:
    """Frames as python-can reads them; it dies of comment lines, so these are left out."""
    if path.suffix == ".asc":
        return list(can.ASCReader(path, relative_timestamp=True))
    if path.suffix == ".log":
        clean = folder / path.name
        lines = path.read_text().splitlines(keepends=True)
        clean.write_text("".join(line for line in lines if line.startswith("(")))
        path = clean
    return list(can.LogReader(path))


class TestMeasured:
    pytestmark = real

    @pytest.mark.parametrize(
        "name",
        ["n2k_candump.log", "n2k_candumpSample3.asc", "n2k_candumpSample3.csv", "n2k_pcan.trc",
         "n2k_furuno_figure8_singleframe.blf"],
    )  # fmt: skip
    def test_frames_and_fields_are_the_peers(self, name, tmp_path):
        theirs = peer_frames(FORMATS / name, tmp_path)
        log = read_log(FORMATS / name)
        frames = transport(log.format, (FORMATS / name).read_bytes())
        assert identity(frames) == expected(theirs)
        seconds = np.array([m.timestamp for m in theirs])
        ours = (frames.time_ns - frames.time_ns[0]) * 1e-9
        assert np.abs(ours - (seconds - seconds[0])).max() < 1e-6
        assert log.bytes_damaged == 0
        self.compare(log, self.decoded(theirs))

    def test_actisense_figure_of_eight(self):
        path = FORMATS / "n2k_actisense_figure8.raw"
        decoded = defaultdict(list)
        for line in path.read_text().splitlines()[1:]:
            _, priority, pgn, source, destination, _, *data = line.split(",")
            peer = backend.decode(
                int(pgn), bytes.fromhex("".join(data)), int(source), int(destination), int(priority)
            )
            decoded[peer.id, int(source)].append(peer)
        self.compare(read_log(path), decoded)

    def decoded(self, frames: list[can.Message]) -> dict[tuple[str, int], list]:
        """What nmea2000 decodes, by table and sender."""
        peer, out = canboat.Reassembler(), defaultdict(list)
        for m in frames:
            priority, pgn, source, destination = canboat.can_id_decompose(m.arbitration_id)
            fast, payload = backend.is_fast_pgn(pgn), bytes(m.data)
            if fast is None:
                continue
            try:
                payload = peer.push(pgn, payload, source, destination, priority) if fast else payload
            except canboat.ReassemblyError:
                continue
            found = None if payload is None else backend.decode(pgn, payload, source, destination, priority)
            if found is not None:
                name = f"pgn{pgn}" if found.id.startswith("0x") else found.id
                out[name, source].append(found)
        return out

    def compare(self, log, decoded) -> None:
        assert {t for t, _ in decoded} == set(log.tables)
        for (topic, source), peers in decoded.items():
            rows = log.tables[topic][log.tables[topic][n2k.SOURCE] == source]
            assert len(rows) == len(peers), topic
            step = max(len(peers) // 60, 1)
            for k in range(0, len(peers), step):
                assert differences(rows, k, peers[k]) == [], (topic, source, k)

    def test_the_same_log_in_three_formats_gives_the_same_values(self):
        logs = [
            read_log(FORMATS / f"n2k_{n}")
            for n in ("candump.log", "candumpSample3.asc", "candumpSample3.csv")
        ]
        for topic, table in logs[0].tables.items():
            for other in logs[1:]:
                assert table.reset_index(drop=True).equals(other.tables[topic].reset_index(drop=True))
        assert logs[0].utc_ns == logs[2].utc_ns == 1502984866421964000
        assert logs[1].utc_ns is None

    def test_a_stuck_rudder_ranks_low(self):
        rudder = next(s for s in read_log(FORMATS / "n2k_pcan.trc").sources if s.quantity == "rudder")
        assert rudder.rank < 30
