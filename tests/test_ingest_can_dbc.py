"""Frames by a DBC file, against cantools."""

import random
from pathlib import Path

import numpy as np
import pytest
from can_samples import (
    READER,
    SAMPLES,
    START_S,
    VOYAGE,
    candump,
    frame,
)
from reader_checks import log_of

from ingest.errors import UsageError
from ingest.reader import ReadOptions

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


def test_the_node_of_a_message_is_its_sender_where_the_file_names_one(tmp_path):
    path = tmp_path / "boat.dbc"
    path.write_text(DBC.replace("BO_ 292 Paged: 8 Node", "BO_ 292 Paged: 8 Vector__XXX"))
    frames = b"".join(
        b"(%d.0) can0 %s#0100000000000000\n" % (k, i) for k in range(5) for i in (b"123", b"124")
    )
    log = log_of(READER["candump"], frames, options=ReadOptions(dbc=path))
    assert set(log.tables) == {"Engine", "Paged"} and log.senders == {"Engine": "Node"}


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


def test_what_is_said_of_a_file_that_is_no_dbc_can_be_printed(tmp_path):
    bad = tmp_path / "bad.dbc"
    bad.write_bytes(b"VERSION \x1b[31m" + bytes(range(256)) * 9)
    with pytest.raises(UsageError) as caught:
        log_of(READER["candump"], SAMPLES["candump"], options=ReadOptions(dbc=bad))
    said = str(caught.value).removeprefix(f"[can] dbc: {bad}")
    assert len(said) < 150
    assert said.isprintable()


def test_frames_of_an_unknown_protocol_ask_for_a_dbc_file():
    text = b"(1.0) can0 123#0102030405060708\n" * 5
    with pytest.raises(ValueError, match="dbc"):
        READER["candump"].read(Path("x.log"), memoryview(text), ReadOptions())
