"""What comes in, in Rerun while it comes: the track, the signals, rates, damage, and how old each sensor is."""

from __future__ import annotations

import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from seatrial.capture.decoders import Tables
from seatrial.capture.live_signals import Sample, Track, samples_of
from seatrial.capture.settings import PortSettings

if TYPE_CHECKING:
    import rerun as rr

    from seatrial.capture.decoder_process import LiveWanted

#: Batches that may wait for the viewer; what comes on top is not shown.
MOST_WAITING = 64
#: How often the table of rates is renewed, and the track drawn, s.
TABLE_S, TRACK_S = 1.0, 0.15
MEMORY = "1GB"
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
        From the arrival of a batch's last byte until it was sent to the viewer.
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
        self._server: subprocess.Popen[bytes] | None = None
        self._queue: queue.Queue[tuple[str, Tables] | None] = queue.Queue(MOST_WAITING)
        recording.send_blueprint(blueprint(name, SPAN_S, online=online))
        self._thread = threading.Thread(target=self._serve, daemon=True, name="live view")
        self._thread.start()

    @classmethod
    def open(cls, live: LiveWanted, ports: tuple[PortSettings, ...]) -> LiveView:
        """Open a viewer that only this machine can reach, and send to it."""
        import rerun as rr

        from validate.recording.entities import APPLICATION

        command = viewer_command(live.address)
        viewer = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        wait_for(live.address, viewer)
        recording = rr.RecordingStream(APPLICATION, recording_id=live.recording_id)
        recording.connect_grpc(f"rerun+http://127.0.0.1:{live.address}/proxy")
        view = cls(live.name, ports, recording, online=live.online)
        view._server = viewer if "--web-viewer" in command else None
        return view

    def show(self, port: str, tables: Tables) -> None:
        """Hand a batch over, without waiting."""
        try:
            self._queue.put_nowait((port, tables))
        except queue.Full:
            self.not_shown += 1

    def close(self) -> None:
        """Send what waits; a window stays open, a server for a browser ends."""
        with suppress(queue.Full):
            self._queue.put(None, timeout=2.0)
            self._thread.join(2.0)
        if self._server is not None:
            with suppress(OSError):
                os.killpg(self._server.pid, signal.SIGKILL)

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
            self._send(*batch)
            if time.monotonic() - self._table_at >= TABLE_S:
                self._table()
        self._table()
        self.recording.flush()

    def _send(self, port: str, tables: Tables) -> None:
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
        if last:
            self.latency_s.append((time.time_ns() - last) * 1e-9)

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
        document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
        self.recording.log(f"{entities.log_root(self.name)}/sensors", document)

    def _delays(self) -> list[str]:
        lately = list(self.latency_s)[-100:]
        said = [f"- {float(np.median(lately)) * 1e3:.0f} ms from arrival to here"] if lately else []
        return said + (
            [f"- {self.not_shown:,} batches not shown: the viewer is behind"] if self.not_shown else []
        )


def viewer_command(port: int) -> list[str]:
    """The command that opens an empty viewer: a window where there is a screen, else the browser."""
    screen = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    where = ["--hide-welcome-screen"] if screen else ["--web-viewer", "--web-viewer-port", "0"]
    return [
        sys.executable,
        "-m",
        "rerun",
        "--bind",
        "127.0.0.1",
        "--port",
        str(port),
        "--memory-limit",
        MEMORY,
        "--server-memory-limit",
        MEMORY,
        *where,
    ]


def free_port() -> int:
    """A port of this machine that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for(port: int, viewer: subprocess.Popen[Any], patience_s: float = 10.0) -> None:
    """Wait until the viewer listens, or has ended, or has had time enough."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end and viewer.poll() is None:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
