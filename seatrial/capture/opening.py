"""From a port's settings to what can be read: a serial port, an SLCAN adapter, or another CAN interface."""

from __future__ import annotations

from typing import Protocol as Shape

from seatrial.capture.autopilot import AutopilotDevice
from seatrial.capture.device import Device, check_device
from seatrial.capture.settings import PortSettings, Protocol


class Port(Shape):
    """An open port."""

    def read(self) -> bytes:
        """What has arrived; nothing where nothing came for a while. Raises `Unplugged` where the port is gone."""

    def line_errors(self) -> dict[str, int]:
        """Errors that were counted so far."""

    def close(self) -> None:
        """Let go of it."""


def open_port(settings: PortSettings) -> Port:
    """Open a port.

    Raises
    ------
    Unplugged
        It is not there, or cannot be opened.
    """
    from seatrial.capture.can_device import CanInterface, SlcanAdapter, interface_of

    interface = interface_of(settings.device)
    if interface is not None:
        return CanInterface.start(*interface, settings.bitrate)
    if settings.protocol is Protocol.slcan:
        return SlcanAdapter.start(settings.device, settings.baud, settings.bitrate)
    kind = AutopilotDevice if settings.heartbeat else Device
    return kind.open(settings.device, settings.baud)


def check_port(settings: PortSettings) -> None:
    """Check that a port is there and may be read, before anything is begun.

    Raises
    ------
    UsageError
    """
    from seatrial.capture.can_device import check_interface, interface_of

    interface = interface_of(settings.device)
    if interface is not None:
        check_interface(*interface)
        return
    check_device(settings.device, settings.baud)
