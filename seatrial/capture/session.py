"""A capture from beginning to end: readers, decoders and files, tied together by one loop."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from seatrial.capture.channel_messages import (
    EVENTS,
    Encoded,
    event_message,
    status_channel,
    status_message,
)
from seatrial.capture.clocks import HostClock
from seatrial.capture.decoder_process import DecoderProcess, LiveWanted
from seatrial.capture.events import Event, Events, Level
from seatrial.capture.file_series import FileSeries
from seatrial.capture.live_decoding import Outcome
from seatrial.capture.port_reader import Piece, PortReader
from seatrial.capture.priority import young_garbage
from seatrial.capture.recording_file import Message
from seatrial.capture.records import ChannelSpec
from seatrial.capture.settings import FLUSH_BYTES, CaptureSettings, PortSettings, Protocol
from seatrial.capture.summary import PortSummary, Summary
from seatrial.capture.viewer_process import Viewer

if TYPE_CHECKING:
    from seatrial.online.side import OnlineSide

#: How often pieces are collected, and how often counts are written, s.
TICK_S, STATUS_S = 0.08, 1.0
#: The same where somebody watches, s.
LIVE_TICK_S = 0.03
#: How long the decoders may be silent over what waits when the capture ends, s: they yield to everybody, and on a busy
#: machine get little.
PATIENCE_S = 30.0
#: How long the identification may take for what waits, and for its last word, s.
ONLINE_PATIENCE_S = 60.0


@dataclass
class Port:
    """One port of a capture: its reader, and what the decoders said of it."""

    settings: PortSettings
    reader: PortReader
    channel: ChannelSpec
    protocol: Protocol
    records: int = 0
    damaged: int = 0
    told_bytes: int = field(default=0, repr=False)


class Session:
    """A capture.

    Parameters
    ----------
    settings : CaptureSettings
    listener : callable
        Is told every event, from any thread.
    """

    def __init__(self, settings: CaptureSettings, listener: Callable[[Event], None]) -> None:
        self.settings = settings
        self.clock = HostClock()
        self.events = Events(self.clock, listener)
        self.files = FileSeries(settings)
        self.viewer = Viewer.start() if settings.live else None
        self.live = self._live()
        self.online = self._online()
        self.decoders = self._decoders()
        self.ports = [self._port(p) for p in settings.ports]
        self._pending: list[Message] = []
        self._pending_bytes = 0
        self._written_at = self._status_at = time.monotonic()
        self._said_trouble = ""
        self._undecoded = 0

    def run(self, stop: threading.Event) -> Summary:
        """Capture until ``stop`` is set or the time is up.

        Returns
        -------
        Summary
            What was captured, and what went wrong.
        """
        began = time.monotonic()
        for port in self.ports:
            port.reader.start()
        try:
            while (
                not stop.wait(LIVE_TICK_S if self.live else TICK_S)
                and time.monotonic() - began < self.settings.duration_s
            ):
                self._tick()
        finally:
            seconds = time.monotonic() - began
            self._end()
        return self._summary(seconds)

    def _decoders(self) -> DecoderProcess | None:
        if not (self.settings.decode or self.live or self.online):
            return None
        found = DecoderProcess(self.settings.ports, self.live, self.online.feed if self.online else None)
        if self.online is not None:
            self.online.feed.close()
        return found

    def _live(self) -> LiveWanted | None:
        if self.viewer is None:
            return None
        name = self.settings.out.stem
        online = self.settings.campaign is not None
        return LiveWanted(name, self.viewer.address, f"{name}-{time.time_ns()}", online)

    def _online(self) -> OnlineSide | None:
        if self.settings.campaign is None:
            return None
        from seatrial.online.side import OnlineSide

        return OnlineSide.of(self.settings, self.files.paths[0], self.live)

    def _port(self, settings: PortSettings) -> Port:
        reader = PortReader(settings, self.clock, self.events, self.settings.mute_s)
        return Port(settings, reader, raw_channel(settings, self.clock), settings.protocol)

    def _tick(self) -> None:
        self._collect()
        now = time.monotonic()
        if now - self._status_at >= STATUS_S:
            self._status(now - self._status_at)
            self._status_at = now
        if now - self._written_at >= self.settings.flush_s or self._pending_bytes >= FLUSH_BYTES:
            self._written_at = now
            self._write()

    def _collect(self) -> None:
        """Take what the readers have read and what the decoders have decoded."""
        batch = []
        for index, port in enumerate(self.ports):
            pieces = port.reader.take()
            if pieces:
                batch.append((index, [(p.stamp.log_ns, p.data) for p in pieces]))
                self._take_pieces(port, pieces)
        if self.decoders is None:
            if self.settings.decode:
                self._undecoded += sum(len(data) for _, pieces in batch for _, data in pieces)
            return
        if batch:
            self.decoders.put(batch)
        for index, outcome in self.decoders.take():
            self._take_outcome(self.ports[index], outcome)
        if self.online is not None:
            self._pending += self.online.take(self.events)

    def _take_pieces(self, port: Port, pieces: list[Piece]) -> None:
        self._pending += [Message(port.channel, p.stamp.log_ns, p.stamp.wall_ns, p.data) for p in pieces]
        self._pending_bytes += sum(len(p.data) for p in pieces)

    def _take_outcome(self, port: Port, outcome: Outcome) -> None:
        port.records += outcome.records
        port.damaged += outcome.damaged
        for remark in outcome.remarks:
            self.events.tell(port.settings.name, remark, Level.warning)
        if outcome.protocol is not None:
            self._speaks(port, outcome.protocol)
        if self.settings.decode:
            for encoded in outcome.messages:
                self._pending += decoded_messages(encoded)

    def _speaks(self, port: Port, protocol: Protocol) -> None:
        """From now on the port's channel names its protocol; an empty piece says so even if nothing follows."""
        port.protocol = protocol
        port.channel = raw_channel(replace(port.settings, protocol=protocol), self.clock)
        self._pending.append(Message(port.channel, *self.clock.stamp(), b""))
        self.events.tell(port.settings.name, f"speaks {SPOKEN[protocol]}")

    def _status(self, elapsed: float) -> None:
        step = self.clock.stepped()
        if step:
            text = f"the host's clock was set by {step * 1e-9:+.3f} s; the record goes on without a step"
            self.events.tell("", text, Level.warning)
        stamp = self.clock.stamp()
        for port in self.ports:
            state = port.reader.state
            rate = (state.bytes - port.told_bytes) / elapsed
            age = (stamp.log_ns - state.last_ns) * 1e-9 if state.last_ns else float("nan")
            values = (state.bytes, rate, port.records, port.damaged, age, state.open)
            port.told_bytes = state.bytes
            channel = status_channel(port.settings.name)
            self._pending.append(Message(channel, stamp.log_ns, stamp.wall_ns, status_message(values)))
        self._check_decoders()
        young_garbage()

    def _check_decoders(self) -> None:
        if self.decoders is not None and self.decoders.failed:
            self.decoders.close(0.0)
            self._undecoded += self.decoders.undecoded
            self.decoders = None
            text = "the decoders have ended unexpectedly; the bytes of all ports are still kept"
            self.events.tell("", text, Level.error)

    def _write(self) -> None:
        while self.events.pending:
            event = self.events.pending.popleft()
            body = event_message(event.stamp.wall_ns, event.level, event.port or "capture", event.text)
            self._pending.append(Message(EVENTS, event.stamp.log_ns, event.stamp.wall_ns, body))
        self.files.write(self._pending)
        self._pending, self._pending_bytes = [], 0
        self._tell_trouble()

    def _tell_trouble(self) -> None:
        trouble = self.files.trouble
        if trouble and not self._said_trouble:
            text = f"nothing can be written ({trouble}); what arrives is held in memory, trying again"
            self.events.tell("", text, Level.error)
        elif self._said_trouble and not trouble:
            self.events.tell("", "writing again; what was held is in the file")
        self._said_trouble = trouble

    def _end(self) -> None:
        """Read what has come, decode what waits, write everything."""
        for port in self.ports:
            port.reader.halt()
        for port in self.ports:
            port.reader.join(2.0)
        self._collect()
        self._write()
        if self.decoders is not None:
            self.decoders.close(PATIENCE_S)
            if self.online is not None:
                self.online.close(ONLINE_PATIENCE_S)
            self._collect()
        self._status(max(time.monotonic() - self._status_at, 1e-3))
        self._write()
        self.files.finish()
        if self.viewer is not None:
            self.viewer.close()

    def _summary(self, seconds: float) -> Summary:
        return Summary(
            seconds,
            tuple(
                PortSummary(
                    p.settings, p.protocol, p.reader.state.bytes, p.records, p.damaged,
                    p.reader.state.unplugged, dict(p.reader.state.line_errors),
                )
                for p in self.ports
            ),
            tuple((p, p.stat().st_size if p.exists() else 0) for p in self.files.paths),
            self.files.lost_bytes,
            self.files.lost_messages,
            self._undecoded + (self.decoders.undecoded if self.decoders else 0),
            self.files.trouble,
            self.decoders.live_stats if self.decoders else None,
            self.online.lines if self.online else (),
        )  # fmt: skip


SPOKEN = {
    Protocol.nmea: "NMEA 0183",
    Protocol.ubx: "UBX",
    Protocol.mavlink: "MAVLink",
    Protocol.slcan: "SLCAN",
    Protocol.imu: "text of an inertial sensor",
}


def raw_channel(settings: PortSettings, clock: HostClock) -> ChannelSpec:
    """The channel of a port's bytes; its metadata say how to read them and what its times are."""
    facts = {
        "protocol": settings.protocol.value,
        "device": settings.device,
        "baud": str(settings.baud),
        "log_time": "UTC when the capture began + monotonic time since",
        "publish_time": "UTC by the host's clock at arrival",
        "utc_ns": str(clock.utc_ns),
        "monotonic_ns": str(clock.monotonic_ns),
    }
    return ChannelSpec(settings.raw_topic, "raw", metadata=tuple(facts.items()))


def decoded_messages(encoded: Encoded) -> list[Message]:
    """Messages of a decoded channel, at the time at which their bytes arrived."""
    pairs = zip(encoded.times, encoded.payloads, strict=True)
    return [Message(encoded.channel, time_ns, time_ns, payload) for time_ns, payload in pairs]
