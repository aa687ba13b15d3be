"""Which protocol a port speaks, from its bytes; and what to think of bytes that fit none."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from seatrial.capture.settings import Protocol

#: Share of the bytes that records of a protocol must cover.
ENOUGH = 0.6
#: Bytes that are looked at, and how many a port must have sent before a wrong line rate is suspected.
WINDOW, SUSPICIOUS = 16_384, 600
USUAL_BAUD = (4800, 9600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 921_600)

SLCAN_FRAME = re.compile(
    rb"(?:t[0-7][0-9A-Fa-f]{2}|T[01][0-9A-Fa-f]{7})(?:0|1[\dA-Fa-f]{2}|2[\dA-Fa-f]{4}|3[\dA-Fa-f]{6}"
    rb"|4[\dA-Fa-f]{8}|5[\dA-Fa-f]{10}|6[\dA-Fa-f]{12}|7[\dA-Fa-f]{14}|8[\dA-Fa-f]{16})(?:[\dA-Fa-f]{4})?\r"
)
#: A number, named or not, and what parts two of them: no text can be taken for either in two ways, whatever its length.
NUMBER = rb"(?:[A-Za-z_]{1,12}[ \t]*+[:=][ \t]*+)?[-+]?\d++(?:\.\d++)?(?:[eE][-+]?\d++)?"
PARTED = rb"(?:[ \t]*+[,;][ \t]*+|[ \t]++)"
NUMBERS = re.compile(
    rb"(?m)^[ \t]*+[#!$]?[A-Za-z_]{0,12}[:=,]?[ \t]*+"
    + NUMBER
    + rb"(?:" + PARTED + NUMBER + rb"){2,}[ \t]*+(?:[,;][ \t]*+)?\r?\n"
)  # fmt: skip


def detect(data: bytes) -> Protocol | None:
    """The protocol that explains most of the bytes; None where none explains enough.

    Parameters
    ----------
    data : bytes
        What a port has sent lately.
    """
    window = data[-WINDOW:]
    if not window:
        return None
    shares = {protocol: covered(window) / len(window) for protocol, covered in COVERED.items()}
    best = max(shares, key=lambda p: shares[p])
    return best if shares[best] >= ENOUGH else None


def serial_bytes(data: bytes) -> tuple[int, int]:
    """Bytes in NMEA sentences, with what a host wrote before each, and in binary records (UBX, RTCM3); all checked."""
    from ingest.marine.scan import NMEA, NMEA_UNCHECKED, RTCM3, UBX, scan

    found = scan(np.frombuffer(data, np.uint8))
    size = found.end - found.prefix
    text, binary = (np.isin(found.kind, kinds) for kinds in ((NMEA, NMEA_UNCHECKED), (UBX, RTCM3)))
    return int(size[text].sum() + 2 * text.sum()), int(size[binary].sum())


def mavlink_bytes(data: bytes) -> int:
    """Bytes in MAVLink frames with a right checksum."""
    from ingest.mavlink.dialect import DEFAULT, load_dialect
    from ingest.mavlink.frames import scan

    table = scan(data, load_dialect(DEFAULT)).table
    return int((table["end"] - table["start"]).sum()) if len(table) > 1 else 0


def _nmea(data: bytes) -> int:
    text, binary = serial_bytes(data)
    return text + binary if text >= binary else 0


def _ubx(data: bytes) -> int:
    text, binary = serial_bytes(data)
    return text + binary if binary > text else 0


def _slcan(data: bytes) -> int:
    found = SLCAN_FRAME.findall(data)
    return sum(map(len, found)) if len(found) >= 3 else 0


def _imu(data: bytes) -> int:
    lines = [m.group() for m in NUMBERS.finditer(data)]
    return sum(map(len, lines)) if len(lines) >= 5 else 0


COVERED: dict[Protocol, Callable[[bytes], int]] = {
    Protocol.nmea: _nmea,
    Protocol.ubx: _ubx,
    Protocol.mavlink: mavlink_bytes,
    Protocol.slcan: _slcan,
    Protocol.imu: _imu,
}


def suspicion(data: bytes, baud: int) -> str | None:
    """What may be wrong with bytes that fit no protocol; None while there are too few to say.

    At a wrong line rate the bits of a byte are taken for others: text becomes bytes that are hardly ever
    printable, and few values come again and again.
    """
    if len(data) < SUSPICIOUS:
        return None
    counts = np.bincount(np.frombuffer(data[-WINDOW:], np.uint8), minlength=256)
    share = counts / counts.sum()
    printable = share[32:127].sum() + share[[9, 10, 13]].sum()
    if printable > 0.95:
        return "text in no known format; its bytes are kept"
    others = ", ".join(str(b) for b in USUAL_BAUD if b != baud)
    return f"the bytes fit no protocol; is {baud} the right baud rate? Others: {others}"
