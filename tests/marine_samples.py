"""NMEA 0183 sentences and UBX frames of a short drive, for tests."""

from functools import reduce
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pyubx2 import GET, UBXMessage

FORMATS = Path(__file__).parents[2] / "shared" / "data" / "formats"
UTC_0 = 1_717_200_000_000_000_000  # 2024-06-01T00:00:00Z
SECOND = 1_000_000_000


def nmea(body: str) -> bytes:
    return f"${body}*{reduce(lambda x, c: x ^ c, body.encode(), 0):02X}\r\n".encode()


def clock(t: float) -> str:
    return f"{int(t // 3600) % 24:02d}{int(t // 60) % 60:02d}{t % 60:05.2f}"


def epoch(t: float, talker: str = "GN") -> list[bytes]:
    lat, lon = f"60{10 + t / 1e3:010.7f}", f"010{20 + t / 1e3:010.7f}"
    day = f"{1 + int(t // 86400):02d}0624"
    return [
        nmea(f"{talker}GGA,{clock(t)},{lat},N,{lon},W,4,19,0.6,2.903,M,40.935,M,1.1,0415"),
        nmea(f"{talker}RMC,{clock(t)},A,{lat},N,{lon},W,4.2,{t % 360:.2f},{day},4.7,E,D,S"),
        nmea(f"{talker}VTG,{t % 360:.3f},T,,M,4.2,N,7.8,K,D"),
        nmea(f"{talker}HDT,{(t * 2) % 360:.4f},T"),
    ]


def drive(n: int = 50, start: float = 43200.0, step: float = 0.2) -> list[bytes]:
    return [s for i in range(n) for s in epoch(start + i * step)]


def pvt(t: float, **changes: int) -> bytes:
    second, nano = int(t % 60), round((t % 1) * 1e9)
    fields = {
        "iTOW": int((6 * 86400 + t + 18) * 1000) % 604_800_000, "year": 2024, "month": 6, "day": 1,
        "hour": int(t // 3600), "min": int(t // 60) % 60, "second": second, "validDate": 1, "validTime": 1,
        "fullyResolved": 1, "nano": nano, "fixType": 3, "gnssFixOk": 1, "numSV": 17, "lon": 10.1234567,
        "lat": -60.7654321, "velN": 1500, "velE": -20, "gSpeed": 1500, "headMot": 359.12345, "hAcc": 14,
    }  # fmt: skip
    return UBXMessage("NAV", "NAV-PVT", GET, **{**fields, **changes}).serialize()


def same(ours: object, theirs: object) -> bool:
    if theirs == "" or theirs is None:
        return bool(pd.isna(ours))
    if isinstance(theirs, (int, float)):
        return bool(np.isclose(float(ours), theirs, rtol=0, atol=6e-11))
    return str(ours) == theirs


def real(name: str) -> Path:
    if not (FORMATS / name).is_file():
        pytest.skip("the real logs are not beside the project")
    return FORMATS / name
