"""Progress on stderr: one line per stage, with a bar and the time left while it lasts."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from seatrial.cli.compiling import told_of_compiling
from seatrial.cli.interrupt import remembered_interrupt

NAMES = {
    "ingest": "Reading",
    "preprocess": "Preprocessing",
    "identify": "Identifying",
    "diagnose": "Diagnosing",
    "validate": "Validating",
    "write": "Writing",
    "simulate": "Sailing",
    "fleet": "Campaigns",
    "recover": "Mending",
}

#: The time left follows from the pace of so many seconds: steps of a search may take long.
PATIENCE = 600.0


class StageLines:
    """A listener to progress: bars on a terminal; elsewhere one plain line per finished stage, if wanted."""

    def __init__(self, quiet: bool = False, lines: bool = True) -> None:
        self.lines = lines
        self.console = Console(stderr=True, quiet=quiet)
        self.live = self.console.is_terminal and not quiet
        self.bars = Progress(
            SpinnerColumn(finished_text="[green]✓"),
            TextColumn("{task.description:<13}"),
            BarColumn(bar_width=20),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[text]:.24}", markup=False),
            console=self.console,
            disable=not self.live,
            speed_estimate_period=PATIENCE,
        )
        self.tasks: dict[str, TaskID] = {}
        self.stage: str | None = None
        self.began = time.perf_counter()
        self.until_the_end = ExitStack()

    def __enter__(self) -> StageLines:
        self.bars.start()
        self.stop_if_asked = self.until_the_end.enter_context(remembered_interrupt())
        self.listen = self.until_the_end.enter_context(told_of_compiling(self._compiling))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.finish()
        self.until_the_end.close()
        self.bars.stop()

    def __call__(self, stage: str, text: str = "", fraction: float | None = None) -> None:
        """Show how far a stage is; the bar pulses until the stage tells how far. Ctrl-C that was heard ends it."""
        self.stop_if_asked()
        self.listen()
        if stage != self.stage:
            self.finish()
            self.begin(stage)
        total = 1.0 if fraction else None
        self.bars.update(self.tasks[stage], total=total, completed=fraction or 0.0, text=text)

    def begin(self, stage: str) -> None:
        """A new line, or the old one of a stage that goes on."""
        self.stage, self.began = stage, time.perf_counter()
        if stage not in self.tasks:
            self.tasks[stage] = self.bars.add_task(NAMES.get(stage, stage.capitalize()), total=None, text="")

    def _compiling(self, line: str) -> None:
        """Short commands keep quiet where there are no bars."""
        if self.live or self.lines:
            self.say(line)

    def say(self, line: str) -> None:
        """A line above the bars."""
        self.console.print(line, markup=False, highlight=False, soft_wrap=True)

    def finish(self) -> None:
        """Mark the stage that is under way as done."""
        if self.stage is None:
            return
        self.bars.update(self.tasks[self.stage], total=1.0, completed=1.0, text="")
        if not self.live and self.lines:
            seconds = time.perf_counter() - self.began
            name = NAMES.get(self.stage, self.stage.capitalize())
            self.console.print(f"{name:<14}{seconds:6.1f} s", markup=False, highlight=False)
        sys.stderr.flush()
