"""Bytes of ports: which protocol they are, and their decoders, however they are cut."""

from __future__ import annotations

from multiprocessing import Pipe
from time import thread_time

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.serial_line import block_of, mixed_record, nmea, nmea_record
from seatrial.capture.can_adapter import SlcanDecoder
from seatrial.capture.decoder_process import Inbox
from seatrial.capture.decoders import SerialDecoder, decoder_for
from seatrial.capture.detection import detect, suspicion
from seatrial.capture.imu_text import ImuDecoder
from seatrial.capture.live_decoding import PortDecoder
from seatrial.capture.piece_buffer import PieceBuffer
from seatrial.capture.settings import PortSettings, Protocol

SECOND = 1_000_000_000
LINES_OF_NUMBERS = [
    b"1,2,3\r\n",
    b"12.3 -1.0 0.4\n",
    b"yaw : 12.3 pitch:-1.0 roll:0.4\r\n",
    b"#YPR=12.3,-1.0,0.4\r\n",
    b"!ANG:1.2,  3.4 ; 5.6\r\n",
    b"IMU 1e3\t2;3;\r\n",
    b" 1, 2 , 3 ,\n",
]


@pytest.mark.parametrize("name", ["nmea", "ubx", "mavlink", "imu", "slcan"])
@pytest.mark.parametrize("junk", [b"", b"\x00\xff\x13garbage$GP", b"\xb5\x62\x01"])
def test_a_protocol_is_told_from_its_bytes(name, junk):
    assert detect(junk + block_of(name, 800)[7:]) == Protocol[name]


def test_slcan_is_told_and_its_packets_survive_the_cuts():
    heading = b"T09F112248FF102700000000FC\r"
    fast = [b"T0DF805248%02X%s\r" % (0x40 + k, b"2B" + b"00" * 6 if k == 0 else b"01" * 7) for k in range(7)]
    data = heading * 3 + b"".join(fast) + heading
    assert detect(data) == Protocol.slcan
    whole = SlcanDecoder().feed([(SECOND, data)])
    cut = SlcanDecoder()
    parts = [cut.feed([(SECOND + i, data[i : i + 17])]) for i in range(0, len(data), 17)]
    assert whole.messages == sum(p.messages for p in parts) == 11
    assert set(whole.tables) == {t for p in parts for t in p.tables} >= {"vesselHeading"}
    for topic, table in whole.tables.items():
        pieces = pd.concat([p.tables[topic] for p in parts if topic in p.tables])
        assert len(pieces) == len(table)
        pd.testing.assert_frame_equal(
            pieces.reset_index(drop=True), table.reset_index(drop=True), check_dtype=False
        )


def test_both_versions_of_mavlink_are_decoded():
    from pymavlink.dialects.v10 import common

    sender = common.MAVLink(None, srcSystem=1, srcComponent=1)
    old = b"".join(
        bytes(common.MAVLink_attitude_message(20 * i, 0.0, 0.0, 0.01 * i, 0.0, 0.0, 0.05).pack(sender))
        for i in range(20)
    )
    data = old + block_of("mavlink", 1500)
    assert old[0] == 0xFE and data[len(old)] == 0xFD
    assert detect(old) == detect(data) == Protocol.mavlink
    found = decoder_for("mavlink").feed([(SECOND, data)])
    newer = decoder_for("mavlink").feed([(SECOND, data[len(old) :])])
    assert len(found.tables["ATTITUDE"]) == 20 + len(newer.tables["ATTITUDE"])
    assert found.damaged == 0


def test_corrections_between_sentences_and_binary_messages_are_passed_over():
    body = bytes([0xD3, 0, 19]) + bytes(range(19))
    crc = 0
    for byte in body:
        crc ^= byte << 16
        for _ in range(8):
            crc = crc << 1 ^ (0x1864CFB if crc & 0x800000 else 0)
    frame = body + (crc & 0xFFFFFF).to_bytes(3, "big")
    records = [mixed_record(i) for i in range(12)]
    data = b"".join(r + frame for r in records)
    assert detect(data) in (Protocol.nmea, Protocol.ubx)
    decoder, tables = SerialDecoder(), {}
    for i in range(0, len(data), 61):
        found = decoder.feed([(SECOND + i, data[i : i + 61])])
        assert found.damaged == 0
        for topic, table in found.tables.items():
            tables[topic] = tables.get(topic, 0) + len(table)
    assert (tables["GGA"], tables["NAV-PVT"], tables["HDT"]) == (12, 12, 12)


STAMPS = [
    "2024-05-01T12:00:00.123Z ",
    "1714564800.123456 ",
    "[12:00:01] ",
    "1714564800123,",
    "2024-05-01 12:00:00.123456 +0000 UTC received on /dev/ttyUSB0: ",
]


@pytest.mark.parametrize("stamp", STAMPS)
def test_sentences_with_a_stamp_before_each_are_told(stamp):
    data = b"".join(stamp.encode() + line for line in block_of("nmea", 3000).splitlines(keepends=True))
    assert detect(data) == Protocol.nmea
    assert decoder_for("nmea").feed([(SECOND, data)]).damaged == 0


@pytest.mark.parametrize("line", LINES_OF_NUMBERS)
def test_lines_of_numbers_are_told_and_read(line):
    data = line * 6
    assert detect(data) == Protocol.imu
    (table,) = ImuDecoder().feed([(SECOND, data)]).tables.values()
    assert table.shape == (6, 3)


ENDLESS = [b"1", b" ", b"\t", b"1 ", b"1    ", b"1.1,", b"a", b"a:1 ", b"1e1", b"$", b"\x01", b"\x01    "]


@pytest.mark.parametrize("piece", ENDLESS)
@pytest.mark.parametrize("begins", [b"", b"#", b"1,2,3"])
@pytest.mark.parametrize("ends", [b"", b"x\r\n", b" $x\r\n"])
def test_bytes_of_no_protocol_are_soon_known_for_that(piece, begins, ends):
    size = 16_384
    data = begins + (piece * size)[:size] + ends
    detect(b"$x\r\n")  # compiles
    began = thread_time()
    detect(data)
    ImuDecoder().feed([(SECOND, data)])
    assert thread_time() - began < 0.5


def test_no_protocol_in_noise_and_the_line_rate_is_doubted():
    noise = np.random.default_rng(2).integers(0, 256, 4000, np.uint8).tobytes()
    assert detect(noise) is None and detect(b"") is None
    assert "9600" in suspicion(noise, 9600)
    assert suspicion(noise[:100], 9600) is None
    assert "text" in suspicion(b"hello world this is a console\r\n" * 40, 9600)


@pytest.mark.parametrize("name", ["nmea", "ubx", "mavlink", "imu", "mixed", "slcan"])
def test_pieces_give_what_the_whole_gives(name):
    data = block_of(name, 3000)
    protocol = "nmea" if name == "mixed" else name
    whole = decoder_for(protocol).feed([(SECOND, data)])
    cut, tables, count = decoder_for(protocol), {}, 0
    for i in range(0, len(data), 37):
        found = cut.feed([(SECOND + i, data[i : i + 37])])
        count += found.messages
        assert found.damaged == 0
        for topic, table in found.tables.items():
            tables.setdefault(topic, []).append(table)
    assert count == whole.messages > 0
    assert {t: sum(map(len, p)) for t, p in tables.items()} == {t: len(x) for t, x in whole.tables.items()}
    for parts in tables.values():
        times = np.concatenate([p.index.to_numpy() for p in parts])
        assert (np.diff(times) >= 0).all() and times[-1] <= SECOND + len(data)


@given(cuts=st.lists(st.integers(1, 400), min_size=1, max_size=12), junk=st.binary(max_size=60))
@settings(max_examples=25, deadline=None)
def test_good_records_around_junk_are_decoded_however_it_is_cut(cuts, junk):
    record = nmea("HEHDT,123.4,T")
    data = record * 3 + junk + b"\r\n" + record * 3
    decoder, found, at = SerialDecoder(), 0, 0
    for size in [*cuts, len(data)]:
        if data[at : at + size]:
            tables = decoder.feed([(SECOND + at, data[at : at + size])]).tables
            found += len(tables.get("HDT", ()))
        at += size
    assert found == 6


@given(st.lists(st.binary(min_size=1, max_size=9), min_size=1, max_size=20), st.integers(0, 60))
@settings(max_examples=50, deadline=None)
def test_a_byte_keeps_its_time(pieces, drop):
    buffer, times = PieceBuffer(), []
    for i, data in enumerate(pieces):
        buffer.add([(i, data)])
        times += [i] * len(data)
    buffer.drop(drop := min(drop, len(times)))
    assert buffer.data == b"".join(pieces)[drop:]
    if buffer.data:
        ends = np.arange(1, len(buffer.data) + 1)
        assert buffer.times(ends).tolist() == times[drop:]


@pytest.mark.parametrize(
    ("line", "topic", "columns"),
    [
        (b"#YPR=12.5,-1.0,0.25\r\n", "YPR", {"value[0]": 12.5, "value[1]": -1.0, "value[2]": 0.25}),
        (b"!ANG:1.5,2.5,3.5\n", "ANG", {"value[0]": 1.5, "value[1]": 2.5, "value[2]": 3.5}),
        (b"1.0, 2.0; -3e-2\n", "IMU", {"value[0]": 1.0, "value[1]": 2.0, "value[2]": -0.03}),
        (b"yaw:12.5 pitch: -1.0 roll=0.25\n", "IMU", {"yaw": 12.5, "pitch": -1.0, "roll": 0.25}),
    ],
)
def test_text_of_inertial_sensors(line, topic, columns):
    found = ImuDecoder().feed([(SECOND, b"# started\n" + line * 2 + line[:4])])
    assert found.tables[topic].to_dict("records") == [columns] * 2
    assert found.damaged == len(b"# started\n")


def test_the_wrong_line_rate_is_doubted_once_and_again_after_good_records():
    decoder = PortDecoder(PortSettings("/dev/a", 9600, Protocol.nmea, "a"))
    noise = np.random.default_rng(2).integers(128, 256, 2048, np.uint8).tobytes()
    remarks = [r for i in range(6) for r in decoder.feed([(SECOND + i, noise)]).remarks]
    assert len(remarks) == 1 and "9600" in remarks[0]
    assert decoder.feed([(2 * SECOND, block_of("nmea", 500))]).remarks == ["good records again"]


def test_all_that_came_before_the_protocol_was_known_is_decoded():
    decoder = PortDecoder(PortSettings("/dev/a", 115200, Protocol.auto, "a"))
    data = block_of("nmea", 200_000)
    noise = np.random.default_rng(2).integers(128, 256, 20_000, np.uint8).tobytes()
    assert decoder.feed([(SECOND, noise)]).protocol is None
    found = decoder.feed([(SECOND + i, data[i : i + 997]) for i in range(0, len(data), 997)])
    assert found.protocol == Protocol.nmea
    assert found.records == data.count(b"$")
    assert sum(len(e.payloads) for e in found.messages) == found.records


def test_whoever_is_behind_gets_all_that_waits_at_once():
    here, there = Pipe()
    for k in range(5):
        here.send([(0, [(k, b"a")]), (k % 2, [(k, b"bc")])])
    here.send(None)
    ((count, batch),) = list(Inbox(there))
    assert count == 5
    assert {port: b"".join(d for _, d in pieces) for port, pieces in batch} == {0: b"abcaabcaabc", 1: b"bcbc"}


def test_what_a_port_sends_is_recognised_over_many_batches():
    decoder, seen = SerialDecoder(), []
    for i in range(40):
        for k, sentence in enumerate(nmea_record(i).splitlines(keepends=True)):
            found = decoder.feed([(SECOND + i * SECOND // 10 + k, sentence)])
            seen.append((found.settled, {s.quantity for s in found.sources}))
    assert seen[0] == (False, set()) and seen[3] == (False, set())
    assert all(q >= {"position", "heading", "yaw_rate", "rudder"} for _, q in seen[12:])
    assert seen[-1][0]
    (position,) = [s for s in decoder.feed([(6 * SECOND, nmea_record(40))]).sources if s.topic == "GGA"]
    assert position.rank > 60.0


def test_a_receiver_that_has_no_fix_yet_is_recognised_when_it_has_one():
    decoder, without, found = SerialDecoder(), nmea("GPGGA,100000.00,,,,,0,00,,,M,,M,,"), set()
    for i in range(30):
        found |= {s.quantity for s in decoder.feed([(SECOND + i * SECOND // 5, without)]).sources}
    assert not found
    for i in range(30, 40):
        fix = nmea_record(i).splitlines(keepends=True)[0]
        found |= {s.quantity for s in decoder.feed([(SECOND + i * SECOND // 5, fix)]).sources}
    assert found == {"position"}
