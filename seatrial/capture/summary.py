"""What a capture was, in a few lines, and whether it is to be trusted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from seatrial.capture.decoder_process import LiveStats
from seatrial.capture.settings import PortSettings, Protocol


@dataclass(frozen=True)
class PortSummary:
    """One port: what it spoke, and how much."""

    settings: PortSettings
    protocol: Protocol
    bytes: int
    records: int
    damaged: int
    unplugged: int
    line_errors: dict[str, int] = field(default_factory=dict)

    def line(self, seconds: float) -> str:
        """One line for a person."""
        if not self.bytes:
            return f"{self.settings.name}: no byte came"
        parts = [f"{self.bytes:,} bytes ({self.bytes / max(seconds, 1e-9):,.0f}/s)"]
        parts.append("protocol not recognised" if self.protocol is Protocol.auto else self.protocol.value)
        if self.records:
            parts.append(f"{self.records:,} records")
        if self.damaged:
            parts.append(f"{self.damaged:,} damaged bytes ({self.damaged / self.bytes:.2%})")
        if self.unplugged:
            parts.append(f"unplugged {self.unplugged} time{'s' if self.unplugged > 1 else ''}")
        parts += [f"{n:,} {kind}" for kind, n in self.line_errors.items()]
        return f"{self.settings.name}: {', '.join(parts)}"


@dataclass(frozen=True)
class Summary:
    """A capture that has ended.

    Attributes
    ----------
    seconds : float
    ports : tuple of PortSummary
    files : tuple of (Path, int)
        With their sizes, bytes.
    lost_bytes, lost_messages : int
        What arrived, or was decoded, and could not be written.
    undecoded : int
        Bytes that are in the file, but not in decoded channels.
    trouble : str
        Why the file could not be written to the end; empty where it was.
    live : LiveStats, optional
        How the live view did.
    online : tuple of str
        What was identified, a line each.
    """

    seconds: float
    ports: tuple[PortSummary, ...]
    files: tuple[tuple[Path, int], ...]
    lost_bytes: int
    lost_messages: int
    undecoded: int
    trouble: str
    live: LiveStats | None = None
    online: tuple[str, ...] = ()

    @property
    def faults(self) -> tuple[str, ...]:
        """What makes the exit status 1."""
        return tuple(self._faults())

    def _faults(self) -> Iterator[str]:
        if self.lost_bytes:
            yield f"{self.lost_bytes:,} bytes that arrived could not be written"
        if self.trouble:
            yield f"the file could not be completed ({self.trouble}); `seatrial recover` mends it"
        if not any(p.bytes for p in self.ports):
            yield "no byte came from any port"

    def lines(self) -> Iterator[str]:
        """The summary as a person reads it."""
        yield f"captured {self.seconds:.1f} s"
        for port in self.ports:
            yield f"  {port.line(self.seconds)}"
        if self.undecoded:
            yield f"  {self.undecoded:,} bytes were not decoded while capturing; they are kept, and read with the file"
        if self.lost_messages:
            yield f"  {self.lost_messages:,} decoded messages were not written; the bytes that they came from were"
        if self.live:
            median, most, worst = (1e3 * v for v in self.live.latency_s)
            yield f"  live view: {median:.0f} ms after arrival, 99 % within {most:.0f} ms, at worst {worst:.0f} ms"
        yield from (f"  {line}" for line in self.online)
        for path, size in self.files:
            yield f"  {path} ({size / 1e6:.2f} MB)"
