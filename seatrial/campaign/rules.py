"""What a campaign must be beyond the types of its keys."""

from __future__ import annotations

import codecs
from collections import Counter
from collections.abc import Iterable, Iterator

from preprocess.run_of_log import LEAST_SECONDS
from seatrial.campaign.faults import Fault, found, nearest_one
from seatrial.campaign.input_rules import input_faults
from seatrial.campaign.sensor_rules import sensor_faults
from seatrial.campaign.tables import CampaignTable, DialectTable, LogTable
from seatrial.campaign.vessel_rules import geometry_faults
from seatrial.names import ESTIMATORS, MODELS, OPTIMISERS


def faults_in(table: CampaignTable) -> list[Fault]:
    """Everything that is wrong with a campaign whose keys and types are right."""
    return [
        *geometry_faults(table),
        *model_faults(table),
        *smoother_faults(table),
        *input_faults(table),
        *sensor_faults(table.sensors),
        *log_faults(table.log),
    ]


def model_faults(table: CampaignTable) -> Iterator[Fault]:
    """Names that are no model, estimator or optimiser."""
    chosen = table.model
    yield from unknown_name(("model", "name"), "a model", chosen.name, MODELS)
    yield from unknown_name(("model", "estimator"), "an estimator", chosen.estimator, ESTIMATORS)
    yield from unknown_name(("model", "optimiser"), "an optimiser", chosen.optimiser, OPTIMISERS)


def smoother_faults(table: CampaignTable) -> Iterator[Fault]:
    """A bandwidth of what has none; an observer of yaw alone for a model of more."""
    chosen = table.preprocess
    if chosen.bandwidth is not None and chosen.smoother not in ("eso", "nomoto_eso"):
        expected = 'a bandwidth with smoother = "eso" or "nomoto_eso" only'
        yield Fault(("preprocess", "bandwidth"), expected, f"it with {found(chosen.smoother)}")
    if chosen.smoother == "nomoto_eso" and not table.model.name.startswith("nomoto"):
        expected = (
            'a Nomoto model ([model] name = "nomoto1", "nomoto2" or "nomoto_nonlinear") with "nomoto_eso"'
        )
        yield Fault(("preprocess", "smoother"), expected, f"it with {found(table.model.name)}")


def unknown_name(place: tuple[int | str, ...], what: str, name: str, known: Iterable[str]) -> Iterator[Fault]:
    """A fault where ``name`` is not one of the known ones."""
    names = tuple(known)
    if name not in names:
        near = nearest_one(name, names)
        yield Fault(place, f"the name of {what} ({', '.join(names)})", found(name), near)


def log_faults(logs: list[LogTable]) -> Iterator[Fault]:
    """Faults of the logs, one by one and together."""
    if not logs:
        yield Fault(("log",), "at least one log: [[log]] with a path", "none")
    elif all(log.role == "validate" for log in logs):
        yield Fault(
            ("log",), 'at least one log to identify on (role = "identify")', "only logs that validate"
        )
    for number, log in enumerate(logs):
        yield from faults_of_log(("log", number), log)
    yield from repeated_logs(logs)


def faults_of_log(place: tuple[int | str, ...], log: LogTable) -> Iterator[Fault]:
    """Faults of one log."""
    if log.slice is not None and not 0 <= log.slice[0] < log.slice[1]:
        yield Fault((*place, "slice"), "[from, to] with 0 ≤ from < to, s", found(log.slice))
    elif log.slice is not None and log.slice[1] - log.slice[0] < LEAST_SECONDS:
        yield Fault((*place, "slice"), f"[from, to] with {LEAST_SECONDS:g} s between them", found(log.slice))
    if log.format is not None:
        yield from unknown_name((*place, "format"), "a log format", log.format, format_names())
    yield from dialect_faults((*place, "dialect"), log.dialect)


def dialect_faults(place: tuple[int | str, ...], dialect: DialectTable) -> Iterator[Fault]:
    """Faults of a dialect."""
    if dialect.encoding is not None and not is_encoding(dialect.encoding):
        expected = "a text encoding such as utf-8 or cp1252"
        yield Fault((*place, "encoding"), expected, found(dialect.encoding))


def format_names() -> tuple[str, ...]:
    """Names of the formats that can be read."""
    from ingest.readers import READERS

    return tuple(r.name for r in READERS)


def is_encoding(name: str) -> bool:
    """Whether Python knows a text encoding."""
    try:
        return bool(codecs.lookup(name))
    except LookupError:
        return False


def repeated_logs(logs: list[LogTable]) -> Iterator[Fault]:
    """Logs that are named twice: their results would overwrite each other."""
    counts = Counter(log.path for log in logs)
    for number, log in enumerate(logs):
        if counts[log.path] > 1 and any(earlier.path == log.path for earlier in logs[:number]):
            yield Fault(
                ("log", number, "path"), "a log that is not named yet", f"{found(log.path)} a second time"
            )
