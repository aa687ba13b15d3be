"""Live capture from serial ports: every byte kept, crash-safe, with decoded channels beside it."""

from seatrial.capture.settings import CaptureSettings, PortSettings

__all__ = ["CaptureSettings", "PortSettings"]
