"""The importer plug-in of the Rerun viewer, alone and called by Rerun itself."""

import os
import shutil
import subprocess
import sys
from functools import reduce
from pathlib import Path

import numpy as np
import pytest

from seatrial.rerun_importer import NOT_MINE, main, safe

ROOT = Path(__file__).parents[1]
SECONDS = 40


def sentence(body):
    """One NMEA 0183 sentence with its checksum."""
    return f"${body}*{reduce(lambda a, c: a ^ ord(c), body, 0):02X}\r\n"


@pytest.fixture
def log(tmp_path):
    """Forty seconds of position, heading and rudder, once a second."""
    lines = []
    for k in range(SECONDS):
        stamp = f"1200{k:02d}.00"
        minutes = 25.0 + 0.001 * k
        lines.append(sentence(f"GPRMC,{stamp},A,59{minutes:07.4f},N,02445.0000,E,2.0,0.0,210626,,,A"))
        lines.append(sentence(f"HEHDT,{(10 + k) % 360:.1f},T"))
        lines.append(sentence(f"IIRSA,{k - 20:.1f},A,,"))
    path = tmp_path / "harbour.nmea"
    path.write_bytes("".join(lines).encode())
    return path


def entities(path):
    from rerun.chunk import RrdReader

    out = {}
    for chunk in RrdReader(path).stream().to_chunks():
        out.setdefault(str(chunk.entity_path), []).append(chunk)
    return out


def test_what_is_no_log_is_left_to_others(tmp_path):
    (tmp_path / "notes.txt").write_text("not a log at all\n")
    (tmp_path / "x.rrd").write_bytes(b"RRF2")
    assert main([str(tmp_path / "notes.txt")]) == NOT_MINE
    assert main([str(tmp_path / "x.rrd")]) == NOT_MINE
    assert main([str(tmp_path / "not_there.bin")]) == NOT_MINE


def test_numbers_without_a_position_or_heading_are_left_to_others(tmp_path):
    rows = "\n".join(f"{k},{k * k}" for k in range(50))
    (tmp_path / "prices.csv").write_text(f"year,price\n{rows}\n")
    assert main([str(tmp_path / "prices.csv")]) == NOT_MINE


def test_names_fit_into_an_entity_path():
    assert safe("SERVO OUTPUT/RAW") == "SERVO_OUTPUT_RAW"
    assert safe("///") == "log"


def test_a_log_becomes_a_recording(log, tmp_path):
    options = [
        "--application-id",
        "a",
        "--recording-id",
        "b",
        "--entity-path-prefix",
        "boat",
        "--unknown",
        "1",
    ]
    command = [sys.executable, "-m", "seatrial.rerun_importer", str(log), *options]
    done = subprocess.run(command, capture_output=True, timeout=60, cwd=ROOT, check=True)
    (tmp_path / "out.rrd").write_bytes(done.stdout)
    found = entities(tmp_path / "out.rrd")
    path = next(p for p in found if p.startswith("/boat/") and "RSA" in p and p.endswith("angle"))
    chunks = [c for c in found[path] if not c.is_static]
    assert sum(c.num_rows for c in chunks) == SECONDS
    batch = chunks[0].to_record_batch()
    name = next(n for n in batch.schema.names if n.endswith("scalars"))
    values = batch.column(name).flatten().to_numpy(zero_copy_only=False)
    np.testing.assert_allclose(values, np.arange(SECONDS) - 20.0)
    assert any(p.startswith("/boat/map/") for p in found)
    assert "harbour.nmea" in str(found["/boat/log"][0].to_record_batch().to_pydict())


@pytest.mark.slow
def test_rerun_finds_the_importer_on_the_path(log, tmp_path):
    rerun = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if rerun is None or os.name == "nt":
        pytest.skip("the rerun command is not installed beside Python")
    plugin = tmp_path / "bin" / "rerun-importer-seatrial"
    plugin.parent.mkdir()
    plugin.write_text(f'#!/bin/sh\ncd "{ROOT}" && exec "{sys.executable}" -m seatrial.rerun_importer "$@"\n')
    plugin.chmod(0o755)
    path = f"{plugin.parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "HOME": str(tmp_path)}
    subprocess.run(
        [rerun, "analytics", "disable"], env=environment, check=True, timeout=60, capture_output=True
    )
    command = [rerun, "--save", str(tmp_path / "out.rrd"), str(log)]
    subprocess.run(command, env=environment, check=True, timeout=60, capture_output=True)
    assert any("RSA" in p for p in entities(tmp_path / "out.rrd"))
