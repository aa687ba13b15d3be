"""One identification from beginning to end: its state on the disk, its curves in the live view, its model."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from seatrial.capture.decoders import Tables
from seatrial.online.declared import declared_campaign
from seatrial.online.identifier import Identifier
from seatrial.online.online_process import OnlineWanted, Timed
from seatrial.online.result import fit_of, lines
from seatrial.online.saved_state import restored, save
from seatrial.online.updates import Note, Update

if TYPE_CHECKING:
    from seatrial.online.live_curves import LiveCurves

#: How often the state is kept, s.
KEEP_S = 60.0


class Running:
    """Feeds an `Identifier`, and keeps what it finds.

    Attributes
    ----------
    left_out : int
        Batches that never came here because too many waited.
    """

    def __init__(self, wanted: OnlineWanted) -> None:
        self.wanted = wanted
        self.left_out = 0
        self.identifier = Identifier(declared_campaign(wanted.campaign), wanted.forget_s)
        self._notes: list[Note] = []
        if wanted.state is not None and wanted.state.is_file():
            self._notes += restored(self.identifier, wanted.state)
        self._kept_at = time.monotonic()
        self._curves = self._connected()

    def feed(self, port: str, tables: Tables) -> list[Timed]:
        """Take a batch; what there is to say."""
        found = self._timed(self._told(self.identifier.feed(port, tables)))
        if self.wanted.state is not None and time.monotonic() - self._kept_at > KEEP_S:
            self._kept_at = time.monotonic()
            save(self.identifier, self.wanted.state)
        return found

    def finish(self) -> list[Timed]:
        """Use what is left, and keep state and model."""
        found = self._timed(self._told(self.identifier.finish()))
        if self.wanted.state is not None and self.identifier.estimator is not None:
            save(self.identifier, self.wanted.state)
        fit = fit_of(self.identifier)
        if self.wanted.model is not None and fit is not None:
            from validate.report.model_file import write_model

            write_model(fit, self.wanted.model, {"campaign": str(self.wanted.campaign)})
        if self._curves is not None:
            self._curves.close()
        return found

    def lines(self) -> tuple[str, ...]:
        """The end, for a person."""
        model: Path | None = self.wanted.model if fit_of(self.identifier) is not None else None
        left_out = (
            (f"  {self.left_out:,} batches were left out of it: it was behind",) if self.left_out else ()
        )
        return (*lines(self.identifier, model), *left_out)

    def _told(self, updates: Iterable[Update]) -> Iterator[Update]:
        yield from self._notes
        self._notes = []
        yield from updates

    def _timed(self, updates: Iterable[Update]) -> list[Timed]:
        found = []
        for update in updates:
            time_ns = (self.identifier.tap.first_ns or time.time_ns()) + round(update.t * 1e9)
            found.append((time_ns, update))
            if self._curves is not None:
                self._curves.show(time_ns, update)
        return found

    def _connected(self) -> LiveCurves | None:
        if self.wanted.viewer is None:
            return None
        from seatrial.online.live_curves import LiveCurves

        return LiveCurves.connect(*self.wanted.viewer)
