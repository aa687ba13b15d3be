"""candump against python-can, to frames and (with nmea2000) to columns; nmea2000 encodes the payloads."""

from __future__ import annotations

import itertools
import logging
import math
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.ingest_cases import Case

START_S = 1_700_000_000


def ours(path: Path) -> int:
    from ingest import read_log

    return read_log(path).messages


def ours_frames(path: Path) -> int:
    from ingest.canbus import candump
    from ingest.container import open_contents

    return len(candump.read(open_contents(path).data).frames)


def messages(i: int) -> Iterator[tuple[str, dict[str, object], int]]:
    """Name, fields and sender of what the bus carries in one tick of 0.1 s."""
    place = {"latitude": 52.0 + 1e-6 * i, "longitude": 4.0 - 1e-6 * i}
    yield "vesselHeading", {"heading": math.pi + math.sin(i / 50), "reference": "True"}, 10
    yield "rateOfTurn", {"rate": 0.02 * math.cos(i / 50)}, 10
    yield "attitude", {"yaw": 0.1, "pitch": 0.01, "roll": 0.02 * math.sin(i)}, 10
    yield "positionRapidUpdate", place, 20
    yield "cogSogRapidUpdate", {"cogReference": "True", "cog": 3.0, "sog": 4.0}, 20
    yield "rudder", {"instance": 0, "position": 0.3 * math.sin(i / 30)}, 30
    yield "engineParametersRapidUpdate", {"speed": 25.0}, 50
    yield "windData", {"windSpeed": 7.0, "windAngle": 0.5, "reference": "Apparent"}, 40
    if i % 10 == 0:
        yield "gnssPositionData", {**place, "time": 0.1 * (i % 864_000), "numberOfSvs": 9, "hdop": 0.8}, 20


def frames(i: int) -> Iterator[str]:
    """Identifier and data of one tick, as candump writes them."""
    from nmea2000 import _canboat as canboat
    from nmea2000 import backend

    for name, fields, source in messages(i):
        pgn = backend.DATABASE.pgn_info(name).pgn
        payload = bytes(backend.DATABASE.encode(name, fields))
        can_id = canboat.can_id_compose(2, pgn, source, 255)
        parts = canboat.fast_packet_fragment(i // 10 % 8, payload) if len(payload) > 8 else [payload]
        yield from (f"{can_id:08X}#{bytes(part).hex().upper()}" for part in parts)


def make_candump(folder: Path, scale: float) -> Path:
    path = folder / "bench.log"
    ticks = [list(frames(i)) for i in range(500)]
    with path.open("w", newline="\n") as file:
        for i, tick in zip(range(int(100_000 * scale)), itertools.cycle(ticks), strict=False):
            for k, text in enumerate(tick):
                file.write(f"({START_S + i // 10}.{i % 10}{k:05}) can0 {text}\n")
    return path


def peer_frames(path: Path) -> int:
    import can

    count = 0
    try:
        for _ in can.CanutilsLogReader(path):
            count += 1
    except ValueError:  # at the first line that is not as it should be
        pass
    return count


def peer_messages(path: Path) -> int:
    import can
    from nmea2000 import NMEA2000Decoder

    logging.getLogger("nmea2000").setLevel(logging.ERROR)
    decoder = NMEA2000Decoder()
    return sum(decoder.decode(message) is not None for message in can.CanutilsLogReader(path))


def lines(data: bytes) -> list[bytes]:
    """A line each; candump has no header."""
    return [b"", *data.splitlines(keepends=True)]


def writer(suffix: str) -> Callable[[Path, float], Path]:
    """A function that writes a log of another format with python-can."""

    def make(folder: Path, scale: float) -> Path:
        import can

        path = folder / f"bench{suffix}"
        ticks = [list(frames(i)) for i in range(100)]
        with can.Logger(str(path)) as log:
            for i, tick in zip(range(int(12_000 * scale)), itertools.cycle(ticks), strict=False):
                for k, text in enumerate(tick):
                    can_id, _, data = text.partition("#")
                    message = can.Message(
                        START_S + i * 0.1 + k * 1e-3,
                        int(can_id, 16),
                        True,
                        data=bytes.fromhex(data),
                        channel=0,
                    )
                    log.on_message_received(message)
        return path

    return make


def transport(name: str) -> Callable[[Path], int]:
    """A function that reads the frames of a log of a format."""

    def read(path: Path) -> int:
        import importlib

        from ingest.container import open_contents

        return len(importlib.import_module(f"ingest.canbus.{name}").read(open_contents(path).data).frames)

    return read


def peer_any(path: Path) -> int:
    import can

    count = 0
    try:
        with can.LogReader(str(path)) as reader:
            for _ in reader:
                count += 1
    except (ValueError, IndexError, KeyError):
        pass
    return count


def with_header(data: bytes) -> list[bytes]:
    """Header and then a line each: up to the first line with eight data bytes or fewer in it."""
    text = data.splitlines(keepends=True)
    first = next(i for i, line in enumerate(text) if b" Rx " in line)
    return [b"".join(text[:first]), *(line for line in text[first:] if b" Rx " in line)]


CASES = (
    Case("asc frames", "python-can", 0.0, writer(".asc"), transport("asc"), peer_any, with_header, False),
    Case("trc frames", "python-can", 0.0, writer(".trc"), transport("trc"), peer_any, with_header, False),
    Case("blf frames", "python-can", 0.0, writer(".blf"), transport("blf"), peer_any),
    Case("candump frames", "python-can", 5.0, make_candump, ours_frames, peer_frames, lines, False),
    Case("candump NMEA 2000", "python-can + nmea2000", 1.5, make_candump, ours, peer_messages),
)
