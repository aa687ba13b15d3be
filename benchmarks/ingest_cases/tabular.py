"""Delimited text against pandas alone, which finds neither clock, units nor damage."""

from __future__ import annotations

import math
from pathlib import Path

from benchmarks.ingest_cases import Case

COLUMNS = "time_s,latitude,longitude,heading_deg,yaw_rate_deg_s,rudder_deg,propeller_rpm"


def ours(path: Path) -> int:
    from ingest import read_log

    return read_log(path).messages


def row(i: int) -> str:
    psi = math.sin(i / 300)
    fix = f"{52 + 1e-7 * i:.7f},{4 - 1e-7 * i:.7f}" if i % 5 == 0 else ","
    return f"{i / 50:.3f},{fix},{90 * psi:.3f},{18 * math.cos(i / 300):.4f},{20 * psi:.2f},{600 + i % 7}\n"


def make_csv(folder: Path, scale: float) -> Path:
    path = folder / "bench.csv"
    with path.open("w", newline="") as file:
        file.write(COLUMNS + "\n")
        file.writelines(row(i) for i in range(int(500_000 * scale)))
    return path


def peer_csv(path: Path) -> int:
    import pandas as pd

    try:
        return len(pd.read_csv(path, on_bad_lines="skip"))
    except ValueError:  # bytes that are no text
        return 0


def lines(data: bytes) -> list[bytes]:
    return data.splitlines(keepends=True)


CASES = (Case("csv", "pandas.read_csv", 0.0, make_csv, ours, peer_csv, lines, False),)
