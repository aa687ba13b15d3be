"""What a capture is told: its ports, its file, when to rotate and when to stop."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

#: Bytes that arrived are in the file after at most so many seconds; 0.5 s is what is promised.
FLUSH_S = 0.2
#: A chunk is written earlier when so many bytes have come together.
FLUSH_BYTES = 1 << 18
#: Bit rate of NMEA 2000.
BITRATE = 250_000


class Protocol(StrEnum):
    """What a port speaks; ``auto`` finds out from the bytes, ``raw`` does not decode."""

    auto = "auto"
    nmea = "nmea"
    ubx = "ubx"
    mavlink = "mavlink"
    slcan = "slcan"
    imu = "imu"
    raw = "raw"


@dataclass(frozen=True)
class PortSettings:
    """One port.

    Attributes
    ----------
    device : str
        Path or name of the device.
    baud : int
        Line rate, bit/s.
    protocol : Protocol
    name : str
        Names its channels: ``/raw/NAME``, ``/NAME/TOPIC``.
    bitrate : int
        Of the bus behind a CAN adapter, bit/s.
    heartbeat : bool
        Whether an autopilot is told once a second that somebody listens.
    """

    device: str
    baud: int
    protocol: Protocol = Protocol.auto
    name: str = ""
    bitrate: int = BITRATE
    heartbeat: bool = False

    @property
    def raw_topic(self) -> str:
        """Topic of the channel that holds the bytes."""
        return f"/raw/{self.name}"


@dataclass(frozen=True)
class CaptureSettings:
    """A capture.

    Attributes
    ----------
    ports : tuple of PortSettings
    out : Path
        The file; ``{utc}`` in its name becomes the time at which it was begun.
    rotate_bytes, rotate_s : float
        Size and age at which the next file is begun; infinite: never.
    duration_s : float
        The capture ends after so many seconds.
    mute_s : float
        A port that says nothing for so many seconds is called mute.
    decode, live : bool
        Whether to write decoded channels, and to show them as they come.
    campaign : Path, optional
        Of the vessel, whose model is then identified meanwhile.
    state : Path, optional
        Where the state of the identification is kept, and taken up from.
    forget_s : float
        Time constant with which the identification forgets; infinite: never.
    """

    ports: tuple[PortSettings, ...]
    out: Path
    rotate_bytes: float = float("inf")
    rotate_s: float = float("inf")
    duration_s: float = float("inf")
    mute_s: float = 5.0
    decode: bool = True
    live: bool = False
    campaign: Path | None = None
    state: Path | None = None
    forget_s: float = float("inf")
    flush_s: float = field(default=FLUSH_S)

    @property
    def rotates(self) -> bool:
        """Whether there may be more than one file."""
        return min(self.rotate_bytes, self.rotate_s) < float("inf")
