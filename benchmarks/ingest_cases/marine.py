"""NMEA 0183 against pynmeagps, UBX NAV-PVT against pyubx2; the UBX log is written by pyubx2's packer."""

from __future__ import annotations

import math
import re
from functools import reduce
from pathlib import Path

from benchmarks.ingest_cases import Case


def ours(path: Path) -> int:
    from ingest import read_log

    return read_log(path).messages


def sentence(body: str) -> bytes:
    return f"${body}*{reduce(lambda x, c: x ^ c, body.encode(), 0):02X}\r\n".encode()


def make_nmea(folder: Path, scale: float) -> Path:
    path = folder / "bench.nmea"
    with path.open("wb") as file:
        for i in range(int(60_000 * scale)):
            t = i * 0.1
            clock = f"{int(t // 3600) % 24:02d}{int(t // 60) % 60:02d}{t % 60:05.2f}"
            lat, lon = f"63{26 + i * 1e-5:011.8f}", f"010{25 + 0.5 * math.sin(i / 900):011.8f}"
            for body in (
                f"GPGGA,{clock},{lat},N,{lon},E,4,19,0.6,2.903,M,40.935,M,1.1,0415",
                f"GPRMC,{clock},A,{lat},N,{lon},E,4.04,{i % 360:.2f},110425,4.7,E,D,S",
                f"GPHDT,{(i * 0.37) % 360:.3f},T",
                f"GPVTG,{i % 360:.3f},T,,M,4.04,N,7.48,K,D",
                f"TIROT,{30 * math.sin(i / 90):.1f},A",
            ):
                file.write(sentence(body))
    return path


def peer_nmea(path: Path) -> int:
    from pynmeagps import NMEAReader

    columns: dict[str, list[dict[str, object]]] = {}
    count = 0
    with path.open("rb") as file:
        for _, message in NMEAReader(file, quitonerror=0):
            if message is not None:
                columns.setdefault(message.msgID, []).append(vars(message))
                count += 1
    return count


def nmea_records(data: bytes) -> list[bytes]:
    return [b"", *data.splitlines(keepends=True)]


def make_ubx(folder: Path, scale: float) -> Path:
    from pyubx2 import GET, UBXMessage

    path = folder / "bench.ubx"
    with path.open("wb") as file:
        for i in range(int(100_000 * scale)):
            t, nano = divmod(i * 100_000_000, 1_000_000_000)
            fields = {
                "iTOW": i * 100, "year": 2024, "month": 6, "day": 1 + t // 86_400, "hour": t // 3600 % 24,
                "min": t // 60 % 60, "second": t % 60, "validDate": 1, "validTime": 1, "nano": nano,
                "fixType": 3,
                "gnssFixOk": 1, "numSV": 17, "lon": 10.4 + i * 1e-7, "lat": 63.4 - i * 1e-7, "velN": 1500,
                "velE": -i % 99,
                "hAcc": 14, "headMot": i % 360,
            }  # fmt: skip
            file.write(UBXMessage("NAV", "NAV-PVT", GET, **fields).serialize())
    return path


def peer_ubx(path: Path) -> int:
    from pyubx2 import UBXReader

    rows: list[dict[str, object]] = []
    with path.open("rb") as file:
        reader = UBXReader(file, quitonerror=0)
        while True:
            try:
                _, message = next(reader)
            except UnicodeDecodeError:  # from a "$" in junk, even with quitonerror=0
                continue
            except StopIteration:
                return len(rows)
            if message is not None:
                rows.append(vars(message))


def ubx_records(data: bytes) -> list[bytes]:
    starts = [m.start() for m in re.finditer(rb"\xb5\x62\x01\x07", data)]
    return [b"", *(data[a:b] for a, b in zip(starts, [*starts[1:], len(data)], strict=True))]


CASES = (
    Case("nmea0183", "pynmeagps NMEAReader", 10, make_nmea, ours, peer_nmea, nmea_records),
    Case("ubx NAV-PVT", "pyubx2 UBXReader", 30, make_ubx, ours, peer_ubx, ubx_records),
)
