"""What is wrong with a campaign file, as facts: pydantic's errors in the words of ``campaign.toml``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel

from ingest.errors import CampaignError, nearest
from seatrial.campaign.tables import CampaignTable

if TYPE_CHECKING:
    from pydantic import ValidationError
    from pydantic_core import ErrorDetails

Place = tuple[int | str, ...]

#: Tables whose keys are tables.
NESTED = ("inputs", "sensors")
GEOMETRY: tuple[Place, ...] = (("vessel", "propeller"), ("vessel", "rudder"))
#: What pydantic calls each mistake, and how a person would put what was expected.
EXPECTED: Mapping[str, str] = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "string_type": "text in quotes",
    "list_type": "a list",
    "model_type": "a table",
    "dict_type": "a table",
    "bool_type": "true or false",
    "string_too_short": "text that is not empty",
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "a number of at least {ge:g}",
    "less_than_equal": "a number of at most {le:g}",
    "too_short": "a list of at least {min_length} numbers",
    "too_long": "a list of at most {max_length} numbers",
    "literal_error": "one of {expected}",
}


@dataclass(frozen=True)
class Fault:
    """One mistake: where, what was expected, what was found, what may have been meant."""

    place: Place
    expected: str
    found: str
    near: str | None = None


def nearest_one(name: str, known: Iterable[str]) -> str | None:
    """The known name that is closest to ``name``, if one is close."""
    return next(iter(nearest(name, known)), None)


def campaign_error(path: Path, faults: Sequence[Fault], logs: Sequence[str] = ()) -> CampaignError:
    """The error for the first of the faults; the others are its notes.

    Parameters
    ----------
    path : Path
        The campaign file.
    faults : sequence of Fault
        At least one.
    logs : sequence of str
        Paths of the logs as written, to name them by.
    """
    first, *others = (
        CampaignError(path, key_path(f.place, logs), f.expected, f.found, f.near) for f in faults
    )
    for other in others[:4]:
        first.add_note(str(other))
    return first


def key_path(place: Place, logs: Sequence[str] = ()) -> str:
    """A place as the file writes it: ``[inputs.rudder] kind``, ``[[log]] 2 (zigzag.nmea) role``."""
    if not place:
        return "the file"
    if place[0] == "log":
        return log_key(place[1:], logs)
    tables, rest = split_place(place)
    header = f"[{'.'.join(tables)}]"
    return " ".join([header, ".".join(map(str, rest))]) if rest else header


def split_place(place: Place) -> tuple[list[str], list[int | str]]:
    """The table that a place is in, and the rest."""
    depth = (
        2
        if place[0] in ("inputs", "sensors") or place[:2] in (("vessel", "propeller"), ("vessel", "rudder"))
        else 1
    )
    return [str(p) for p in place[:depth]], list(place[depth:])


def log_key(rest: Place, logs: Sequence[str]) -> str:
    """A place inside ``[[log]]``."""
    if not rest:
        return "[[log]]"
    number = int(rest[0])
    name = f" ({logs[number]})" if number < len(logs) else ""
    return " ".join([f"[[log]] {number + 1}{name}", ".".join(map(str, rest[1:]))]).rstrip()


def faults_of(error: ValidationError) -> list[Fault]:
    """Faults of a validation error, misspelt keys first: they explain the missing ones."""
    details = sorted(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
    return [fault_of(e) for e in details]


def fault_of(detail: ErrorDetails) -> Fault:
    """One fault."""
    place, kind = detail["loc"], detail["type"]
    if kind == "extra_forbidden":
        return unknown_key(place)
    if kind == "missing":
        table, name = keys_of(place[:-1]), str(place[-1])
        about = description(table, name)
        return Fault(place, f"the key '{name}'{about}", "none")
    return wrong_value(place, detail)


def unknown_key(place: Place) -> Fault:
    """A key that is not in its table."""
    known = list(keys_of(place[:-1]))
    near = nearest_one(str(place[-1]), known)
    expected = f"one of {', '.join(known)}" if known else "no such table"
    return Fault(place, expected, f"the unknown key '{place[-1]}'", near)


def wrong_value(place: Place, detail: ErrorDetails) -> Fault:
    """A value of the wrong type or outside its range."""
    context: dict[str, Any] = dict(detail.get("ctx", {}))
    template = EXPECTED.get(detail["type"], detail["msg"][:1].lower() + detail["msg"][1:])
    about = description(keys_of(place[:-1]), str(place[-1]) if place else "")
    near = None
    if detail["type"] == "literal_error":
        choices = str(context["expected"]).replace(" or ", ", ").replace("'", "").split(", ")
        near = nearest_one(str(detail["input"]), choices)
    return Fault(place, template.format(**context) + about, found(detail["input"]), near)


def description(table: Mapping[str, Any], name: str) -> str:
    """What a key is, in brackets; empty where the table does not say."""
    text = getattr(table.get(name), "description", None)
    return f" ({text})" if text else ""


def keys_of(place: Place) -> Mapping[str, Any]:
    """Keys that the table at a place may have, with their fields."""
    model: type[BaseModel] | None = CampaignTable
    for part in place:
        if isinstance(part, int) or model is None:
            continue
        field = model.model_fields.get(part)
        if field is not None:
            model = model_in(field.annotation)
    return model.model_fields if model is not None else {}


def model_in(annotation: object) -> type[BaseModel] | None:
    """The pydantic model inside an annotation such as ``dict[str, InputTable]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for m in map(model_in, get_args(annotation)) if m is not None), None)


def found(value: object) -> str:
    """A value as a person would name it."""
    if isinstance(value, str):
        return f"'{value}'" if value else "empty text"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        return f"the list {value}" if len(str(value)) < 60 else f"a list of {len(value)}"
    return str(value)
