"""Importer for the Rerun viewer: opens any log that Seatrial reads, named or dropped into the window.

Rerun asks every executable on the path whose name begins with ``rerun-importer-``: it is given the file and
writes a recording to its standard output, or ends with status 66 where the file is none of its own. A log that a
``campaign.toml`` in its folder names is read as that says (format, dialect, DBC file).
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import rerun as rr

    from ingest.log import Log, Source

#: The status that tells Rerun to ask the next importer.
NOT_MINE = 66
#: What Rerun opens itself, by suffix; asked first, because it is asked for every file that is opened.
PICTURES = (".png", ".jpg", ".jpeg", ".gif", ".webp", ".bmp", ".tif", ".tiff", ".svg", ".mp4")
SHAPES = (".glb", ".gltf", ".obj", ".stl", ".dae", ".ply", ".urdf")
NATIVE = frozenset((".rrd", ".rbl", ".mcap", ".parquet", ".md", *PICTURES, *SHAPES))


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the recording of one log to standard output.

    Parameters
    ----------
    arguments : sequence of str, optional
        As Rerun gives them; those that are not known are ignored.

    Returns
    -------
    int
        0, or 66 where the file is no log that Seatrial reads.
    """
    asked, _ = parser().parse_known_args(arguments)
    if not asked.file.is_file() or asked.file.suffix.lower() in NATIVE:
        return NOT_MINE
    from ingest.errors import SeatrialError
    from seatrial.reader_choice import ReaderChoice, chosen_for

    try:
        log = chosen_for(asked.file, ReaderChoice()).read(asked.file)
    except SeatrialError:
        return NOT_MINE
    if not log.sources:
        return NOT_MINE
    send(log, asked)
    return 0


def parser() -> argparse.ArgumentParser:
    """What Rerun tells an importer."""
    out = argparse.ArgumentParser(
        prog="rerun-importer-seatrial", description="Opens logs of sea trials in Rerun."
    )
    out.add_argument("file", type=Path)
    out.add_argument("--application-id", default=None)
    out.add_argument("--opened-application-id", default=None)
    out.add_argument("--recording-id", default=None)
    out.add_argument("--opened-recording-id", default=None)
    out.add_argument("--entity-path-prefix", default="")
    return out


def send(log: Log, asked: argparse.Namespace) -> None:
    """Everything of a log: its numbers over time, its track on a map, what was noticed as text."""
    import rerun as rr

    application = asked.opened_application_id or asked.application_id or str(asked.file)
    recording = asked.opened_recording_id or asked.recording_id
    rec = rr.RecordingStream(application, recording_id=recording, send_properties=False)
    rec.stdout()
    prefix = asked.entity_path_prefix.strip("/")
    root = f"{prefix}/" if prefix else ""
    for path, t, value in series(log):
        send_column(rec, root + path, log, t, value)
    for source in log.sources:
        if source.quantity == "position" and "latitude" in source.fields:
            send_track(rec, f"{root}map/{safe(source.name)}", log, source)
    rec.log(f"{root}log", rr.TextDocument(summary(log), media_type=rr.MediaType.MARKDOWN), static=True)
    rec.flush()
    rec.disconnect()


def safe(name: str) -> str:
    """A name without what has a meaning in an entity path."""
    return re.sub(r"[^A-Za-z0-9_.\[\]-]+", "_", name).strip("_") or "log"


def series(log: Log) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Entity path, times in s and values of every column of numbers, one per device."""
    import numpy as np

    for topic, device, table in devices(log):
        where = [safe(part) for part in topic.split("/") if part] + ([f"source_{device}"] if device else [])
        t = table.index.to_numpy(np.int64) * 1e-9
        for name in table.select_dtypes(["number", "bool"]).columns:
            value = table[name].to_numpy(np.float64, na_value=np.nan)
            if np.isfinite(value).any():
                yield "/".join([*where, safe(str(name))]), t, value


def devices(log: Log) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """Topic, device and rows; the device is empty where there is one only."""
    from ingest.log import SOURCE

    for topic, table in log.tables.items():
        if SOURCE not in table or table[SOURCE].nunique() < 2:
            yield topic, "", table.drop(columns=SOURCE, errors="ignore")
            continue
        for device, rows in table.groupby(SOURCE):
            yield topic, safe(str(device)), rows.drop(columns=SOURCE)


def send_column(rec: rr.RecordingStream, path: str, log: Log, t: np.ndarray, value: np.ndarray) -> None:
    """One column of numbers."""
    from validate.recording.stream import Clock, send_scalars

    send_scalars(rec, path, Clock(log.utc_ns), t, value)


def send_track(rec: rr.RecordingStream, path: str, log: Log, source: Source) -> None:
    """A track on the map, without the fixes that say that they are none."""
    import numpy as np
    import rerun as rr

    from ingest.log import SOURCE
    from validate.recording.stream import thin_track

    table = log.tables[source.topic]
    if source.device is not None and SOURCE in table:
        table = table[table[SOURCE] == source.device]
    place = table[[source.fields["latitude"], source.fields["longitude"]]].to_numpy(
        np.float64, na_value=np.nan
    )
    place = place[np.isfinite(place).all(axis=1) & (np.abs(place) > 1e-9).any(axis=1)]
    if len(place) > 1:
        radius = rr.Radius.ui_points(2.0)
        rec.log(path, rr.GeoLineStrings(lat_lon=[thin_track(place)], radii=radius), static=True)


def summary(log: Log) -> str:
    """What was read and what was wrong with it, in Markdown."""
    lines = [
        f"# {log.path.name}",
        f"{log.format}, {log.duration_s:.1f} s, {log.messages} messages, "
        f"{log.bytes_damaged} of {log.bytes_read} bytes damaged",
        "## What looks like what",
        *(f"* {s.quantity}: `{s.name}` ({s.unit})" for s in log.sources),
        *(["## Noticed", *(f"* {f.message}" for f in log.findings)] if log.findings else []),
    ]
    return "\n\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
