"""PEAK TRC 1.0 to 2.1. Its start is local time of an unknown zone, so times count from the start only."""

from __future__ import annotations

import re

from ingest.canbus.frames import Capture
from ingest.canbus.lines import LineStyle, milliseconds_ns, read_frames
from ingest.damage import damage_findings
from ingest.log import Finding

VERSION = re.compile(rb";\$FILEVERSION=(\d)\.(\d)")
#: A time that states its zone.
ZONE = re.compile(r"([+-]\d\d:?\d\d|Z)$")
START = re.compile(rb";[ \t]*Start time:[ \t]*([^\r\n]+)")
DATA = rb"(?P<dlc>\d{1,2})(?P<data>(?:[ \t]+[0-9A-Fa-f]{2}(?![.)\w])){0,8})"
IDLE = re.compile(
    rb"[ \t]*;[^\r\n]*|[ \t]*\d{1,10}\)?[ \t]+\d{1,12}(?:\.\d{0,9})?[ \t]+(?:\d[ \t]+)?"
    rb"(?:[^\r\n]*\bRTR\b|Warng|Error|FD|FB|FE|BI|RR|ST|ER|EC|EV)[^\r\n]*"
)
FIRST = LineStyle(
    re.compile(
        rb"\d{1,10}\)[ \t]+(?P<time>\d{1,12}(?:\.\d{1,9})?)[ \t]+(?:(?P<channel>\d{1,2})[ \t]+)?"
        rb"(?:(?:Rx|Tx)[ \t]+)?"
        rb"(?P<id>[0-9A-Fa-f]{8}|[0-9A-Fa-f]{4})[ \t]+(?:-[ \t]+)?" + DATA
    ),
    IDLE,
)
SECOND = LineStyle(
    re.compile(
        rb"\b\d{1,10}[ \t]+(?P<time>\d{1,12}\.\d{1,9})[ \t]+DT[ \t]+(?:(?P<channel>\d{1,2})[ \t]+)?"
        rb"(?P<id>(?P<wide>[0-9A-Fa-f]{5,8})|[0-9A-Fa-f]{1,4})[ \t]+(?:Rx|Tx)[ \t]+(?:-[ \t]+)?" + DATA
    ),
    IDLE,
)


def sniff(head: bytes) -> float:
    """How sure the first bytes are of PEAK TRC."""
    if VERSION.search(head[:4096]):
        return 0.95
    most = max(len(s.record.findall(head[:8192])) for s in (FIRST, SECOND))
    return 0.8 if most >= 2 else 0.0


def read(data: memoryview) -> Capture:
    """Frames of a PEAK trace."""
    head = bytes(data[: 1 << 16])
    version = VERSION.search(head)
    second = version.group(1) == b"2" if version else bool(SECOND.record.search(head))
    frames, damaged = read_frames(data, SECOND if second else FIRST, milliseconds_ns)
    findings = (*damage_findings(damaged, len(data), "no TRC record"), *start_notes(head))
    return Capture(frames, {}, findings, sum(n for _, n in damaged), "start")


def start_notes(head: bytes) -> tuple[Finding, ...]:
    """What the header says of the start, for a person."""
    start = START.search(head)
    if start is None:
        return ()
    said = start.group(1).decode("latin-1").strip()
    zone = "" if ZONE.search(said) else ", local time of an unknown zone"
    return (Finding("clock", f"the log says that it began {said}{zone}: not used"),)
