"""CAN interfaces through python-can: SLCAN adapters on a serial port, SocketCAN and all that python-can knows.

An adapter is opened to listen only: nothing goes onto the bus. Of an SLCAN adapter the bytes are kept as they came; the
frames of other interfaces are written down in the same form, so that one decoder serves all, live and from the file.
"""

from __future__ import annotations

import re
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ingest.errors import UsageError, nearest
from seatrial.capture.device import WAIT_S, Device, Unplugged, reason

if TYPE_CHECKING:
    from can import BusABC, Message

#: How an interface of python-can is named as a port: its kind, and its channel.
NAMED = re.compile(r"^(?P<interface>[a-z_0-9]{3,}):(?P<channel>[^\\/][^\\]*)$")
#: Names that network interfaces of a CAN controller have.
SOCKET = re.compile(r"^[a-z]*can\d+$")
#: Where Linux lists its network interfaces.
NETWORK = Path("/sys/class/net")
#: What an adapter needs after its port was opened, s.
SETTLE_S = 0.2
#: Frames of one read at most.
MOST_FRAMES = 500


def interface_of(device: str) -> tuple[str, str] | None:
    """Kind and channel of the interface that a port's name means; None where it is a serial port."""
    named = NAMED.match(device)
    if named:
        return named["interface"], named["channel"]
    return ("socketcan", device) if SOCKET.match(device) and not Path(device).exists() else None


def check_interface(interface: str, channel: str) -> None:
    """Check that an interface is known and there, before anything is begun.

    Raises
    ------
    UsageError
    """
    import can

    if interface not in can.VALID_INTERFACES:
        near = nearest(interface, can.VALID_INTERFACES) or ["socketcan"]
        raise UsageError(f"{interface}:{channel}: no such kind of CAN interface. Did you mean '{near[0]}'?")
    if interface == "socketcan":
        check_socket(channel)


def check_socket(channel: str) -> None:
    """Check that the system has SocketCAN, and a network interface of that name which is up.

    Raises
    ------
    UsageError
    """
    if not hasattr(socket, "AF_CAN"):
        raise UsageError(f"{channel}: this system has no SocketCAN; use an SLCAN adapter (--protocol slcan).")
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        raise UsageError(
            f"{channel}: this kernel has no SocketCAN ({reason(error)}); load it with `sudo modprobe can can_raw`, or "
            "use an SLCAN adapter (--protocol slcan)."
        ) from error
    there = sorted(p.name for p in NETWORK.glob("*can*")) if NETWORK.is_dir() else []
    if channel not in there:
        known = f" There are: {', '.join(there)}." if there else " There is none at all."
        raise UsageError(f"{channel}: there is no such CAN interface.{known}")
    if (NETWORK / channel / "operstate").read_text().strip() == "down":
        cure = f"sudo ip link set {channel} up type can bitrate 250000"
        raise UsageError(f"{channel}: the interface is down; `{cure}`.")


@dataclass
class SlcanAdapter(Device):
    """An SLCAN adapter: opened by python-can, its bytes read as they come."""

    _bus: BusABC | None = None

    @classmethod
    def start(cls, device: str, baud: int, bitrate: int) -> SlcanAdapter:
        """Tell an adapter the bus's rate and to listen.

        Raises
        ------
        Unplugged
            It is not there, or does not take the rate.
        """
        import can
        from can.interfaces.slcan import slcanBus

        try:
            bus = slcanBus(
                device,
                tty_baudrate=baud,
                bitrate=bitrate,
                listen_only=True,
                sleep_after_open=SETTLE_S,
                timeout=WAIT_S,
            )
        except (can.CanError, OSError, ValueError) as error:
            raise Unplugged(reason(error)) from error
        return cls(bus.serialPortOrig, bus)

    def close(self) -> None:
        """Tell the adapter to stop, and let go of it; it may be gone already."""
        shut_down(self._bus)


@dataclass
class CanInterface:
    """An interface whose driver gives frames."""

    _bus: BusABC

    @classmethod
    def start(cls, interface: str, channel: str, bitrate: int) -> CanInterface:
        """Open an interface.

        Raises
        ------
        Unplugged
            It is not there, or its driver is not.
        """
        import can

        try:
            return cls(can.Bus(channel=channel, interface=interface, bitrate=bitrate))
        except (can.CanError, OSError, ValueError, ImportError) as error:
            raise Unplugged(reason(error)) from error

    def read(self) -> bytes:
        """The frames that have come, as lines of SLCAN; nothing after `WAIT_S` without one.

        Raises
        ------
        Unplugged
            The interface is gone.
        """
        import can

        lines: list[bytes] = []
        wait = WAIT_S
        try:
            while len(lines) < MOST_FRAMES and (message := self._bus.recv(wait)) is not None:
                lines.append(line_of(message))
                wait = 0.0
        except (can.CanError, OSError, ValueError) as error:
            if not lines:
                raise Unplugged(reason(error)) from error
        return b"".join(lines)

    def line_errors(self) -> dict[str, int]:
        """No counts: the driver keeps them."""
        return {}

    def close(self) -> None:
        """Let go of the interface; it may be gone already."""
        shut_down(self._bus)


def line_of(message: Message) -> bytes:
    """A data frame as a line of SLCAN; error frames and those of CAN FD are none."""
    if message.is_error_frame or message.is_fd:
        return b""
    kind = "r" if message.is_remote_frame else "t"
    number = message.arbitration_id
    head = f"{kind.upper()}{number:08X}" if message.is_extended_id else f"{kind}{number:03X}"
    data = "" if message.is_remote_frame else bytes(message.data).hex().upper()
    return f"{head}{message.dlc:X}{data}\r".encode()


def shut_down(bus: Any) -> None:
    """Close a bus of python-can, whatever state it is in."""
    import can

    try:
        bus.shutdown()
    except (can.CanError, OSError, TypeError, ValueError):
        return
