"""A port of an autopilot that sends its streams only while it hears a ground station: told so once a second."""

from __future__ import annotations

import os
import struct
import time
from contextlib import suppress
from dataclasses import dataclass

from seatrial.capture.device import Device

#: How often, s.
EVERY_S = 1.0
#: Who we are: a ground station's usual system, and a component that is none of the known programs.
SYSTEM, COMPONENT = 255, 190
#: HEARTBEAT: number, and the checksum's seed of its fields; ground station, no autopilot, active, MAVLink 2.
_NUMBER, _EXTRA = 0, 50
_PAYLOAD = struct.pack("<IBBBBB", 0, 6, 8, 0, 4, 3)


@dataclass
class AutopilotDevice(Device):
    """A device that is told once a second that somebody listens; nothing else is ever sent."""

    _due: float = 0.0
    _count: int = 0

    def read(self) -> bytes:
        """As of any device; a heartbeat goes out before it where one is due."""
        if time.monotonic() >= self._due:
            self._due = time.monotonic() + EVERY_S
            self._beat()
        return super().read()

    def _beat(self) -> None:
        """Send without waiting; where the line is full or gone, the read that follows will see."""
        with suppress(OSError, TypeError, ValueError):
            os.write(self._port.fileno(), heartbeat(self._count))
        self._count += 1


def heartbeat(count: int) -> bytes:
    """The HEARTBEAT of a ground station as a MAVLink 2 frame (https://mavlink.io/en/guide/serialization.html)."""
    head = struct.pack("<BBBBBB", len(_PAYLOAD), 0, 0, count & 0xFF, SYSTEM, COMPONENT)
    body = head + _NUMBER.to_bytes(3, "little") + _PAYLOAD
    return b"\xfd" + body + checksum(body + bytes([_EXTRA])).to_bytes(2, "little")


def checksum(data: bytes) -> int:
    """CRC-16/MCRF4XX of MAVLink."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc
