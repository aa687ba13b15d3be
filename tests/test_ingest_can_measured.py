"""Measured CAN logs against python-can and nmea2000."""

from collections import defaultdict
from pathlib import Path

import can
import numpy as np
import pytest
from can_peer import differences
from can_samples import expected, identity, transport
from nmea2000 import _canboat as canboat
from nmea2000 import backend

from ingest import read_log
from ingest.canbus import n2k

FORMATS = Path(__file__).parents[2] / "shared" / "data" / "formats"
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
