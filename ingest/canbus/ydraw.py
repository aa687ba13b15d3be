"""Yacht Devices RAW: ``17:33:21.107 R 19F51323 01 2F 30 70 00 2F 30 70``, time of day in UTC."""

from __future__ import annotations

import re

from ingest.canbus.frames import Capture
from ingest.canbus.lines import LineStyle, clock_ns, read_frames
from ingest.damage import damage_findings

STYLE = LineStyle(
    re.compile(
        rb"(?P<time>\d\d:\d\d:\d\d\.\d{1,6})[ \t]+[RT][ \t]+(?P<id>[0-9A-Fa-f]{8})"
        rb"(?P<data>(?:[ \t]+[0-9A-Fa-f]{2}(?![.:\w])){0,8})"
    ),
    idle=re.compile(rb"[ \t]*[#;][^\r\n]*"),
)


def sniff(head: bytes) -> float:
    """How sure the first bytes are of Yacht Devices RAW."""
    count = len(STYLE.record.findall(head[:8192]))
    return 0.9 if count >= 2 else 0.4 * count


def read(data: memoryview) -> Capture:
    """Frames of a Yacht Devices RAW log."""
    frames, damaged = read_frames(data, STYLE, clock_ns)
    findings = damage_findings(damaged, len(data), "no Yacht Devices record")
    return Capture(frames, {}, findings, sum(n for _, n in damaged), "day")
