"""Records in text, by one pattern that needs no line starts: what is glued together still comes apart.

What no record covers, and is neither blank nor known to be idle (headers, comments), is a damaged stretch.
"""

from __future__ import annotations

import re
from binascii import Error, a2b_base64, unhexlify
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ingest.canbus.frames import Frames, implausible_lengths, joined
from ingest.damage import merged

CHUNK = 1 << 17
#: A damaged stamp may say more than 64 bits hold.
MOST_SECONDS, MOST_DAYS = 9_000_000_000, 100_000
LINE_ENDS = (b"\r", b"\n")
NOT_HEX = bytes(set(range(256)) - set(b"0123456789abcdefABCDEF"))


@dataclass(frozen=True)
class LineStyle:
    """How the records of a text format look.

    Attributes
    ----------
    record : compiled pattern
        Of bytes; all its groups are named. ``id`` is the identifier and ``data`` the data bytes in
        hexadecimal (separators are ignored); ``dlc``, ``channel``, ``time`` and ``wide`` (not empty:
        29 bits) are optional.
    idle : compiled pattern
        Whole lines that carry no record.
    base : int
        Of identifiers and data bytes: 16 or 10; 64 for data in base64.
    """

    record: re.Pattern[bytes]
    idle: re.Pattern[bytes]
    base: int = 16


@dataclass(frozen=True)
class Stretch:
    """The records of one chunk of text: one list per group of the pattern, and offsets in the file.

    ``ended`` tells which records are followed by the end of a line.
    """

    groups: dict[str, list[bytes]]
    spans: list[tuple[int, int]]
    ended: list[bool]
    damaged: list[tuple[int, int]] = field(default_factory=list)


def stretches(data: memoryview, style: LineStyle) -> Iterator[Stretch]:
    """The records of a file, chunk by chunk."""
    for offset, text in chunks(data):
        yield stretch(text, offset, style)


def chunks(data: memoryview) -> Iterator[tuple[int, bytes]]:
    """Offset and text of pieces of a file, cut after line ends where there are any."""
    offset = 0
    while offset < len(data):
        text = bytes(data[offset : offset + CHUNK])
        if offset + len(text) < len(data):
            text = text[: text.rfind(b"\n") + 1] or text
        yield offset, text
        offset += len(text)


def stretch(text: bytes, offset: int, style: LineStyle) -> Stretch:
    """The records of one chunk."""
    matches = list(style.record.finditer(text))
    names = list(style.record.groupindex)
    columns = zip(*(m.groups(b"") for m in matches), strict=True) if matches else ([] for _ in names)
    groups = {name: list(column) for name, column in zip(names, columns, strict=True)}
    spans = [m.span() for m in matches]
    ended = [text[b : b + 1] in LINE_ENDS for _, b in spans]
    damaged = [(a + offset, b - a) for a, b in uncovered(text, spans, style.idle)]
    return Stretch(groups, [(a + offset, b - a) for a, b in spans], ended, damaged)


def uncovered(
    text: bytes, spans: list[tuple[int, int]], idle: re.Pattern[bytes]
) -> Iterator[tuple[int, int]]:
    """Start and end of every piece of a line between the records that is neither blank nor idle."""
    at = 0
    for start, end in [*spans, (len(text), len(text))]:
        between = text[at:start]
        if between and not between.isspace():
            yield from pieces(between, at, idle)
        at = end


def pieces(between: bytes, at: int, idle: re.Pattern[bytes]) -> Iterator[tuple[int, int]]:
    """The lines, or parts of lines, of a stretch that are neither blank nor idle."""
    for line in between.splitlines(keepends=True):
        bare = line.strip()
        if bare and not idle.fullmatch(line.rstrip(b"\r\n")):
            start = at + line.find(bare)
            yield start, start + len(bare)
        at += len(line)


def read_frames(
    data: memoryview, style: LineStyle, times: Callable[[list[bytes]], NDArray[np.int64]]
) -> tuple[Frames, list[tuple[int, int]]]:
    """Frames of a text file, and offset and length of every damaged stretch.

    Parameters
    ----------
    data : memoryview
    style : LineStyle
    times : callable
        Nanoseconds from the texts of the group ``time``.
    """
    parts, doubtful, spans, damaged = [], [], [], []
    for piece in stretches(data, style):
        frames, whole = frames_of(piece, style, times)
        parts.append(frames)
        doubtful.append(~np.array(piece.ended, np.bool_)[whole] & ("dlc" not in piece.groups))
        spans.append(np.array(piece.spans, np.int64).reshape(-1, 2)[whole])
        damaged += piece.damaged + [s for s, ok in zip(piece.spans, whole.tolist(), strict=True) if not ok]
    frames = joined(parts)
    if not len(frames):
        return frames, damaged
    cut = implausible_lengths(frames, np.concatenate(doubtful))
    short = [(int(a), int(n)) for a, n in np.concatenate(spans)[cut]]
    return frames.take(~cut), merged([*damaged, *short])


def frames_of(
    piece: Stretch, style: LineStyle, times: Callable[[list[bytes]], NDArray[np.int64]]
) -> tuple[Frames, NDArray[np.bool_]]:
    """Frames of one chunk, and which records had as many data bytes as they said."""
    groups = piece.groups
    payloads = [hexadecimal(d, style.base) for d in groups["data"]]
    size = np.array([len(p) // 2 for p in payloads], np.int64)
    said = np.array([int(d) for d in groups["dlc"]], np.int64) if "dlc" in groups else size
    whole = (size == said) & (size <= 8)
    data = np.frombuffer(unhexlify(b"".join(p[:16].ljust(16, b"0") for p in payloads)), np.uint8)
    channels, channel = channel_column(groups, len(size))
    identifiers = np.array([int(i, 10 if style.base == 10 else 16) for i in groups["id"]], np.int64)
    wide = np.array(
        [bool(w) for w in groups["wide"]] if "wide" in groups else [len(i) == 8 for i in groups["id"]],
        np.bool_,
    )
    frames = Frames(
        times(groups["time"]),
        (identifiers & 0x1FFF_FFFF).astype(np.uint32),
        wide,
        channel,
        size.astype(np.uint8),
        data.reshape(-1, 8),
        channels,
    )
    return frames.take(whole), whole


def hexadecimal(text: bytes, base: int) -> bytes:
    """Data bytes as hexadecimal digits without separators; too few where they make no sense."""
    if base == 16:
        return text.translate(None, NOT_HEX)
    if base == 10:
        return b"".join(b"%02x" % int(v) for v in text.split() if int(v) < 256)
    try:
        return a2b_base64(text).hex().encode("ascii")
    except Error:
        return b""


def channel_column(groups: dict[str, list[bytes]], count: int) -> tuple[tuple[str, ...], NDArray[np.int16]]:
    """Names of the channels, and each record's index into them."""
    texts = groups.get("channel")
    if not texts:
        return ("",), np.zeros(count, np.int16)
    index = {text: k for k, text in enumerate(dict.fromkeys(texts))}
    names = tuple(text.decode("latin-1") for text in index)
    return names, np.array([index[t] for t in texts], np.int16)


def seconds_ns(texts: list[bytes]) -> NDArray[np.int64]:
    """Nanoseconds from decimal seconds, exact; 0 where there is no text."""
    halves = (t.partition(b".") for t in texts)
    parts = [min(int(a or 0), MOST_SECONDS) * 10**9 + int((b + b"000000000")[:9]) for a, _, b in halves]
    return np.array(parts, np.int64)


def milliseconds_ns(texts: list[bytes]) -> NDArray[np.int64]:
    """Nanoseconds from decimal milliseconds, exact."""
    halves = (t.partition(b".") for t in texts)
    return np.array([int(a or 0) * 10**6 + int((b + b"000000")[:6]) for a, _, b in halves], np.int64)


def clock_ns(texts: list[bytes]) -> NDArray[np.int64]:
    """Nanoseconds since midnight from ``hh:mm:ss.fff``."""
    fields = (t.split(b":") for t in texts)
    hours_minutes = np.array([int(h) * 3600 + int(m) * 60 for h, m, _ in fields], np.int64)
    return hours_minutes * 10**9 + seconds_ns([t.rpartition(b":")[2] for t in texts])


def date_time_ns(texts: list[bytes]) -> NDArray[np.int64]:
    """Nanoseconds since 1970 from ``yyyy-mm-dd?hh:mm:ss.fff``."""
    days = {d: day_number(d) for d in {t[:10] for t in texts}}
    midnight = np.array([days[t[:10]] for t in texts], np.int64) * 86_400 * 10**9
    return midnight + clock_ns([t[11:] for t in texts])


def day_number(date: bytes) -> int:
    """Days since 1970 of ``yyyy-mm-dd``; impossible days run over into the next month."""
    year, month, day = (int(v) for v in date.split(b"-"))
    months = (year - 1970) * 12 + min(max(month, 1), 12) - 1
    first = int(np.datetime64(months, "M").astype("datetime64[D]").astype(np.int64))
    return min(max(first + day - 1, 0), MOST_DAYS)
