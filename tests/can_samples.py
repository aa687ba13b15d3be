"""CAN logs for tests: messages that the peers encode, written by python-can or in a format's words."""

import io
import logging
import math
import sys
import tempfile
from pathlib import Path

import can
from nmea2000 import _canboat as canboat
from nmea2000 import backend

from ingest.canbus import READERS
from ingest.canbus.frames import Frames

START_S = 1_700_000_000.0


def message(time_s: float, name: str, fields: dict, source: int = 1, sequence: int = 0, priority: int = 2):
    """Frames of one NMEA 2000 message, as the package encodes and cuts it."""
    info = backend.DATABASE.pgn_info(name)
    payload = bytes(backend.DATABASE.encode(name, fields))
    parts = canboat.fast_packet_fragment(sequence, payload) if backend.is_fast_pgn(info.pgn) else [payload]
    can_id = canboat.can_id_compose(priority, info.pgn, source, 255)
    return [frame(time_s + 1e-4 * k, can_id, bytes(p)) for k, p in enumerate(parts)]


def frame(time_s: float, can_id: int, data: bytes, channel: str = "can0", extended: bool = True):
    return can.Message(
        timestamp=round(time_s, 6), arbitration_id=can_id, data=data, is_extended_id=extended, channel=channel
    )


def voyage(seconds: float = 6.0, start: float = START_S, rate: float = 10.0) -> list[can.Message]:
    """A short trip: heading, position, course, rudder, wind, engine; GNSS data as fast packets."""
    out = []
    for i in range(int(seconds * rate)):
        t = start + i / rate
        place = {"latitude": 52.0 + 1e-5 * i, "longitude": 4.0 - 2e-5 * i}
        out += message(t, "vesselHeading", {"heading": 1.0 + 0.001 * i, "reference": "True"}, 10)
        out += message(t + 0.001, "rateOfTurn", {"rate": 0.01 * ((i % 7) - 3)}, 10)
        out += message(t + 0.002, "positionRapidUpdate", place, 20)
        out += message(t + 0.003, "cogSogRapidUpdate", {"cogReference": "True", "cog": 1.0, "sog": 2.5}, 20)
        out += message(t + 0.004, "rudder", {"instance": 0, "position": 0.3 * math.sin(0.1 * i)}, 30)
        out += message(
            t + 0.005, "windData", {"windSpeed": 7.0, "windAngle": 0.5, "reference": "Apparent"}, 40
        )
        if i % int(rate) == 0:
            clock = {
                "date": int(t // 86400),
                "time": t % 86400,
                "gnssType": 0,
                "method": "GNSS fix",
                "numberOfSvs": 9,
            }
            out += message(t + 0.006, "gnssPositionData", {**clock, **place, "hdop": 0.9}, 20, sequence=i % 8)
    return out


def written(messages: list[can.Message], suffix: str, **options) -> bytes:
    """The log that python-can writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"log{suffix}"
        with can.Logger(str(path), **options) as log:
            for m in messages:
                log.on_message_received(m)
        return path.read_bytes()


def candump(messages: list[can.Message]) -> bytes:
    return b"".join(candump_line(m) for m in messages)


def candump_line(m: can.Message) -> bytes:
    width = 8 if m.is_extended_id else 3
    return f"({m.timestamp:.6f}) {m.channel} {m.arbitration_id:0{width}X}#{m.data.hex().upper()}\n".encode()


def console(messages: list[can.Message], stamp=lambda t: f" ({t:.6f})") -> bytes:
    out = io.StringIO()
    for m in messages:
        data = " ".join(f"{b:02X}" for b in m.data)
        width = 8 if m.is_extended_id else 3
        out.write(
            f"{stamp(m.timestamp)}  {m.channel}  {m.arbitration_id:0{width}X}   [{len(m.data)}]  {data}\n"
        )
    return out.getvalue().encode()


def yacht_devices(messages: list[can.Message]) -> bytes:
    lines = []
    for m in messages:
        ms = round(m.timestamp * 1000) % 86_400_000
        stamp = f"{ms // 3_600_000:02}:{ms // 60_000 % 60:02}:{ms // 1000 % 60:02}.{ms % 1000:03}"
        lines.append(f"{stamp} R {m.arbitration_id:08X} {' '.join(f'{b:02X}' for b in m.data)}\r\n")
    return "".join(lines).encode()


logging.getLogger("nmea2000").setLevel(logging.CRITICAL)
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


def frames_of(messages: list[can.Message]) -> Frames:
    return transport("candump", candump(messages))
