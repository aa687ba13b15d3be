"""A serial device that does not wait: records on a pseudo terminal at the pace of the line.

What finds no room, because the reader was late, is refused and counted; a real line would have lost it. What was
taken is known by its number and its digest.

    python -m benchmarks.serial_line LINK --baud 921600 --protocol ubx --seconds 600
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import pty
import select
import struct
import time
import tty
from dataclasses import dataclass, field
from pathlib import Path

#: Bytes of records that are made ahead, and sent over and over.
BLOCK = 1 << 17
#: Bits on the line per byte: start, eight, stop.
BITS = 10
TICK_S = 0.002
#: A generator that was not given the processor for longer goes on as if the line had been idle, s: a line has no
#: bursts, and those would say nothing about the reader.
BURST_S = 0.02


def nmea(text: str) -> bytes:
    """A sentence with its checksum."""
    total = 0
    for c in text.encode():
        total ^= c
    return f"${text}*{total:02X}\r\n".encode()


def ubx(kind: int, number: int, payload: bytes) -> bytes:
    """A UBX frame with its checksum (Fletcher, 8 bit)."""
    body = struct.pack("<BBH", kind, number, len(payload)) + payload
    a = b = 0
    for c in body:
        a = (a + c) & 0xFF
        b = (b + a) & 0xFF
    return b"\xb5\x62" + body + bytes((a, b))


def nmea_record(i: int) -> bytes:
    """Position, heading, turn rate and rudder of moment ``i``."""
    s = i / 10.0
    clock = f"{int(s // 3600) % 24:02d}{int(s // 60) % 60:02d}{s % 60:05.2f}"
    return b"".join(
        (
            nmea(
                f"GPGGA,{clock},5130.{1000 + i % 8000:04d},N,00012.{i % 9000:04d},E,4,12,0.8,5.0,M,45.0,M,,"
            ),
            nmea(f"HEHDT,{i % 3600 / 10:.1f},T"),
            nmea(f"HEROT,{i % 200 / 10 - 10:.1f},A"),
            nmea(f"IIRSA,{i % 70 - 35:.1f},A,,V"),
        )
    )


def ubx_record(i: int) -> bytes:
    """NAV-PVT of moment ``i``."""
    second, tenth = i // 10, i % 10
    clock = (2026, 6, 1, second // 3600 % 24, second // 60 % 60, second % 60)
    payload = struct.pack("<IHBBBBBBIiBBBB", i * 100, *clock, 7, 20, tenth * 100_000_000, 3, 1, 0, 12)
    payload += struct.pack("<iiiiII", 120_000 + i, 515_000_000 + i, 50_000, 5_000, 12, 20)
    payload += struct.pack("<iiiiiIIHH", 1000, 10 * (i % 50), 0, 1000, 100 * (i % 3600), 50, 3000, 120, 0)
    return ubx(1, 7, payload.ljust(92, b"\0"))


def mixed_record(i: int) -> bytes:
    """Both, as receivers send them."""
    return nmea_record(i) + ubx_record(i)


def imu_record(i: int) -> bytes:
    """A line of angles."""
    return f"#YPR={i % 3600 / 10 - 180:.2f},{i % 40 / 10 - 2:.2f},{i % 30 / 10 - 1.5:.2f}\r\n".encode()


def slcan_record(i: int) -> bytes:
    """Vessel heading (PGN 127250) from address 36, as an adapter for CAN writes it."""
    payload = struct.pack("<BHhhB", i % 253, i * 10 % 62_831, 0, 0, 0xFC)
    return b"T09F112248" + payload.hex().upper().encode() + b"\r"


def mavlink_record(i: int) -> bytes:
    """ATTITUDE and GPS_RAW_INT, MAVLink 2."""
    from pymavlink.dialects.v20 import common

    sender = common.MAVLink(None, srcSystem=1, srcComponent=1)
    sender.seq = 2 * i % 256
    angle = i % 628 / 100 - 3.14
    attitude = common.MAVLink_attitude_message(i * 20, 0.01, 0.02, angle, 0.0, 0.0, 0.05)
    place = common.MAVLink_gps_raw_int_message(
        i * 20_000, 3, 515_000_000 + i, 120_000 + i, 0, 80, 80, 150, 0, 12
    )
    first = bytes(attitude.pack(sender))
    sender.seq = (2 * i + 1) % 256
    return first + bytes(place.pack(sender))


RECORDS = {
    "nmea": nmea_record,
    "ubx": ubx_record,
    "mixed": mixed_record,
    "imu": imu_record,
    "mavlink": mavlink_record,
    "slcan": slcan_record,
}


def block_of(protocol: str, size: int = BLOCK) -> bytes:
    """Records of a protocol, at least ``size`` bytes of them."""
    make, parts, done, i = RECORDS[protocol], [], 0, 0
    while done < size:
        parts.append(make(i))
        done += len(parts[-1])
        i += 1
    return b"".join(parts)


@dataclass
class SerialLine:
    """A device on a pseudo terminal.

    Attributes
    ----------
    link : Path
        Path that a reader opens.
    sent, refused : int
        Bytes that went onto the line, and that there was no room for.
    held_up_s : float
        How long the generator itself was not given the processor.
    """

    link: Path
    sent: int = 0
    refused: int = 0
    held_up_s: float = 0.0
    _digest: hashlib._Hash = field(default_factory=hashlib.sha256, repr=False)

    def __post_init__(self) -> None:
        self.plug()

    def plug(self) -> None:
        """Make the device."""
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        name = os.ttyname(slave)
        os.close(slave)
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(name)

    def unplug(self) -> None:
        """Take the device away."""
        self.link.unlink(missing_ok=True)
        os.close(self.master)

    def write(self, data: bytes) -> int:
        """Send without waiting; how many bytes were taken."""
        try:
            done = os.write(self.master, data)
        except OSError:
            done = 0
        self._digest.update(data[:done])
        self.sent += done
        self.refused += len(data) - done
        return done

    def wait_for_reader(self, patience_s: float = 30.0) -> None:
        """Wait until somebody has opened the device, and thrown away what was in it."""
        poller = select.poll()
        poller.register(self.master, 0)
        end = time.monotonic() + patience_s
        while time.monotonic() < end and any(e & select.POLLHUP for _, e in poller.poll(0)):
            time.sleep(0.01)
        time.sleep(0.3)

    def received(self) -> bytes:
        """What somebody has sent to the device."""
        try:
            return os.read(self.master, 4096)
        except OSError:
            return b""

    @property
    def digest(self) -> str:
        """SHA-256 of what was taken."""
        return self._digest.hexdigest()


def pace(line: SerialLine, block: bytes, baud: int, seconds: float) -> None:
    """Send the block over and over for so many seconds, as fast as the line allows and no faster."""
    began = time.monotonic()
    due = 0
    most = int(BURST_S * baud / BITS)
    while (elapsed := time.monotonic() - began) < seconds:
        now_due = int(elapsed * baud / BITS)
        if now_due - due > most:
            began += (now_due - due - most) * BITS / baud
            line.held_up_s += (now_due - due - most) * BITS / baud
            now_due = due + most
        while due < now_due:
            at = due % len(block)
            part = block[at : at + min(now_due - due, 4096)]
            line.write(part)
            due += len(part)
        time.sleep(TICK_S)


def main() -> None:
    """Be a device; print what happened as JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("link", type=Path)
    parser.add_argument("--baud", type=int, default=921_600)
    parser.add_argument("--protocol", choices=sorted(RECORDS), default="nmea")
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args()
    block = block_of(options.protocol)
    line = SerialLine(options.link)
    line.wait_for_reader()
    pace(line, block, options.baud, options.seconds)
    time.sleep(3.0)
    answer = {
        "link": str(line.link),
        "sent": line.sent,
        "refused": line.refused,
        "held_up_s": round(line.held_up_s, 3),
        "digest": line.digest,
        "talked_to": len(line.received()),
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
