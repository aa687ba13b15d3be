"""CSV as python-can writes it: ``timestamp,arbitration_id,extended,remote,error,dlc,data`` (base64)."""

from __future__ import annotations

import re

from ingest.canbus.candump import clock_of
from ingest.canbus.frames import Capture
from ingest.canbus.lines import LineStyle, read_frames, seconds_ns
from ingest.damage import damage_findings

HEADER = b"timestamp,arbitration_id,extended,remote,error,dlc,data"
STYLE = LineStyle(
    re.compile(
        rb"(?P<time>\d{1,10}(?:\.\d{1,9})?),0x(?P<id>[0-9A-Fa-f]{1,8}),(?:(?P<wide>1)|0),0,0,(?P<dlc>\d),"
        rb"(?P<data>(?:[A-Za-z0-9+/]{4})*(?:[A-Za-z0-9+/]{2}==|[A-Za-z0-9+/]{3}=)?)"
    ),
    idle=re.compile(rb"timestamp,[^\r\n]*|[^,\r\n]+,0x[0-9a-f]+,[01],(?:1,[01]|0,1),\d+,[^\r\n]*"),
    base=64,
)


def sniff(head: bytes) -> float:
    """How sure the first bytes are of python-can's CSV."""
    if head.startswith(HEADER):
        return 1.0
    return 0.9 if len(STYLE.record.findall(head[:8192])) >= 2 else 0.0


def read(data: memoryview) -> Capture:
    """Frames of a CSV file; it holds no channel."""
    frames, damaged = read_frames(data, STYLE, seconds_ns)
    findings = damage_findings(damaged, len(data), "no CAN record")
    return Capture(frames, {}, findings, sum(n for _, n in damaged), clock_of(frames.time_ns))
