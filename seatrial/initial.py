"""A first ``campaign.toml`` for a folder of logs: what was detected filled in, the rest marked."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ingest import read_log
from ingest.errors import DataError, UnreadableLog, UsageError
from seatrial.campaign.input_rules import RESERVED, UNITS
from seatrial.inspection import Candidate, LogFacts, inspect_log
from seatrial.names import MANOEUVRES, MODELS

#: Files that lie beside logs and are none.
NO_LOGS = frozenset(
    [
        *(".toml", ".md", ".rst", ".json", ".html", ".htm", ".pdf", ".png", ".jpg", ".jpeg", ".svg", ".py"),
        *(".ipynb", ".yml", ".yaml", ".ini", ".dbc", ".rrd", ".parquet", ".sh"),
    ]
)
#: Range in which values look like the pulse widths of a servo, µs.
PULSE = (700.0, 2300.0)
#: Values of no greater size may be shares of full thrust, which have no unit.
FULL = 1.05
#: More inputs than this are offered as comments only.
MOST_INPUTS = 8

MARK = "REQUIRED"

HEADER = f"""\
# Written by `seatrial init` from the logs in this folder. Lines marked {MARK} are for you to fill in:
# take away the '#' before the key. Delete the inputs that are none. Then: seatrial run .
"""

VESSEL = """\
[vessel]
name = {name}
# length =               # {mark}: m
# beam =                 # {mark}: m
# draught =              # m; optional, as all below
# mass =                 # kg
# antenna = [0.0, 0.0]   # m forward and starboard of the origin
"""

PULSES = """\
[inputs.{name}]
# kind = ""              # {mark}: rudder | propeller | thruster | azimuth | tunnel
signal = {signal}
pwm = [1100, 1500, 1900]     # check: {span} in these logs
value = [-1.0, 0.0, 1.0]     # check: rad for a rudder, rev/s for a propeller, -1…1 for a thruster
# position = [0.0, 0.0]  # m forward and starboard of the origin; thrusters need it
"""

VALUES = """\
[inputs.{name}]
# kind = ""              # {mark}: rudder | propeller | thruster | azimuth | tunnel
signal = {signal}{source}
# unit = {unit}          # {units}; {span} in these logs
# position = [0.0, 0.0]  # m forward and starboard of the origin; thrusters need it
"""

#: What is said of the unit of values that may be shares of full thrust, and of others.
SHARES = "none if shares of full thrust (-1…1), else rad, deg, rev/s or rpm"
OTHERS = f"{MARK}: rad, deg, rev/s, rpm, percent or N"

STANDARD = """\
[inputs.{kind}]
kind = "{kind}"{named}
"""

NO_INPUT = """\
# [inputs.rudder]        # {mark}: one table for each actuator; {why}
# kind = "rudder"        # rudder | propeller | thruster | azimuth | tunnel
# signal = ""            # as `seatrial inspect` prints it
# unit = "deg"
"""

NO_QUANTITY = {
    "position": """\
# [sensors.position]     # {mark}: not recognised in {logs}
# latitude = ""          # signals as `seatrial inspect` prints them, or north and east
# longitude = ""
# unit = "deg"
""",
    "heading": """\
# [sensors.heading]      # {mark}: not recognised in {logs}
# signal = ""            # as `seatrial inspect` prints it
# unit = "deg"
""",
}

RIVALS = """\
# [sensors.{quantity}]     # sent by the devices {listed}; the first is taken unless you choose
# source = {first}
"""

MODEL = f"""\
[model]
name = "auto"            # or {", ".join(MODELS[:6])},
                         # {", ".join(MODELS[6:-1])}
"""

LOG = """\
[[log]]
path = {path}
# role = "identify"      # or "validate"; without roles, the last third of each log validates
# manoeuvre = ""         # {manoeuvres}
"""


@dataclass(frozen=True)
class Start:
    """A campaign file as text, and what it was made from."""

    text: str
    logs: tuple[LogFacts, ...]
    skipped: tuple[str, ...]

    @property
    def open_marks(self) -> int:
        """How many values a person must fill in."""
        return sum(MARK in line for line in self.text.splitlines()[2:])


def initial_campaign(folder: Path) -> Start:
    """A first campaign for the logs in a folder.

    Parameters
    ----------
    folder : Path
        Its files are tried as logs; folders in it are left alone.

    Raises
    ------
    UsageError
        The folder is not there.
    DataError
        No file in it is a log.
    """
    if not folder.is_dir():
        raise UsageError(
            f"{folder}: expected a folder with logs, found {'a file' if folder.exists() else 'nothing'}."
        )
    facts, skipped = read_all(sorted(p for p in folder.iterdir() if may_be_log(p)))
    if not facts:
        tried = f" Tried: {', '.join(skipped)}." if skipped else ""
        raise DataError(f"{folder}: no log was recognised here.{tried}")
    blocks = [
        HEADER,
        vessel_block(folder),
        *input_blocks(facts),
        *sensor_blocks(facts),
        MODEL,
        *map(log_block, facts),
    ]
    return Start("\n".join(blocks), tuple(facts), tuple(skipped))


def may_be_log(path: Path) -> bool:
    """Whether a file is worth trying."""
    return path.is_file() and path.suffix.lower() not in NO_LOGS and not path.name.startswith(".")


def read_all(paths: Sequence[Path]) -> tuple[list[LogFacts], list[str]]:
    """Facts of the logs, and the names of the files that are none."""
    facts, skipped = [], []
    for path in paths:
        try:
            facts.append(inspect_log(read_log(path)))
        except UnreadableLog:
            skipped.append(path.name)
    return facts, skipped


def vessel_block(folder: Path) -> str:
    """``[vessel]`` with the folder's name."""
    return VESSEL.format(name=quoted(folder.resolve().name), mark=MARK)


def quoted(text: str) -> str:
    """A TOML string."""
    return json.dumps(text, ensure_ascii=False)


def input_blocks(facts: Sequence[LogFacts]) -> Iterator[str]:
    """Rudder and propeller that every log has; else the moving signals that are called like actuators."""
    standard = [kind for kind in ("rudder", "propeller") if all(best(f, f"input ({kind})") for f in facts)]
    yield from (standard_block(kind, facts) for kind in standard)
    if standard:
        return
    moving = [c for c in common(facts) if c.quantity == "input" and c.moves][:MOST_INPUTS]
    names = input_names([c.signal for c in moving])
    yield from (input_block(name, c) for name, c in zip(names, moving, strict=True))
    if not moving:
        yield NO_INPUT.format(mark=MARK, why=why_no_input(facts))


def why_no_input(facts: Sequence[LogFacts]) -> str:
    """What is in the way of an input that serves all logs."""
    moving = Counter(s for f in facts for s in {c.signal for c in f.candidates if is_input(c) and c.moves})
    if not moving:
        return "none was recognised"
    signal, count = min(moving.items(), key=lambda item: (-item[1], item[0]))
    return f"none moves in all logs; {signal} does in {count} of {len(facts)}"


def is_input(candidate: Candidate) -> bool:
    """Whether a candidate is one for an input."""
    return candidate.quantity.startswith("input")


def best(facts: LogFacts, quantity: str) -> Candidate | None:
    """The best candidate of a log for a quantity."""
    return next((c for c in facts.candidates if c.quantity == quantity), None)


def standard_block(kind: str, facts: Sequence[LogFacts]) -> str:
    """``[inputs.NAME]`` of a recognised input: by its signal, or by its standard message."""
    found = {c for f in facts if (c := best(f, f"input ({kind})")) is not None}
    signals, units, devices = ({getattr(c, key) for c in found} for key in ("signal", "unit", "source"))
    if len(signals) > 1 or devices != {None}:
        return STANDARD.format(kind=kind, named=f"          # from {' and '.join(sorted(signals))}")
    unit = f"\nunit = {quoted(*units)}" if len(units) == 1 and units <= set(UNITS[kind]) else ""
    return STANDARD.format(kind=kind, named=f"\nsignal = {quoted(*signals)}{unit}")


def common(facts: Sequence[LogFacts]) -> list[Candidate]:
    """Candidates of the first log that every log has."""
    others = [{(c.quantity, c.signal) for c in f.candidates} for f in facts[1:]]
    return [c for c in facts[0].candidates if all((c.quantity, c.signal) in there for there in others)]


def input_block(name: str, candidate: Candidate) -> str:
    """``[inputs.NAME]`` for one signal."""
    low, high = candidate.low or 0.0, candidate.high or 0.0
    span = f"{low:.4g} to {high:.4g}"
    template = PULSES if PULSE[0] <= low and high <= PULSE[1] else VALUES
    source = "" if candidate.source is None else f"\nsource = {candidate.source}"
    return template.format(
        name=name,
        signal=quoted(candidate.signal),
        span=span,
        source=source,
        unit=quoted(candidate.unit),
        units=SHARES if max(-low, high) <= FULL and not candidate.unit else OTHERS,
        mark=MARK,
    )


def input_names(signals: Sequence[str]) -> list[str]:
    """Names of columns made from signals: the field's own, the whole where that is not unique."""
    short = [column_name(s.rsplit(".", 1)[-1]) for s in signals]
    return [
        s if short.count(s) == 1 else column_name(signal) for s, signal in zip(short, signals, strict=True)
    ]


def column_name(text: str) -> str:
    """Letters, digits and underscores, a letter first, no name that the results use themselves."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").removesuffix("_raw").lower()
    return name if name[:1].isalpha() and name not in RESERVED else f"input_{name}".rstrip("_")


def sensor_blocks(facts: Sequence[LogFacts]) -> Iterator[str]:
    """Marked tables for what a run needs and was not recognised, and a note on what several devices send."""
    for quantity, template in NO_QUANTITY.items():
        without = [name_of(f) for f in facts if quantity not in {c.quantity for c in f.candidates}]
        if without:
            yield template.format(
                mark=MARK, logs="any log" if len(without) == len(facts) else ", ".join(without)
            )
        yield from rivals(quantity, facts[0].candidates)


def rivals(quantity: str, candidates: Iterable[Candidate]) -> Iterator[str]:
    """A note where several devices send the same signal."""
    devices = [c for c in candidates if c.quantity == quantity and c.source is not None]
    same = [c.source for c in devices if c.signal == devices[0].signal]
    if len(same) > 1:
        listed = ", ".join(map(str, same))
        yield RIVALS.format(quantity=quantity, listed=listed, first=same[0])


def log_block(facts: LogFacts) -> str:
    """``[[log]]``."""
    return LOG.format(path=quoted(name_of(facts)), manoeuvres=" | ".join(MANOEUVRES))


def name_of(facts: LogFacts) -> str:
    """File name of a log."""
    return Path(facts.path).name
