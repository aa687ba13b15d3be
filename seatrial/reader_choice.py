"""How a log is to be read: what the command line says, else what a campaign beside the log says of it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ingest.errors import UsageError, nearest
from ingest.log import Log

if TYPE_CHECKING:
    from seatrial.campaign.faults import Fault

CAMPAIGN = "campaign.toml"
#: Keys of a campaign's tables that name signals.
SIGNALS = ("signal", "latitude", "longitude", "north", "east", "forward", "starboard", "speed", "direction")
#: What a dialect may say; ``mavlink`` names a dialect of MAVLink.
KEYS = ("columns", "skip", "delimiter", "decimal", "encoding", "mavlink")


@dataclass(frozen=True)
class ReaderChoice:
    """Arguments of ``read_log``; ``told_by`` is the campaign that they come from, where one does.

    ``declared`` are the signals that it declares, by quantity and for ``input NAME``.
    """

    format: str | None = None
    dialect: Mapping[str, object] = field(default_factory=dict)
    topics: tuple[str, ...] | None = None
    dbc: Path | None = None
    told_by: Path | None = None
    declared: Mapping[str, str] = field(default_factory=dict)

    def read(self, path: Path) -> Log:
        """The log at ``path``, read as chosen; every topic that was asked for is in it."""
        from ingest import read_log

        log = read_log(path, format=self.format, dialect=self.dialect, topics=self.topics, dbc=self.dbc)
        for topic in self.topics or ():
            if not any(name == topic or name.startswith(f"{topic}[") for name in log.tables):
                raise no_such_topic(path, topic, replace(self, topics=None).read(path).tables)
        return log


def no_such_topic(path: Path, topic: str, tables: Iterable[str]) -> UsageError:
    """The error for a topic that a log does not have, with the nearest ones."""
    known = sorted(filter(None, tables))
    there = f"Nearest there: {', '.join(nearest(topic, known) or known[:5])}." if known else "It has none."
    return UsageError(f"--topic: expected a topic of {path}, found '{topic}'. {there}")


def checked_dbc(path: Path) -> Path:
    """The path itself, if a file is there.

    Raises
    ------
    UsageError
    """
    if path.is_file():
        return path
    there = [p.name for p in path.parent.glob("*") if p.is_file()]
    near = nearest(path.name, there)
    hint = f" Nearest there: {', '.join(near)}." if near else ""
    raise UsageError(
        f"--dbc: expected a DBC file, found {'a folder' if path.is_dir() else 'none'} at {path}.{hint}"
    )


def dialect_of(pairs: Sequence[str]) -> dict[str, object]:
    """``KEY=VALUE`` texts as a dialect.

    Raises
    ------
    UsageError
        For a text without ``=``, a key that there is not, or a value that a campaign may not have either.
    """
    out: dict[str, object] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or key.strip() not in KEYS:
            raise UsageError(f"--dialect: expected KEY=VALUE, found '{pair}'. Keys: {', '.join(KEYS)}.")
        out[key.strip()] = as_written(key.strip(), value)
    for fault in faults_of_dialect(out)[:1]:
        raise UsageError(f"--dialect {fault.place[-1]}: expected {fault.expected}, found {fault.found}.")
    return out


def as_written(key: str, value: str) -> object:
    """A value as a campaign would have it: a number of lines as a number, a tab as a tab."""
    if key == "skip" and value.strip().isdecimal():
        return int(value)
    return value.replace("\\t", "\t") if key == "delimiter" else value


def faults_of_dialect(dialect: Mapping[str, object]) -> list[Fault]:
    """What a campaign would find wrong with a dialect."""
    if not dialect:
        return []
    from pydantic import ValidationError

    from seatrial.campaign.faults import faults_of
    from seatrial.campaign.rules import dialect_faults
    from seatrial.campaign.tables import DialectTable

    try:
        return list(dialect_faults((), DialectTable.model_validate(dialect)))
    except ValidationError as error:
        return faults_of(error)


def chosen_for(path: Path, asked: ReaderChoice) -> ReaderChoice:
    """What was asked for, and for the rest what a ``campaign.toml`` in the log's folder says of this log."""
    told = told_beside(path)
    if told is None or told == ReaderChoice(told_by=told.told_by):
        return asked
    return replace(
        told,
        format=asked.format or told.format,
        dialect={**told.dialect, **asked.dialect},
        topics=asked.topics,
        dbc=asked.dbc or told.dbc,
    )


def told_beside(path: Path) -> ReaderChoice | None:
    """What a campaign in the folder of a log says of it; None where there is none, or none that can be read."""
    file = path.parent / CAMPAIGN
    try:
        said = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    logs, can = said.get("log"), said.get("can")
    entry = next((e for e in logs if is_of(e, file, path)), None) if isinstance(logs, list) else None
    if entry is None:
        return None
    form, dialect = entry.get("format"), entry.get("dialect")
    dbc = can.get("dbc") if isinstance(can, dict) else None
    return ReaderChoice(
        form if isinstance(form, str) else None,
        dialect if isinstance(dialect, dict) else {},
        dbc=file.parent / dbc if isinstance(dbc, str) else None,
        told_by=file,
        declared=declared_in(said),
    )


def declared_in(said: Mapping[str, object]) -> dict[str, str]:
    """The signals that a campaign declares, by quantity and for ``input NAME``; what is none is passed over."""
    found: dict[str, str] = {}
    for table, prefix in (("sensors", ""), ("inputs", "input ")):
        entries = said.get(table)
        for name, entry in entries.items() if isinstance(entries, dict) else ():
            own = entry if isinstance(entry, dict) else {}
            signals = [own[k] for k in SIGNALS if isinstance(own.get(k), str)]
            found |= {f"{prefix}{name}": " + ".join(signals)} if signals else {}
    return found


def is_of(entry: object, campaign: Path, path: Path) -> bool:
    """Whether an entry of a campaign names a log."""
    name = entry.get("path") if isinstance(entry, dict) else None
    return isinstance(name, str) and (campaign.parent / name).resolve() == path.resolve()
