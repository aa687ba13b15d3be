"""candump logs: the log style (``-l``, ``-L``) by a compiled scanner, the console styles by a pattern."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Capture, Frames, implausible_lengths
from ingest.canbus.lines import LineStyle, date_time_ns, read_frames, seconds_ns
from ingest.damage import damage_findings, merged
from ingest.log import Finding

LOG_LINE = re.compile(rb"\(\d{1,10}\.\d+\)[ \t]+[^\s#()]{1,16}[ \t]+(?:[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#")
CONSOLE = LineStyle(
    re.compile(
        rb"(?:\((?P<time>\d{1,10}\.\d{1,9}|\d{4}-\d\d-\d\d[ T]\d\d:\d\d:\d\d\.\d{1,9})\)[ \t]+)?"
        rb"(?:\b(?P<channel>[A-Za-z]\w{0,15})[ \t]+(?:[RT]X[ \t]+[-B][ \t]+[-E][ \t]+)?|<0x)"
        rb"(?P<id>[0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})>?"
        rb"[ \t]+\[(?P<dlc>\d)\](?P<data>(?:[ \t]{1,2}[0-9A-Fa-f]{2}(?![.\w])){0,8})"
        rb"(?:[ \t]+'[^\r\n]{0,8}'?)?(?:[ \t]+remote request)?"
    ),
    idle=re.compile(rb"[ \t]*#[^\n]*"),
)
DATED = re.compile(rb"\(\d{4}-\d\d-\d\d ")
#: Stamps from here on are seconds since 1970; smaller ones count from the start.
EPOCH_S = 1e8


def sniff(head: bytes) -> float:
    """How sure the first bytes are of candump."""
    if len(LOG_LINE.findall(head[:8192])) >= 2 or LOG_LINE.match(head):
        return 0.95
    count = len(CONSOLE.record.findall(head[:8192]))
    return 0.9 if count >= 2 else 0.4 * count


def read(data: memoryview) -> Capture:
    """Frames of a candump log in any style."""
    head = bytes(data[: 1 << 16])
    logged, shown = len(LOG_LINE.findall(head)), len(CONSOLE.record.findall(head))
    return read_log_style(data) if logged >= shown else read_console_style(data)


def read_log_style(data: memoryview) -> Capture:
    """Frames of ``candump -l`` or ``-L``."""
    from ingest.canbus.candump_scan import scan

    text = np.frombuffer(data, np.uint8)
    time_ns, can_id, extended, channel, dlc, block, doubtful, spans, names, damaged, other = scan(text)
    channels = tuple(bytes(text[a:b]).decode("ascii") for a, b in names)
    frames = Frames(time_ns, can_id, extended, channel, dlc, block, channels)
    cut = implausible_lengths(frames, doubtful)
    holes = merged([(int(a), int(b - a)) for a, b in [*damaged.tolist(), *spans[cut[doubtful]].tolist()]])
    findings = (*damage_findings(holes, len(text), "no candump record"), *other_frames(int(other)))
    kept = frames.take(~cut) if cut.any() else frames
    return Capture(kept, {}, findings, sum(n for _, n in holes), clock_of(kept.time_ns))


def other_frames(count: int) -> tuple[Finding, ...]:
    """A note on frames that carry no classic data."""
    if not count:
        return ()
    return (Finding("note", f"{count} remote, error or CAN FD frames were passed over", count=count),)


def clock_of(time_ns: NDArray[np.int64]) -> str:
    """``"utc"`` where the stamps count from 1970, ``"start"`` where they cannot."""
    return "utc" if len(time_ns) and float(np.median(time_ns)) >= EPOCH_S * 1e9 else "start"


def read_console_style(data: memoryview) -> Capture:
    """Frames of what candump prints, with or without time stamps (``-ta``, ``-tA``, ``-td``, ``-tz``)."""
    frames, damaged = read_frames(data, CONSOLE, console_times)
    findings = damage_findings(damaged, len(data), "no candump record")
    dated = DATED.search(bytes(data[:8192])) is not None
    stamped = bool(frames.time_ns.any())
    time_ns = deltas_summed(frames.time_ns) if stamped else invented_times(len(frames))
    if not stamped:
        findings = (*findings, Finding("clock", "no time stamps: one frame per millisecond is assumed"))
    if dated:
        findings = (
            *findings,
            Finding("clock", "stamps are local time of the recording computer, zone unknown"),
        )
    clock = "start" if dated else clock_of(time_ns)
    return Capture(replace(frames, time_ns=time_ns), {}, findings, sum(n for _, n in damaged), clock)


def console_times(texts: list[bytes]) -> NDArray[np.int64]:
    """Nanoseconds from the stamps of the console styles."""
    if texts and b"-" in texts[0]:
        return date_time_ns(texts)
    return seconds_ns(texts)


def deltas_summed(time_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Times since the start, from stamps that may each count from the record before (``-td``)."""
    steps = np.diff(time_ns)
    deltas = len(steps) > 3 and float((steps < 0).mean()) > 0.02 and float(np.median(time_ns)) < 60e9
    return np.cumsum(time_ns) if deltas else time_ns


def invented_times(count: int) -> NDArray[np.int64]:
    """One frame per millisecond."""
    return np.arange(count, dtype=np.int64) * 1_000_000
