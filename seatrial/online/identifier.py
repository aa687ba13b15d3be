"""The whole way on line: tables in, updates out, at bounded memory and cost."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from identify.online.horizon import Horizon
from identify.online.knowledge import nothing_known
from identify.online.surprise import ahead
from identify.stretch import step_for
from ingest.errors import DataError, SeatrialError
from preprocess import causal
from preprocess.causal import CausalObserver
from preprocess.gaps import ALWAYS
from preprocess.raw import Raw
from seatrial.campaign.data import Campaign
from seatrial.capture.decoders import Tables
from seatrial.online.estimator import Estimator
from seatrial.online.stream_buffer import StreamBuffer
from seatrial.online.tap import Tap
from seatrial.online.updates import ERRORS, MOTION, Note, Reading, Update
from seatrial.online.warm_up import Beginning, begin, needed_seconds, window_of

#: The horizon of the prediction errors, and of the blocks that are tested, for small vessels, s.
HORIZON_S = 10.0
#: Blocks of either phase follow each other by one horizon, those of both by half of it.
PHASES = 2
#: How often motion and prediction errors are told, s.
TICK_S = 1.0
#: If the first fit is not possible yet, it is tried again after so much more, s; at most so much is collected.
AGAIN_S, MOST_COLLECTED_S = 15.0, 600.0
#: A stretch begins so long after the motion is first known, s.
SETTLE_S = 1.0
CHANNELS = ("x", "y", "psi", "u", "v", "r")
UNITS = ("m", "m", "rad", "m/s", "m/s", "rad/s")


@dataclass
class Pace:
    """When the next of everything is due, s; all reckoned from the stretch's begin."""

    begin: float
    block: int = 0
    window: float = 0.0
    tick: float = 0.0


@dataclass
class Identifier:
    """Identification of one stream.

    Attributes
    ----------
    campaign : Campaign
    forget : float
        Time constant of forgetting, s.
    start : Beginning, optional
        From a saved state: then no first fit is made.
    """

    campaign: Campaign
    forget: float = math.inf
    start: Beginning | None = None
    estimator: Estimator | None = None
    buffer: StreamBuffer | None = None
    samples: int = 0
    tap: Tap = field(init=False)
    _collected: dict[str, list[Raw]] = field(default_factory=dict)
    _try_at: float = 0.0
    _said_missing: bool = False
    _pace: Pace | None = None
    _ended_at: float = -np.inf
    _test_after: float = -np.inf

    def __post_init__(self) -> None:
        self.tap = Tap(self.campaign)
        self.h = step_for(self.campaign.vessel.length)
        self.window = window_of(self.campaign.vessel.length, self.h)
        self.block = self.h * round(self.window / 3.0 / self.h)
        self._try_at = needed_seconds(self.campaign.vessel.length)

    def feed(self, port: str, tables: Tables) -> Iterator[Update]:
        """Take a batch of one port."""
        for raw in self.tap.take(port, tables):
            self.samples += len(raw.t)
            if self.buffer is None:
                self._collected.setdefault(raw.quantity, []).append(raw)
            else:
                self.buffer.add(raw)
        if self.buffer is not None:
            yield from self._advance()
        else:
            yield from self._begin()

    def finish(self) -> Iterator[Update]:
        """Use what is there at the end."""
        if self.buffer is None or self.estimator is None:
            return
        self.buffer.advance(everything=True)
        yield from self._steps(self.buffer.now)
        yield from self._close(self.buffer.last_good())

    # --- the beginning ------------------------------------------------------------------------------------

    def _begin(self) -> Iterator[Update]:
        newest = max((float(r[-1].t[-1]) for r in self._collected.values()), default=0.0)
        if self.tap.missing and not self._said_missing:
            self._said_missing = True
            yield Note(newest, f"waiting for {', '.join(self.tap.missing)}", warning=True)
        if not self._collected or (self.start is None and newest < self._try_at):
            return
        if self.start is None:
            self._try_at = newest + AGAIN_S
            try:
                self.start = begin(self.campaign, self._collected, self.tap.origin)
            except (DataError, np.linalg.LinAlgError) as error:
                self._drop_old(newest)
                yield Note(newest, f"no first model yet: {error}")
                return
        yield Note(newest, self._set_out(self.start))
        yield from self._advance()

    def _drop_old(self, newest: float) -> None:
        keep = newest - MOST_COLLECTED_S
        for parts in self._collected.values():
            while len(parts) > 1 and float(parts[0].t[-1]) < keep:
                parts.pop(0)

    def _set_out(self, start: Beginning) -> str:
        """Make buffer and estimator, and play into them what was collected."""
        self.buffer = StreamBuffer(
            CausalObserver(start.levels), self.campaign.inputs, start.traits, start.noise.sigma, start.quantum
        )
        if self.estimator is None:
            horizon = Horizon(
                start.structure,
                start.prior,
                start.p,
                start.noise,
                nothing_known(len(start.p)),
                forget=self.forget,
            )
            self.estimator = Estimator.of(horizon, self.block)
            self._test_after = max(float(r[-1].t[-1]) for r in self._collected.values())
        for parts in self._collected.values():
            for raw in parts:
                self.buffer.add(raw)
        self._collected = {}
        return f"identifying {start.structure.model.name}: {len(start.structure.slots)} parameters"

    # --- the way ------------------------------------------------------------------------------------------

    def _advance(self) -> Iterator[Update]:
        assert self.buffer is not None
        self.buffer.advance()
        yield from self._steps(self.buffer.now)
        if self._pace is not None:
            self.buffer.forget(min(self._pace.begin + self._pace.window, self.buffer.now - self.block) - 1.0)

    def _steps(self, now: float) -> Iterator[Update]:
        """Do everything that is due, in the order of time, from gap to gap."""
        assert self.buffer is not None
        limit = ALWAYS * max(1.0, self.block / HORIZON_S)
        limits = {causal.POSITION: limit, causal.HEADING: 3.0 * limit}
        while True:
            if self._pace is None:
                began = self.buffer.began(self._ended_at)
                if began is None:
                    return
                self._pace = Pace(self.buffer.aligned(began + SETTLE_S))
            gap = self.buffer.gap(self._pace.begin + max(self._pace.tick, 0.0), limits)
            yield from self._due(now if gap is None else gap[0])
            if gap is None:
                return
            yield from self._close(gap[0])
            self._ended_at = gap[1]

    def _due(self, now: float) -> Iterator[Update]:
        assert self._pace is not None
        pace, stride = self._pace, self.block / PHASES
        while True:
            next_tick = pace.begin + pace.tick + TICK_S
            next_block = pace.begin + self.block + pace.block * stride
            next_window = pace.begin + pace.window + self.window
            at = min(next_tick, next_block, next_window)
            if at > now:
                return
            if at == next_tick:
                pace.tick += TICK_S
                yield from self._tick(at)
            elif at == next_block:
                pace.block += 1
                yield from self._block(at, (pace.block - 1) % PHASES)
            else:
                pace.window += self.window
                yield from self._window(at - self.window, at, whole=True)

    def _block(self, end: float, phase: int) -> Iterator[Update]:
        assert self.buffer is not None and self.estimator is not None and self._pace is not None
        block = self.buffer.cut(end - self.block, end, self.h)
        if block is None:
            return
        if end > self._test_after:
            yield from self.estimator.test(block, phase)
        begun = self._pace.begin + self._pace.window
        warm = end <= self._test_after
        if (
            not warm
            and phase == PHASES - 1
            and end - begun >= 0.5 * self.block
            and end + self.h < begun + self.window
        ):
            yield from self._window(begun, end, whole=False)

    def _window(self, begin_at: float, end: float, *, whole: bool) -> Iterator[Update]:
        assert self.buffer is not None and self.estimator is not None
        window = self.buffer.cut(begin_at, end, self.h)
        if window is not None:
            yield from self.estimator.take(window, whole=whole)

    def _close(self, end: float) -> Iterator[Update]:
        """End the stretch: what of the window under way is long enough counts as one."""
        assert self.buffer is not None
        pace, self._pace = self._pace, None
        if pace is None:
            return
        begun = pace.begin + pace.window
        steps = int((end - begun) / self.h)
        if steps * self.h >= 0.5 * self.block:
            yield from self._window(begun, begun + steps * self.h, whole=True)

    def _tick(self, at: float) -> Iterator[Update]:
        """The motion now, and how wrong the model's predictions of it were."""
        assert self.buffer is not None and self.estimator is not None
        span = self.buffer.cut(
            max(at - self.block, self._pace.begin if self._pace else at), at, self.h, least=3
        )
        if span is None:
            return
        state = span.states[-1]
        yield Reading(
            MOTION,
            at,
            dict(zip(CHANNELS, state.tolist(), strict=True)),
            dict(zip(CHANNELS, UNITS, strict=True)),
        )
        structure, p = self.estimator.horizon.structure, self.estimator.known.p
        one = ahead(structure, p, span, span.steps - 1, 1)
        values = {f"one_step_{c}": float(e) for c, e in zip(CHANNELS, one, strict=True)}
        if span.steps * self.h > self.block - 0.5 * self.h:
            far = ahead(structure, p, span, 0, span.steps)
            values |= {f"ten_seconds_{c}": float(e) for c, e in zip(CHANNELS, far, strict=True)}
            values["ten_seconds_distance"] = float(np.hypot(far[0], far[1]))
        else:
            values |= {f"ten_seconds_{c}": math.nan for c in (*CHANNELS, "distance")}
        units = {
            k: UNITS[CHANNELS.index(c)] if (c := k.rsplit("_", 1)[1]) in CHANNELS else "m" for k in values
        }
        yield Reading(ERRORS, at, values, units)


def fatal(error: SeatrialError) -> bool:
    """Whether an error means that the campaign cannot be identified at all."""
    return not isinstance(error, DataError)
