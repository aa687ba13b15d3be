"""Samples of the last minute, in order, through the causal observer, and cut into windows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from identify.online.doubt import DOUBTFUL
from identify.stretch import IntArray, Samples, Stretch
from preprocess import causal, frames, gaps
from preprocess.causal import CausalLevels, CausalObserver
from preprocess.commands import MEASURED, spikes
from preprocess.judge import repeated
from preprocess.raw import Raw
from preprocess.trial import BoolArray, FloatArray, Measurement
from preprocess.vessel import Input

KINDS = {"position": causal.POSITION, "heading": causal.HEADING, "yaw_rate": causal.YAW_RATE,
         "velocity": causal.VELOCITY}  # fmt: skip
#: Samples may come so much later than others that are younger, s.
LATE_S = 0.5
#: What the observer says is used so long after a good sample, s, or so many of their intervals, since then it only goes
#: straight on; and where its standard deviation is less than so many times the usual one of a window.
FRESH_S, INTERVALS, SURE = 1.0, 2.0, 5.0
#: All is kept so much longer than the windows: an actuator may follow with a delay, a hole may begin before them, s.
MARGIN_S = 6.0


@dataclass
class Column:
    """A growing table of times and values that forgets its beginning."""

    t: FloatArray = field(default_factory=lambda: np.empty(0))
    value: FloatArray = field(default_factory=lambda: np.empty((0, 0)))

    def add(self, t: FloatArray, value: FloatArray) -> None:
        """Append rows; those that come late are put where they belong."""
        value = value.reshape(len(t), -1)
        if not len(self.t):
            self.t, self.value = t.astype(float), value.astype(float)
            return
        late = bool(len(t)) and t[0] < self.t[-1]
        self.t, self.value = np.concatenate([self.t, t]), np.concatenate([self.value, value])
        if late:
            order = np.argsort(self.t, kind="stable")
            self.t, self.value = self.t[order], self.value[order]

    def forget(self, before: float) -> None:
        """Drop rows before a time, but for the last of them."""
        first = max(int(np.searchsorted(self.t, before)) - 1, 0)
        if first:
            self.t, self.value = self.t[first:], self.value[first:]

    def between(self, begin: float, end: float, *, before: int = 0) -> slice:
        """Rows with begin ≤ t < end, and some before."""
        a, b = np.searchsorted(self.t, [begin, end])
        return slice(max(int(a) - before, 0), int(b))


@dataclass(frozen=True)
class InputTraits:
    """How an input's samples are to be read: noise, interval, whether they hold."""

    sigma: float
    sample_time: float
    held: bool


@dataclass
class StreamBuffer:
    """Everything of the last minute.

    Attributes
    ----------
    observer : CausalObserver
    inputs : tuple of Input
    traits : mapping of str to InputTraits
    sigma : (4,)
        White noise of the sensors, for windows.
    quantum : (4,)
        Steps to which their values are rounded.
    late : int
        Samples that came too late to be used.
    now : float
        Time up to which the observer has seen everything, s.
    """

    observer: CausalObserver
    inputs: tuple[Input, ...]
    traits: Mapping[str, InputTraits]
    sigma: FloatArray
    quantum: FloatArray
    late: int = 0
    now: float = -np.inf
    #: per row of the observer: kind, values, good, then x y psi u v r, variances of velocity, yaw rate, position
    _rows: Column = field(default_factory=Column)
    _pending: dict[str, list[Raw]] = field(default_factory=dict)
    _actuators: dict[str, Column] = field(default_factory=dict)
    _wind: Column = field(default_factory=Column)
    _relative: bool = False
    _newest: float = -np.inf

    @property
    def levels(self) -> CausalLevels:
        """What the observer knows of the sensors."""
        return self.observer.levels

    def add(self, raw: Raw) -> None:
        """Take samples of one sensor or input."""
        self._newest = max(self._newest, float(raw.t[-1]))
        if raw.quantity in KINDS:
            if not raw.body:
                self._pending.setdefault(raw.quantity, []).append(raw)
        elif raw.quantity == "wind":
            self._relative = raw.relative
            good = ~raw.flagged
            self._wind.add(raw.t[good], raw.value[good])
        elif raw.quantity in self.traits:
            good = ~raw.flagged
            self._actuators.setdefault(raw.quantity, Column()).add(raw.t[good], raw.value[good])

    def advance(self, *, everything: bool = False) -> None:
        """Let the observer see what is old enough that nothing older can come."""
        until = self._newest if everything else self._newest - LATE_S
        rows = self._ready(until)
        if rows is not None:
            seen = self.observer.take(causal.Rows(rows[:, 0], rows[:, 1].astype(np.int64), rows[:, 2:4]))
            flagged = rows[:, 4] > 0
            good = seen.good & ~flagged
            block = np.column_stack([rows[:, 1], seen.value, good, seen.state, seen.variance])
            self._rows.add(seen.t, block)
        self.now = max(self.now, until)

    def _ready(self, until: float) -> FloatArray | None:
        """Samples (n, 5) up to a time, in order: time, kind, values, flag; flagged ones are not shown the observer."""
        parts = []
        for quantity, waiting in self._pending.items():
            later = []
            for raw in waiting:
                take = raw.t <= until
                parts.append(_as_rows(raw, KINDS[quantity], take))
                if not take.all():
                    later.append(_kept(raw, ~take))
            self._pending[quantity] = later
        if not parts:
            return None
        rows = np.vstack(parts)
        fresh = (rows[:, 0] > self.now) & (rows[:, 4] == 0)
        self.late += int(np.sum(rows[:, 0] <= self.now))
        rows = rows[fresh]
        return rows[np.argsort(rows[:, 0], kind="stable")] if len(rows) else None

    def gap(self, after: float, limits: Mapping[int, float]) -> tuple[float, float] | None:
        """The first gap after a time: the last good sample of a kind before it, and the first one after it, or now.

        ``limits`` has the longest time, s, that each kind may be without a good sample, or some of its intervals.
        """
        found = []
        for kind, limit in limits.items():
            good = self._rows.t[(self._rows.value[:, 0] == kind) & (self._rows.value[:, 3] > 0)]
            before = good[good <= after][-1:]
            times = np.concatenate([before if len(before) else [after], good[good > after], [self.now]])
            usual = float(np.median(np.diff(good))) if len(good) > 1 else 0.0
            wide = np.flatnonzero(np.diff(times) > max(limit, gaps.INTERVALS * usual))
            if len(wide):
                found.append((float(times[wide[0]]), float(times[wide[0] + 1])))
        return min(found, default=None)

    def began(self, after: float) -> float | None:
        """The first good position after a time at which the motion was known."""
        if not len(self._rows.t):
            return None
        position = (self._rows.value[:, 0] == causal.POSITION) & (self._rows.value[:, 3] > 0)
        known = np.isfinite(self._rows.value[:, 4]) & position & (self._rows.t > after)
        return float(self._rows.t[np.argmax(known)]) if known.any() else None

    def aligned(self, t: float) -> float:
        """The first time from ``t`` on at which an input that holds was logged: steps then lie on the grid."""
        held = [
            self._actuators[n].t for n, traits in self.traits.items() if traits.held and n in self._actuators
        ]
        later = [s[i] for s in held if (i := int(np.searchsorted(s, t))) < len(s)]
        return float(min(later)) if later and min(later) < t + 1.0 else t

    def last_good(self) -> float:
        """Time of the last good position."""
        mine = (self._rows.value[:, 0] == causal.POSITION) & (self._rows.value[:, 3] > 0)
        return float(self._rows.t[mine][-1]) if mine.any() else -np.inf

    def forget(self, before: float) -> None:
        """Drop what is older than any window that may still be cut."""
        self._rows.forget(before - MARGIN_S)
        self._wind.forget(before - MARGIN_S)
        for column in self._actuators.values():
            column.forget(before - MARGIN_S)

    def cut(self, begin: float, end: float, h: float, least: int = 10) -> Stretch | None:
        """One window [begin, end) on a grid of step ``h``; None where too little is in it."""
        steps = round((end - begin) / h)
        rows = self._rows.between(begin, end)
        t, table = self._rows.t[rows], self._rows.value[rows]
        known = np.isfinite(table[:, 4]) if len(t) else np.zeros(0, bool)
        if steps < 3 or known.sum() < least:
            return None
        grid: FloatArray = begin + h * np.arange(steps + 1, dtype=float)
        states, spread = self._motion(grid, begin, end)
        return Stretch(
            "live", "identify", begin, begin, h, steps, self._inputs(begin, end), states, spread,
            self._air(grid, states), self._samples(t, table),
        )  # fmt: skip

    def _motion(self, grid: FloatArray, begin: float, end: float) -> tuple[FloatArray, FloatArray]:
        """States (n, 6) on a grid, and the standard deviations (n, 3) of u, v, r; holes are bridged from both sides."""
        around = self._rows.between(begin - MARGIN_S, end + LATE_S, before=1)
        at, seen = self._rows.t[around], self._rows.value[around]
        known = np.isfinite(seen[:, 4])
        at, seen = at[known], seen[known]
        inside = (at >= begin) & (at < end)
        track = sure(at, seen, inside, (causal.POSITION, causal.VELOCITY), 10)
        turn = sure(at, seen, inside, (causal.HEADING, causal.YAW_RATE), 11)
        rows = {4: track, 5: track, 6: turn, 7: track & turn, 8: track & turn, 9: turn}
        states = np.column_stack([np.interp(grid, at[use], seen[use, k]) for k, use in rows.items()])
        spread = np.column_stack([np.interp(grid, at, seen[:, k]) for k in (10, 10, 11)])
        return states, np.sqrt(spread)

    def _inputs(self, begin: float, end: float) -> dict[str, Measurement]:
        out = {}
        for declared in self.inputs:
            column, traits = self._actuators.get(declared.name, Column()), self.traits[declared.name]
            rows = column.between(begin - MARGIN_S, end + LATE_S, before=1)
            t, value = column.t[rows], column.value[rows].reshape(-1)
            measured = declared.kind in MEASURED and not traits.held
            good: BoolArray = ~spikes(t, value, traits.sigma) if measured else np.ones(len(t), dtype=bool)
            out[declared.name] = Measurement(
                declared.name, t, value, traits.sigma, good, "", {}, traits.sample_time, traits.held
            )
        return out

    def _samples(self, t: FloatArray, table: FloatArray) -> Samples:
        kind, value = table[:, 0].astype(np.int64), table[:, 1:3]
        sigma = self.sigma[kind] * np.where(table[:, 3] > 0, 1.0, DOUBTFUL)
        fresh = ~stale(kind, value, self.quantum)
        return Samples(t[fresh], kind[fresh], value[fresh], sigma[fresh])

    def _air(self, grid: FloatArray, states: FloatArray) -> FloatArray:
        """Velocity of the air over ground in the middle of each step; zeros where no wind is measured."""
        if not len(self._wind.t):
            return np.zeros((len(grid) - 1, 2))
        middle = 0.5 * (grid[1:] + grid[:-1])
        speed, direction = self._wind.value.T
        blows = frames.wind_to_air_velocity(speed, direction)
        found = np.column_stack([np.interp(middle, self._wind.t, blows[:, k]) for k in range(2)])
        if not self._relative:
            return found
        between = 0.5 * (states[1:] + states[:-1])
        return frames.body_to_earth(found + between[:, 3:5], between[:, 2])


def sure(t: FloatArray, table: FloatArray, inside: BoolArray, kinds: tuple[int, int], k: int) -> BoolArray:
    """Rows (n,) at which the observer knows a chain: fed lately, its variance in column ``k`` not unusual ``inside``.

    All rows, where hardly any would be left.
    """
    fed = t[np.isin(table[:, 0], kinds) & (table[:, 3] > 0)]
    if len(fed) < 2:
        return np.ones(len(t), dtype=bool)
    last = np.maximum(np.searchsorted(fed, t, side="right") - 1, 0)
    fresh = np.abs(t - fed[last]) <= max(FRESH_S, INTERVALS * float(np.median(np.diff(fed))))
    good: BoolArray = fresh & (table[:, k] <= SURE**2 * np.median(table[inside, k]))
    return good if good.sum() > 1 else np.ones(len(t), dtype=bool)


def stale(kind: IntArray, value: FloatArray, quantum: FloatArray) -> BoolArray:
    """Samples that only repeat the one before of their sensor; (n,) bool."""
    out = np.zeros(len(kind), dtype=bool)
    for k in np.unique(kind):
        mine = np.flatnonzero(kind == k)
        own = value[mine] if k in (causal.POSITION, causal.VELOCITY) else value[mine, 0]
        out[mine] = repeated(own, float(quantum[k]))
    return out


def _as_rows(raw: Raw, kind: int, take: BoolArray) -> FloatArray:
    value = raw.value.reshape(len(raw.t), -1)[take]
    rows = np.zeros((int(take.sum()), 5))
    rows[:, 0], rows[:, 1] = raw.t[take], kind
    rows[:, 2 : 2 + value.shape[1]] = value
    rows[:, 4] = raw.flagged[take]
    return rows


def _kept(raw: Raw, rows: BoolArray) -> Raw:
    return replace(raw, t=raw.t[rows], value=raw.value[rows], flagged=raw.flagged[rows])
