"""NMEA 2000: every PGN as nmea2000 decodes it, fast packets, and the quantities found in it."""

import random
from collections import defaultdict

import can
import numpy as np
import pytest
from can_peer import differences
from can_samples import (
    READER,
    SAMPLES,
    START_S,
    VOYAGE,
    candump,
    frame,
    frames_of,
    message,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from nmea2000 import _canboat as canboat
from nmea2000 import backend
from reader_checks import log_of

from ingest.canbus import n2k
from ingest.canbus.fastpacket import assemble
from ingest.canbus.frames import Packets
from ingest.canbus.layout import layout, telling_places
from ingest.errors import MissingSignal
from ingest.reader import ReadOptions
from preprocess.resolve import choose_source
from preprocess.vessel import Sensor

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
    for engine in (0, 1):
        chosen = choose_source(log, "propeller", Sensor("propeller", source=engine), "inputs.n")
        assert chosen.topic == f"engineParametersRapidUpdate[{engine}]"
    with pytest.raises(MissingSignal, match=r"inputs\.n\.source"):
        choose_source(log, "propeller", Sensor("propeller", source=7), "inputs.n")
