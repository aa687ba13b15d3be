"""The capture's side of the identification: its process, its messages for the file, its lines for the person."""

from __future__ import annotations

from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

from seatrial.capture.decoder_process import LiveWanted
from seatrial.capture.events import Events, Level
from seatrial.capture.recording_file import Message
from seatrial.capture.settings import CaptureSettings
from seatrial.online.channels import ReadingEncoder
from seatrial.online.online_process import OnlineProcess, OnlineWanted
from seatrial.online.updates import Note

NAME = "online"


@dataclass
class OnlineSide:
    """An identification that runs beside a capture."""

    process: OnlineProcess
    _encoder: ReadingEncoder = field(default_factory=ReadingEncoder)
    _said_failed: bool = False

    @classmethod
    def of(cls, settings: CaptureSettings, out: Path, live: LiveWanted | None) -> OnlineSide:
        """Begin one; the model goes beside the file."""
        assert settings.campaign is not None
        viewer = None if live is None else (live.address, live.name, live.recording_id)
        model = out.with_suffix(".model.json")
        wanted = OnlineWanted(settings.campaign, settings.state, settings.forget_s, model, viewer)
        return cls(OnlineProcess(wanted))

    @property
    def feed(self) -> Connection:
        """The end that the decoders write to."""
        return self.process.feed

    @property
    def lines(self) -> tuple[str, ...]:
        """What was identified, for the person."""
        ending = self.process.ending
        return ending.lines if ending else ("on line: the identification did not come to its end",)

    def take(self, events: Events) -> list[Message]:
        """Messages since the last call; notes are told as events."""
        found = []
        for time_ns, update in self.process.take():
            if isinstance(update, Note):
                events.tell(NAME, update.text, Level.warning if update.warning else Level.info)
            else:
                found.append(self._encoder.message(update, time_ns))
        if self.process.failed and not self._said_failed:
            self._said_failed = True
            events.tell(NAME, "the identification has ended unexpectedly; the capture goes on", Level.error)
        return found

    def close(self, patience_s: float) -> None:
        """Let it finish."""
        self.process.close(patience_s)
