"""What is in a log, as facts: formats, topics, rates, gaps, damage, and what could serve as what."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timezone

import numpy as np
import pandas as pd

from ingest.detect import dilution, quality_mask, stated_sigma
from ingest.log import SOURCE, Finding, Log, Source

#: Quantities that a run needs or uses, in the order in which a person asks for them.
QUANTITIES = ("position", "heading", "yaw_rate", "velocity", "wind", "depth")
#: What fields that hold actuators are called.
INPUT_NAMES = re.compile(
    r"servo\d+_raw$|^RCOU\d?\.C\d+$|actuator_(outputs|motors|servos)|rudder|helm|steer|tiller|throttle|thrust|"
    r"azimuth|pod ?\d*[ _.](angle|speed|rpm)|nozzle|bucket|propeller|\brpm|rpm$|motor\d|"
    r"(^|[./_])(port|starboard|stbd|bow|stern|left|right)(_N)?$|"
    r"(^|[/_])(cmd|commands?|actuators?|thrusters?)(/[^.]*)?$|"
    r"(^|[./])(n|delta)\d?(_(port|starboard|stbd|deg|rad|rps|rpm))?$",
    re.IGNORECASE,
)
#: What a message that holds nothing but numbers calls them: its topic says what they are.
NUMBERS = re.compile(r"\.data(\[\d+\])?$")
#: Signals that such names hit although they hold none.
NO_INPUT = re.compile(
    r"trim|target|limit|temp|volt|curr|status\.(?!esc)|stamp|time_|fail|max|min|version|order|gain|reset|instance|"
    r"mode|metric|satellite|sats|detect|has_|is_|direction$|noutputs|flags|estimat|innov|manual|rates_setpoint|attitude_setpoint",
    re.IGNORECASE,
)
#: Values of a joint, and which one's they are.
JOINT = re.compile(r"(?:position|velocity|effort)(\[\d+\])$")
#: Units in which an accuracy is stated.
SI_UNIT = {"position": "m", "velocity": "m/s", "heading": "rad", "yaw_rate": "rad/s"}
#: Intervals longer than this many mean ones are gaps.
GAP = 5.0


@dataclass(frozen=True)
class FieldFacts:
    """One field of a topic: its unit, and the range of its values where they are numbers."""

    name: str
    unit: str
    low: float | None
    high: float | None


@dataclass(frozen=True)
class TopicFacts:
    """One topic: how often it comes, in how many pieces, from whom, with which fields."""

    name: str
    messages: int
    rate_hz: float | None
    gaps: int
    sources: tuple[int, ...]
    fields: tuple[FieldFacts, ...]


@dataclass(frozen=True)
class Candidate:
    """A signal that could serve as a quantity or an input; ``quality`` is what the sensor itself says of it."""

    quantity: str
    signal: str
    unit: str
    source: int | None
    rate_hz: float | None
    low: float | None = None
    high: float | None = None
    quality: str = ""

    @property
    def moves(self) -> bool:
        """Whether its values change at all."""
        return self.low is None or self.high is None or self.high > self.low


@dataclass(frozen=True)
class LogFacts:
    """One log."""

    path: str
    format: str
    bytes_read: int
    bytes_damaged: int
    messages: int
    duration_s: float
    utc: str | None
    topics: tuple[TopicFacts, ...]
    candidates: tuple[Candidate, ...]
    findings: tuple[Finding, ...]


def inspect_log(log: Log) -> LogFacts:
    """Facts of a log, ready for a table or for JSON."""
    return LogFacts(
        path=str(log.path),
        format=log.format,
        bytes_read=log.bytes_read,
        bytes_damaged=log.bytes_damaged,
        messages=log.messages or sum(map(len, log.tables.values())),
        duration_s=log.duration_s,
        utc=utc_text(log.utc_ns),
        topics=tuple(topic_facts(log, name) for name in log.tables),
        candidates=(*quantity_candidates(log), *input_candidates(log)),
        findings=log.findings,
    )


def utc_text(utc_ns: int | None) -> str | None:
    """ISO 8601 to the millisecond."""
    if utc_ns is None:
        return None
    when = datetime.fromtimestamp(utc_ns // 10**9, tz=timezone.utc)  # noqa: UP017
    return f"{when:%Y-%m-%dT%H:%M:%S}.{utc_ns // 10**6 % 1000:03d}Z"


def topic_facts(log: Log, name: str) -> TopicFacts:
    """Facts of one topic."""
    table = log.tables[name]
    return TopicFacts(
        name=name,
        messages=len(table),
        rate_hz=rate_of(table),
        gaps=sum(f.count for f in log.findings if f.kind == "gap" and f.topic == name),
        sources=devices_in(table),
        fields=tuple(
            FieldFacts(str(c), log.units.get((name, str(c)), ""), *range_of(table[c]))
            for c in table.columns
            if c != SOURCE
        ),
    )


def devices_in(table: pd.DataFrame) -> tuple[int, ...]:
    """Devices that sent a topic, in numerical order."""
    if SOURCE not in table.columns:
        return ()
    return tuple(sorted(int(s) for s in pd.unique(table[SOURCE].dropna())))


def rate_of(table: pd.DataFrame) -> float | None:
    """Messages per second of one device while it sends: over all intervals but the gaps; None without any."""
    if SOURCE in table.columns and len(table):
        table = table[table[SOURCE] == table[SOURCE].iloc[0]]
    steps = np.diff(table.index.to_numpy(dtype=np.float64)) * 1e-9
    kept = steps[steps <= GAP * steps.mean()] if len(steps) else steps
    return len(kept) / float(kept.sum()) if kept.sum() > 0 else None


def range_of(values: pd.Series) -> tuple[float | None, float | None]:
    """Least and greatest value; None where they are no numbers."""
    if not pd.api.types.is_numeric_dtype(values.dtype):
        return None, None
    numbers = values.to_numpy(dtype=float, na_value=np.nan)
    numbers = numbers[np.isfinite(numbers)]
    return (float(numbers.min()), float(numbers.max())) if len(numbers) else (None, None)


def quantity_candidates(log: Log) -> Iterator[Candidate]:
    """What was detected, best first within each quantity."""
    for quantity in QUANTITIES:
        for source in sorted((s for s in log.sources if s.quantity == quantity), key=lambda s: -s.rank):
            yield detected(log, quantity, source)


def detected(log: Log, quantity: str, source: Source) -> Candidate:
    """A detected source as a candidate."""
    table = log.tables[source.topic]
    if source.device is not None and SOURCE in table.columns:
        table = table[table[SOURCE] == source.device]
    prefix = f"{source.topic}." if source.topic else ""
    names = " + ".join(f"{prefix}{f}" for f in source.fields.values())
    ends = range_of(table[next(iter(source.fields.values()))]) if len(source.fields) == 1 else (None, None)
    rate = rate_of(table.dropna(subset=list(source.fields.values())))
    unit = unit_of(log, source)
    return Candidate(quantity, names, unit, source.device, rate, *ends, quality=quality_of(source, table))


def unit_of(log: Log, source: Source) -> str:
    """The unit of a source; of a speed and an angle both, in the order of their names."""
    units = dict.fromkeys(log.units.get((source.topic, f), "") for f in source.fields.values())
    if len(units) > 1:
        return ", ".join(u for u in units if u)
    speed = source.options.get("speed_unit")
    if speed and "speed" in source.fields and len(source.fields) > 1:
        return ", ".join(str(speed) if k == "speed" else source.unit for k in source.fields)
    return source.unit


def quality_of(source: Source, table: pd.DataFrame) -> str:
    """What a sensor says of its own samples: those that it calls bad, satellites, dilution, accuracy."""
    good = quality_mask(source.options, table)
    parts = [] if good.all() or not len(good) else [f"{100.0 * (1.0 - good.mean()):.2g} % flagged bad"]
    count = middle(table, source.options.get("satellites"))
    parts += [f"{count:.0f} satellites"] if count else []
    hdop = dilution(source.options, table)
    parts += [f"HDOP {np.nanmedian(hdop):.2g}"] if hdop is not None and np.isfinite(hdop).any() else []
    sigma = stated_sigma(source.options, table)
    if sigma is not None and np.isfinite(sigma).any():
        parts.append(f"± {np.nanmedian(sigma):.2g} {SI_UNIT.get(source.quantity, '')}".rstrip())
    return ", ".join(parts)


def middle(table: pd.DataFrame, column: object) -> float | None:
    """Median of a column of numbers; None where there is none."""
    if column not in table.columns:
        return None
    values = pd.to_numeric(table[column], errors="coerce").to_numpy(dtype=float)
    return float(np.nanmedian(values)) if np.isfinite(values).any() else None


def input_candidates(log: Log) -> Iterator[Candidate]:
    """Standard rudder and propeller messages, then fields that are called like an actuator."""
    standard = [s for s in log.sources if s.quantity in ("rudder", "propeller")]
    yield from (detected(log, f"input ({s.quantity})", s) for s in sorted(standard, key=lambda s: -s.rank))
    taken = {f"{s.topic}.{field}" if s.topic else field for s in standard for field in s.fields.values()}
    named = [c for c in named_inputs(log) if c.signal not in taken]
    yield from sorted(named, key=lambda c: not c.moves)


def named_inputs(log: Log) -> Iterator[Candidate]:
    """Fields whose names are those of actuators; of topics that are told apart by instance, the instances alone."""
    apart = {topic.rpartition("[")[0] for topic in log.tables if topic.endswith("]")}
    whole = {topic for topic in apart & set(log.tables) if "instance" in log.tables[topic]}
    for topic, table in ((t, log.tables[t]) for t in log.tables if t not in whole):
        for column in map(str, table.columns):
            signal = f"{topic}.{column}" if topic else column
            named = NUMBERS.sub("", joint_of(table, column) or signal)
            if column == SOURCE or not INPUT_NAMES.search(named) or NO_INPUT.search(signal):
                continue
            unit = log.units.get((topic, column), "")
            for name, values in elements(signal, table[column]):
                low, high = range_of(values)
                if low is not None:
                    said = table.loc[values.notna().to_numpy()]
                    yield Candidate("input", name, unit, None, rate_of(said), low, high)


def joint_of(table: pd.DataFrame, column: str) -> str | None:
    """What a joint is called whose angle, rate or effort a column holds, as in ROS; None of other columns."""
    place = JOINT.match(column)
    name = f"name{place[1]}" if place else ""
    return str(table[name].iloc[0]) if name in table and len(table) else None


def elements(signal: str, values: pd.Series) -> Iterator[tuple[str, pd.Series]]:
    """The column itself, or each element of a column of arrays as ``signal[2]``."""
    first = values.iloc[0] if len(values) else None
    if not isinstance(first, (list, tuple, np.ndarray)):
        yield signal, values
        return
    for i in range(min(len(first), 16)):
        yield f"{signal}[{i}]", values.map(lambda v, i=i: float(v[i]) if len(v) > i else np.nan).astype(float)
