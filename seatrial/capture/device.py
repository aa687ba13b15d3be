"""A serial device that is only ever read."""

from __future__ import annotations

import errno
import os
import select
import stat
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ingest.errors import UsageError, nearest

#: The most that one read takes.
MOST = 1 << 16
#: How long a read waits for the first byte; a capture ends within this time of being told to, s.
WAIT_S = 0.1
#: Linux's request for the counts of framing, overrun, parity and buffer errors of a UART.
_TIOCGICOUNT = 0x545D
_COUNTS = ("framing errors", "overruns", "parity errors", "breaks", "buffer overruns")


class Unplugged(Exception):
    """The device is gone."""


@dataclass
class Device:
    """An open serial port. It has no way to send."""

    _port: Any

    @classmethod
    def open(cls, device: str, baud: int) -> Device:
        """Open a device for this program alone, eight bits, no parity, no flow control.

        Raises
        ------
        Unplugged
            It is not there, or cannot be opened.
        """
        import serial

        try:
            port = serial.Serial(device, baud, timeout=WAIT_S, exclusive=True if os.name == "posix" else None)
        except (serial.SerialException, OSError, ValueError) as error:
            raise Unplugged(reason(error)) from error
        return cls(port)

    def read(self) -> bytes:
        """What has arrived, as soon as there is any; nothing after `WAIT_S` without a byte.

        Raises
        ------
        Unplugged
            The device is gone.
        """
        try:
            return self._read_descriptor() if os.name == "posix" else self._read_port()
        except (OSError, TypeError, ValueError) as error:
            raise Unplugged(reason(error)) from error

    def _read_descriptor(self) -> bytes:
        """Take one read of all that waits: nothing that was taken can be lost to an error after it."""
        descriptor = self._port.fileno()
        ready, _, _ = select.select([descriptor], [], [], WAIT_S)
        if not ready:
            return b""
        try:
            data = os.read(descriptor, MOST)
        except BlockingIOError:
            return b""
        if not data:
            raise Unplugged("the line was hung up")
        return data

    def _read_port(self) -> bytes:
        return bytes(self._port.read(max(1, min(MOST, self._port.in_waiting))))

    def line_errors(self) -> dict[str, int]:
        """Errors that the UART has counted; empty where the driver counts none."""
        if os.name != "posix":
            return {}
        import fcntl

        try:
            raw = fcntl.ioctl(self._port.fileno(), _TIOCGICOUNT, bytes(80))
        except (OSError, ValueError):
            return {}
        _, _, _, _, _, _, frame, overrun, parity, breaks, buffer = struct.unpack_from("11i", raw)
        return dict(zip(_COUNTS, (frame, overrun, parity, breaks, buffer), strict=True))

    def close(self) -> None:
        """Let go of the device; it may be gone already."""
        try:
            self._port.close()
        except OSError:
            self._port = None


def reason(error: BaseException) -> str:
    """Why a device failed, in a few words."""
    number = getattr(error, "errno", None)
    if number is not None:
        return os.strerror(number).lower() if number != errno.EIO else "the line was hung up"
    return str(error).rstrip(".") or type(error).__name__


def check_device(device: str, baud: int) -> None:
    """Check that a device is there and may be read, before anything is begun.

    Raises
    ------
    UsageError
        It is not there, is no device, may not be opened, or the line rate is impossible.
    """
    if not 50 <= baud <= 50_000_000:
        raise UsageError(f"{device}: expected a line rate from 50 to 50,000,000 bit/s, found {baud}.")
    if os.name != "posix":
        return
    path = Path(device)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError as error:
        raise UsageError(f"{device}: no such port.{near_ports(path)}") from error
    except OSError as error:
        raise UsageError(f"{device}: {reason(error)}.") from error
    if not stat.S_ISCHR(mode):
        raise UsageError(
            f"{device}: expected a serial port, found {'a folder' if path.is_dir() else 'a file'}."
        )
    if not os.access(path, os.R_OK | os.W_OK):
        raise UsageError(f"{device}: no permission to open this port. {permission_cure(path)}")


def near_ports(path: Path) -> str:
    """The ports that are there, those with a similar name first."""
    from serial.tools import list_ports

    there = [p.device for p in list_ports.comports()]
    if not there:
        return " No serial port is plugged in."
    return f" There are: {', '.join((nearest(str(path), there) or there)[:5])}."


def permission_cure(path: Path) -> str:
    """What to do where the port belongs to a group that the user is not in."""
    try:
        group = path.group()
    except (KeyError, OSError, NotImplementedError):
        return "Ask for the right to read it."
    return f"Join its group: `sudo usermod -aG {group} $USER`, then log in again."
