"""Tables as the decoders give them, to the samples that a campaign asks for, in SI units.

Where a quantity comes from is decided once, by what came in the first seconds, with the rules of the log readers; from
then on every batch is converted the same way.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from ingest.errors import MissingSignal
from ingest.log import Log, Source
from ingest.sender import sender_of
from preprocess import frames
from preprocess.actuators import read_input
from preprocess.raw import Raw, read_raw
from preprocess.resolve import chosen, of_one_receiver, source_of
from preprocess.rounding import resolution
from preprocess.trials import METRES_PER_DEGREE, NEEDED
from preprocess.vessel import Input, Sensor
from seatrial.campaign.data import Campaign
from seatrial.capture.decoders import Tables

#: Sources are chosen among what came in so many seconds; tables are held for so many at most until all is there.
SETTLE_S, HELD_S = 3.0, 120.0
QUANTITIES = (*NEEDED, "yaw_rate", "velocity", "wind")


@dataclass(frozen=True)
class Taken:
    """Where a quantity or an input is taken from: the port, the source, and the input with its unit settled."""

    port: str
    topic: str
    source: Source
    declared: Input | None = None


@dataclass
class Tap:
    """Takes samples out of tables.

    Attributes
    ----------
    campaign : Campaign
    plan : dict of str to Taken
        Filled once.
    missing : tuple of str
        What has not come yet.
    origin : (latitude, longitude), optional
        The first good fix, degrees.
    first_ns : int, optional
        Time of the first record.
    """

    campaign: Campaign
    plan: dict[str, Taken] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    origin: tuple[float, float] | None = None
    first_ns: int | None = None
    _held: list[tuple[str, Tables]] = field(default_factory=list)
    _last_ns: int = 0

    def take(self, port: str, tables: Tables) -> list[Raw]:
        """Samples of the quantities and inputs in a batch; none until all sources are known."""
        stamps = [t.index for t in tables.tables.values() if len(t)]
        if not stamps:
            return []
        if self.first_ns is None:
            self.first_ns = min(int(s[0]) for s in stamps)
        self._last_ns = max(self._last_ns, *(int(s[-1]) for s in stamps))
        if self.plan and not self.missing:
            return self._samples(port, tables)
        self._held.append((port, tables))
        return self._settle()

    def _settle(self) -> list[Raw]:
        assert self.first_ns is not None
        if (self._last_ns - self.first_ns) * 1e-9 < SETTLE_S:
            return []
        logs = {p: self._log(p, joined([t for q, t in self._held if q == p])) for p in dict(self._held)}
        self.plan = self._plan(logs)
        wanted = (*NEEDED, *(i.name for i in self.campaign.inputs))
        self.missing = tuple(n for n in wanted if n not in self.plan)
        if self.missing:
            oldest = self._last_ns - int(HELD_S * 1e9)
            self._held = [
                (p, t) for p, t in self._held if any(int(x.index[-1]) > oldest for x in t.tables.values())
            ]
            return []
        held, self._held = self._held, []
        return [raw for port, tables in held for raw in self._samples(port, tables)]

    def _plan(self, logs: Mapping[str, Log]) -> dict[str, Taken]:
        sensors = {s.quantity: s for s in self.campaign.sensors}
        found: dict[str, Taken] = {}
        for quantity in QUANTITIES:
            options = [
                (p, s) for p, log in logs.items() if (s := _source(log, quantity, sensors.get(quantity)))
            ]
            if quantity == "velocity" and "position" in found and not chosen(sensors.get(quantity)):
                options = _of_one_receiver(options, logs, found["position"])
            if options:
                port, source = max(options, key=lambda o: o[1].rank)
                found[quantity] = Taken(port, source.topic, _with_unit(logs[port], source))
        for declared in self.campaign.inputs:
            for port, log in logs.items():
                taken = _input(log, declared)
                if taken is not None:
                    found[declared.name] = replace(taken, port=port)
                    break
        return found

    def _samples(self, port: str, tables: Tables) -> list[Raw]:
        mine = [(n, t) for n, t in self.plan.items() if t.port == port and t.topic in tables.tables]
        if not mine:
            return []
        log = self._log(port, tables)
        found = [
            raw for name, taken in mine if (raw := self._read(log, name, taken)) is not None and len(raw.t)
        ]
        return [r for raw in found if (r := self._in_metres(raw)) is not None]

    def _read(self, log: Log, name: str, taken: Taken) -> Raw | None:
        try:
            if taken.declared is not None:
                return read_input(replace(log, sources=(taken.source,)), taken.declared)[0]
            sensors = {s.quantity: s for s in self.campaign.sensors}
            return read_raw(log, taken.source, sensors.get(name), self.campaign.vessel)
        except MissingSignal:
            return None

    def _in_metres(self, raw: Raw) -> Raw | None:
        if not raw.geodetic:
            return raw
        good = np.flatnonzero(~raw.flagged)
        if self.origin is None and len(good):
            self.origin = float(raw.value[good[0], 0]), float(raw.value[good[0], 1])
        if self.origin is None:
            return None
        value = frames.geodetic_to_ned(raw.value[:, 0], raw.value[:, 1], self.origin)
        quantum = METRES_PER_DEGREE * max(resolution(raw.value[:, 0]), resolution(raw.value[:, 1]))
        return replace(raw, value=value, geodetic=False, quantum=quantum)

    def _log(self, port: str, tables: Tables) -> Log:
        assert self.first_ns is not None
        moved = {k: t.set_axis(t.index - self.first_ns, axis=0) for k, t in tables.tables.items()}
        return Log(Path(port), "live", moved, tables.units, sources=tables.sources)


def joined(batches: list[Tables]) -> Tables:
    """Batches of one port, one after the other."""
    topics = dict.fromkeys(k for b in batches for k in b.tables)
    tables = {
        k: pd.concat([b.tables[k] for b in batches if k in b.tables]).sort_index(kind="stable")
        for k in topics
    }
    units = {k: v for b in batches for k, v in b.units.items()}
    sources = {(s.quantity, s.name): s for b in batches for s in b.sources if s.topic in tables}
    return Tables(tables, units, tuple(sources.values()))


def _source(log: Log, quantity: str, sensor: Sensor | None) -> Source | None:
    try:
        return source_of(log, quantity, sensor)
    except MissingSignal:
        return None


def _of_one_receiver(
    options: list[tuple[str, Source]], logs: Mapping[str, Log], position: Taken
) -> list[tuple[str, Source]]:
    """Ports and sources of a velocity; at the port of the positions that of their receiver, or none of its kind."""
    sender = sender_of(logs[position.port], position.source)
    own = [(p, of_one_receiver(logs[p], s, sender) if p == position.port else s) for p, s in options]
    return [(p, s) for p, s in own if s is not None]


def _with_unit(log: Log, source: Source) -> Source:
    """The source with its unit settled: a batch of small angles must not change what the whole was taken for."""
    if source.unit or source.quantity != "heading":
        return source
    values = pd.to_numeric(log.tables[source.topic][source.fields["value"]], errors="coerce").abs()
    return replace(source, unit="deg" if float(values.max()) > 2.1 * np.pi else "rad")


def _input(log: Log, declared: Input) -> Taken | None:
    try:
        raw, how = read_input(log, declared)
    except MissingSignal:
        return None
    settled = declared if how == "calibration" else replace(declared, unit=how)
    return Taken("", raw.source.topic, raw.source, settled)
