"""How a long task tells how far it is, and how long each stage took."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol

STAGES = ("ingest", "preprocess", "identify", "validate")


class Progress(Protocol):
    """``progress(stage, text, fraction)``: what is being done, and how much of the stage is done (0…1)."""

    def __call__(self, stage: str, text: str = "", fraction: float | None = None) -> None:
        """Tell."""


def silent(stage: str, text: str = "", fraction: float | None = None) -> None:
    """Tell nobody."""


class Stopwatch:
    """Passes progress on, and counts the time between two tellings to the stage of the first."""

    def __init__(self, listener: Progress = silent) -> None:
        self.listener = listener
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self.began = self.since = time.perf_counter()
        self.stage = STAGES[0]

    def __call__(self, stage: str, text: str = "", fraction: float | None = None) -> None:
        """Tell, and switch to ``stage``."""
        self.count()
        self.stage = stage
        self.listener(stage, text, fraction)

    def count(self) -> None:
        """Add the time since the last telling to the stage that is under way."""
        now = time.perf_counter()
        self.seconds[self.stage] = self.seconds.get(self.stage, 0.0) + now - self.since
        self.since = now

    @contextmanager
    def during(self, stage: str) -> Iterator[None]:
        """A stage from start to end."""
        self(stage, "", 0.0)
        yield
        self(stage, "", 1.0)

    def timing(self) -> Mapping[str, float]:
        """Seconds per stage and in total; what is no stage of its own belongs to the last."""
        self.count()
        out = {stage: self.seconds[stage] for stage in STAGES}
        out[STAGES[-1]] += sum(v for stage, v in self.seconds.items() if stage not in STAGES)
        return {**out, "total": self.since - self.began}
