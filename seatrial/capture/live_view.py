"""What comes in, in Rerun while it comes: the track, the signals, rates, damage, and how old each sensor is."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from seatrial.capture.decoders import Tables
from seatrial.capture.live_signals import Sample, Track, samples_of
from seatrial.capture.settings import PortSettings
from seatrial.capture.viewer_process import wait_for

if TYPE_CHECKING:
    import rerun as rr

    from seatrial.capture.decoder_process import LiveWanted

#: Batches that may wait for the viewer; what comes on top is not shown.
MOST_WAITING = 64
#: How often the table of rates is renewed, and the track drawn, s.
TABLE_S, TRACK_S = 1.0, 0.15
#: Batches that are sent together when the viewer is behind, and how long one may take to reach it, s.
MOST_TOGETHER, FLUSH_S = 16, 1.0
SPAN_S = 120.0


@dataclass
class Seen:
    """What has been seen of one topic."""

    count: int = 0
    last_ns: int = 0
    recent: deque[tuple[float, int]] = field(default_factory=lambda: deque(maxlen=50))

    def rate(self, now: float) -> float:
        """Records per second lately."""
        if not self.recent or now - self.recent[0][0] <= 0:
            return 0.0
        return sum(n for _, n in self.recent) / max(now - self.recent[0][0], 1.0)


class LiveView:
    """Sends decoded tables to a viewer, from a thread of its own.

    Parameters
    ----------
    name : str
        Of the capture.
    ports : tuple of PortSettings
    recording : RecordingStream
        Where to.
    online : bool
        Whether an identification is sent to the same place.

    Attributes
    ----------
    latency_s : deque of float
        From the arrival of a batch's last byte until the viewer had it; what came before it was open, not counted.
    not_shown : int
        Batches that were dropped because the viewer was behind.
    """

    def __init__(
        self,
        name: str,
        ports: tuple[PortSettings, ...],
        recording: rr.RecordingStream,
        *,
        online: bool = False,
    ) -> None:
        from seatrial.capture.live_layout import blueprint

        self.name, self.recording = name, recording
        self.latency_s: deque[float] = deque(maxlen=10_000)
        self.not_shown = 0
        self._origin_ns = time.time_ns()
        self._seen: dict[tuple[str, str], Seen] = {}
        self._damaged: dict[str, int] = {p.name: 0 for p in ports}
        self._styled: set[str] = set()
        self._track = Track()
        self._table_at = self._track_at = 0.0
        self._queue: queue.Queue[tuple[str, Tables] | None] = queue.Queue(MOST_WAITING)
        recording.send_blueprint(blueprint(name, SPAN_S, online=online))
        self._thread = threading.Thread(target=self._serve, daemon=True, name="live view")
        self._thread.start()

    @classmethod
    def open(cls, live: LiveWanted, ports: tuple[PortSettings, ...]) -> LiveView:
        """Send to the viewer of a capture, when it is there."""
        import rerun as rr

        from validate.recording.entities import APPLICATION

        wait_for(live.address)
        prompt = rr.ChunkBatcherConfig.LOW_LATENCY()
        recording = rr.RecordingStream(APPLICATION, recording_id=live.recording_id, batcher_config=prompt)
        recording.connect_grpc(f"rerun+http://127.0.0.1:{live.address}/proxy")
        return cls(live.name, ports, recording, online=live.online)

    def show(self, port: str, tables: Tables) -> None:
        """Hand a batch over, without waiting."""
        try:
            self._queue.put_nowait((port, tables))
        except queue.Full:
            self.not_shown += 1

    def close(self) -> None:
        """Send what waits."""
        with suppress(queue.Full):
            self._queue.put(None, timeout=2.0)
            self._thread.join(2.0)
        self.recording.disconnect()

    def latencies_s(self) -> tuple[float, float, float]:
        """Median, 99th percentile and worst of the times from arrival to the viewer."""
        if not self.latency_s:
            return float("nan"), float("nan"), float("nan")
        median, most, worst = np.percentile(np.array(self.latency_s), [50, 99, 100]).tolist()
        return median, most, worst

    def _serve(self) -> None:
        while True:
            try:
                batch = self._queue.get(timeout=TABLE_S)
            except queue.Empty:
                self._table()
                continue
            if batch is None:
                break
            self._send_all([batch])
            if time.monotonic() - self._table_at >= TABLE_S:
                self._table()
        self._table()
        self.recording.flush()

    def _send_all(self, batches: list[tuple[str, Tables]]) -> None:
        """Send a batch and those that wait behind it; they are with the viewer when this returns."""
        with suppress(queue.Empty):
            while len(batches) < MOST_TOGETHER and (more := self._queue.get_nowait()) is not None:
                batches.append(more)
            if len(batches) < MOST_TOGETHER:
                self._queue.put_nowait(None)
        arrived = [self._send(port, tables) for port, tables in batches]
        self.recording.flush(timeout_sec=FLUSH_S)
        now = time.time_ns()
        self.latency_s.extend((now - last) * 1e-9 for last in arrived if last >= self._origin_ns)

    def _send(self, port: str, tables: Tables) -> int:
        """Send a batch; when its last byte arrived, ns (0: it is empty)."""
        now, last = time.monotonic(), 0
        self._damaged[port] = self._damaged.get(port, 0) + tables.damaged
        for topic, table in tables.tables.items():
            seen = self._seen.setdefault((port, topic), Seen())
            seen.count += len(table)
            seen.last_ns = int(table.index[-1])
            seen.recent.append((now, len(table)))
            last = max(last, seen.last_ns)
        for sample in samples_of(tables):
            self._send_sample(port, sample)
        return last

    def _send_sample(self, port: str, sample: Sample) -> None:
        from validate.recording import entities
        from validate.recording.stream import Clock, Look, send_scalars, send_series

        clock = Clock(self._origin_ns)
        t = np.asarray((sample.time_ns - self._origin_ns) * 1e-9, np.float64)
        if sample.position is not None:
            self._track.add(sample.position, sample.rank)
            if time.monotonic() - self._track_at >= TRACK_S:
                self._track_at = time.monotonic()
                self._send_track(float(t[-1]))
            return
        path = entities.signal(self.name, sample.quantity, f"{port}/{sample.label}")
        if path in self._styled:
            send_scalars(self.recording, path, clock, t, sample.value)
            return
        self._styled.add(path)
        look = Look("smoothed", f"{sample.label} ({sample.unit})", points=False)
        send_series(self.recording, path, clock, t, sample.value, look)

    def _send_track(self, t: float) -> None:
        import rerun as rr

        from validate.recording import entities
        from validate.recording.entities import COLOURS
        from validate.recording.tracks import on_plan

        north, east = self._track.plane()
        self._at(t)
        line, radius = on_plan(north, east), rr.Radius.ui_points
        self.recording.log(
            entities.plan(self.name, "smoothed"),
            rr.LineStrips2D([line], colors=COLOURS["smoothed"], radii=radius(1.5)),
        )
        here = rr.Points2D(line[-1:], colors=COLOURS["after"], radii=radius(5.0))
        self.recording.log(entities.plan(self.name, "here"), here)

    def _at(self, t: float) -> None:
        from validate.recording.entities import ELAPSED, UTC

        self.recording.set_time(ELAPSED, duration=t)
        self.recording.set_time(UTC, timestamp=self._origin_ns * 1e-9 + t)

    def _table(self) -> None:
        """Rates, ages, counts and damage of every sensor, as a document."""
        import rerun as rr

        from validate.recording import entities
        from validate.recording.glyphs import drawable

        self._table_at = now = time.monotonic()
        wall = time.time_ns()
        self._at((wall - self._origin_ns) * 1e-9)
        rows = [
            f"| {port} | {topic} | {seen.rate(now):.1f} | {seen.count:,} | {(wall - seen.last_ns) * 1e-9:.1f} |"
            for (port, topic), seen in sorted(self._seen.items())
        ]
        damage = [f"- {port}: {n:,} damaged bytes" for port, n in self._damaged.items()]
        text = "\n".join(
            [
                "| port | sensor | Hz | records | age (s) |",
                "|---|---|---|---|---|",
                *rows,
                "",
                *damage,
                *self._delays(),
            ]
        )
        document = rr.TextDocument(drawable(text), media_type=rr.MediaType.MARKDOWN)
        self.recording.log(f"{entities.log_root(self.name)}/sensors", document)

    def _delays(self) -> list[str]:
        lately = list(self.latency_s)[-100:]
        said = [f"- {float(np.median(lately)) * 1e3:.0f} ms from arrival to here"] if lately else []
        return said + (
            [f"- {self.not_shown:,} batches not shown: the viewer is behind"] if self.not_shown else []
        )
