"""The identification in the live view: parameters with their uncertainty, prediction errors, the monitor."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from seatrial.online.updates import ERRORS, MONITOR, MOTION, PARAMETERS, Note, Reading, Update

if TYPE_CHECKING:
    import rerun as rr

ROOT = "online"
#: Suffix of a standard error's name.
STDERR = "_stderr"


@dataclass
class LiveCurves:
    """Draws updates into a recording.

    Attributes
    ----------
    name : str
        Of the capture.
    recording : RecordingStream
    origin_ns : int
        UTC where elapsed time is zero.
    """

    name: str
    recording: rr.RecordingStream
    origin_ns: int = field(default_factory=time.time_ns)

    @classmethod
    def connect(cls, address: int, name: str, recording_id: str) -> LiveCurves:
        """Send to a viewer on this machine, into a recording that others send to as well."""
        import rerun as rr

        from validate.recording.entities import APPLICATION

        prompt = rr.ChunkBatcherConfig.LOW_LATENCY()
        recording = rr.RecordingStream(APPLICATION, recording_id=recording_id, batcher_config=prompt)
        recording.connect_grpc(f"rerun+http://127.0.0.1:{address}/proxy")
        return cls(name, recording)

    def show(self, time_ns: int, update: Update) -> None:
        """Draw one update."""
        import rerun as rr

        from validate.recording.entities import ELAPSED, UTC, log_root
        from validate.recording.glyphs import drawable

        self.recording.set_time(ELAPSED, duration=(time_ns - self.origin_ns) * 1e-9)
        self.recording.set_time(UTC, timestamp=time_ns * 1e-9)
        root = f"{log_root(self.name)}/{ROOT}"
        if isinstance(update, Note):
            level = rr.TextLogLevel.WARN if update.warning else rr.TextLogLevel.INFO
            self.recording.log(f"{root}/events", rr.TextLog(drawable(update.text), level=level))
            return
        for path, values in curves(update).items():
            self.recording.log(f"{root}/{path}", rr.Scalars(values))

    def close(self) -> None:
        """Send what waits."""
        self.recording.flush()


def curves(reading: Reading) -> dict[str, list[float]]:
    """Values of each curve of a reading: a parameter has its interval of two standard errors with it."""
    if reading.topic == PARAMETERS:
        names = [n for n in reading.values if not n.endswith(STDERR)]
        return {
            f"parameters/{safe(n)}": [
                reading.values[n] + k * 2.0 * reading.values[n + STDERR] for k in (-1.0, 0.0, 1.0)
            ]
            for n in names
        }
    if reading.topic == ERRORS:
        return {f"errors/{n}": [v] for n, v in reading.values.items()}
    if reading.topic == MONITOR:
        return {f"monitor/{n}": [reading.values[n]] for n in ("score", "sum", "limit", "alarm")}
    return {} if reading.topic == MOTION else {f"{reading.topic}/{n}": [v] for n, v in reading.values.items()}


def safe(name: str) -> str:
    """A name that may stand in an entity's path."""
    return name.replace("|", "_").replace("/", "_")
