"""The readers of serial logs."""

from __future__ import annotations

import re
from pathlib import Path

from ingest.reader import Decoded, Reader, ReadOptions

#: An address field and a comma, after the mark that begins a sentence.
_ADDRESS = re.compile(rb"[$!][A-Z]{2}[A-Z0-9]{2,6},[^\r\n$*]{0,1000}(\*[0-9A-Fa-f]{2})?")
_UBX_MARK = re.compile(rb"\xb5\x62[\x01-\x29\xf0]", re.DOTALL)


def sniff_nmea(head: bytes) -> float:
    """How sure the bytes hold NMEA 0183 sentences: by the share of the bytes that are part of one."""
    found = list(_ADDRESS.finditer(head))
    if not found:
        return 0.0
    checked = sum(len(m[0]) for m in found if m[1])
    inside = sum(len(m[0]) for m in found)
    share = inside / max(1, len(head))
    return min(0.9, 0.3 * share + 0.6 * checked / inside * min(1.0, 2.0 * share + 0.1 * len(found)))


def sniff_ubx(head: bytes) -> float:
    """How sure the bytes hold UBX frames: the first few are checked."""
    good = sum(_is_frame(head, m.start()) for m in list(_UBX_MARK.finditer(head))[:50])
    return min(0.95, 0.7 + 0.05 * good) if good else 0.0


def _is_frame(head: bytes, at: int) -> bool:
    length = int.from_bytes(head[at + 4 : at + 6], "little")
    frame = head[at : at + 8 + length]
    if len(frame) < 8 + length or length > 8192:
        return False
    a = b = 0
    for byte in frame[2:-2]:
        a = (a + byte) & 255
        b = (b + a) & 255
    return frame[-2:] == bytes((a, b))


def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Read a file of NMEA 0183 sentences, UBX frames and RTCM3 frames in any mixture.

    Raises
    ------
    ValueError
        Where there is no record with a right checksum, or none that states a time and no host stamp.
    """
    from ingest.marine.rules import sources_of
    from ingest.marine.stream import decode_stream

    stream = decode_stream(data, topics=options.topics)
    return Decoded(
        tables=stream.tables,
        units=stream.units,
        utc_of_index_zero_ns=stream.utc_of_zero,
        findings=stream.findings,
        messages=stream.messages,
        bytes_damaged=stream.bytes_damaged,
        sources=sources_of(stream.tables),
        unsure=stream.unsure,
        of_day_of_index_zero_ns=stream.of_day_of_zero,
    )


NMEA0183 = Reader("nmea0183", (".nmea", ".txt", ".log", ".vdr", ".gps"), sniff_nmea, read)
UBX = Reader("ubx", (".ubx", ".log", ".bin"), sniff_ubx, read)
