"""Vector ASC. Its header gives local time of an unknown zone, so times count from the start only."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from ingest.canbus.frames import Capture
from ingest.canbus.lines import LineStyle, read_frames, seconds_ns
from ingest.damage import damage_findings
from ingest.log import Finding

HEADER = re.compile(rb"base[ \t]+(hex|dec)[ \t]+timestamps[ \t]+(absolute|relative)")
BEGIN = re.compile(rb"(?:Begin Triggerblock|date)[ \t]+([^\r\n]+)")
RECORD = (
    rb"(?P<time>\d{1,10}\.\d{1,9})[ \t]+(?P<channel>\d{1,3})[ \t]+(?P<id>%s)(?P<wide>x?)[ \t]+(?:Rx|Tx|TxRq)"
    rb"[ \t]+d[ \t]+(?P<dlc>\d)(?P<data>(?:[ \t]+%s(?![.\w])){0,8})(?:[ \t]+Length[ \t]*=[^\r\n]*)?"
)
IDLE = re.compile(
    rb"(?:date|base|internal|no internal|Begin|End|//|\*)[^\r\n]*"
    rb"|[ \t]*\d{1,10}\.\d{1,9}[ \t]+(?:Start of|\d+[ \t]+"
    rb"(?:Statistic|ErrorFrame|[0-9A-Fa-f]+x?[ \t]+[RT]x[ \t]+r)|CANFD|CAN)[^\r\n]*"
    rb"|[ \t]*\d{1,10}\.\d{1,9}[ \t]+(?:log trigger|SV:|EV:|ET)[^\r\n]*"
)
HEXADECIMAL = LineStyle(re.compile(RECORD % (rb"[0-9A-Fa-f]{1,8}", rb"[0-9A-Fa-f]{2}")), IDLE)
DECIMAL = LineStyle(re.compile(RECORD % (rb"\d{1,10}", rb"\d{1,3}")), IDLE, base=10)


def sniff(head: bytes) -> float:
    """How sure the first bytes are of Vector ASC."""
    if HEADER.search(head[:4096]):
        return 0.95
    return 0.8 if len(HEXADECIMAL.record.findall(head[:8192])) >= 2 else 0.0


def read(data: memoryview) -> Capture:
    """Frames of a Vector ASC log."""
    head = bytes(data[:4096])
    header = HEADER.search(head)
    base, stamps = header.groups() if header else (b"hex", b"absolute")
    frames, damaged = read_frames(data, DECIMAL if base == b"dec" else HEXADECIMAL, seconds_ns)
    if stamps == b"relative":
        frames = replace(frames, time_ns=np.cumsum(frames.time_ns))
    findings = (*damage_findings(damaged, len(data), "no ASC record"), *start_notes(head))
    return Capture(frames, {}, findings, sum(n for _, n in damaged), "start")


def start_notes(head: bytes) -> tuple[Finding, ...]:
    """What the header says of the start, for a person."""
    begins = BEGIN.findall(head)
    if not begins:
        return ()
    said = begins[-1].decode("latin-1").strip()
    return (Finding("clock", f"the log says that it began {said}, local time of an unknown zone: not used"),)
