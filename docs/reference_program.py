"""The reference of the program: commands, campaign.toml, files of the results, errors."""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence
from typing import Any, get_args, get_origin

from reference_markup import code, table


def commands() -> list[str]:
    """Every command with its arguments and options, as ``--help`` has them."""
    import typer

    from seatrial.cli.app import make_app

    program = typer.main.get_command(make_app())
    lines = ["# Commands", "", f"{first_paragraph(program.help)}", ""]
    lines += ["Options of the program itself:", "", *options(program), ""]
    for name, command in program.commands.items():  # type: ignore[attr-defined]
        lines += [f"## seatrial {name}", "", *prose(command.help), "", *options(command)]
    lines += [
        "## Exit status",
        "",
        *table(
            ("status", "meaning"),
            (
                (0, "done"),
                (1, "the data cannot give an answer; no half-written results are left"),
                (2, "the command line or `campaign.toml` is wrong, or a file or a named signal is not there"),
            ),
        ),
    ]
    return lines


def first_paragraph(text: str | None) -> str:
    return " ".join(inspect.cleandoc(text or "").split("\n\n")[0].split())


def prose(text: str | None) -> list[str]:
    """Help text with its examples as code."""
    body, _, examples = inspect.cleandoc(text or "").replace("\b", "").partition("Example")
    lines = [line.strip() for line in examples.splitlines()[1:]]
    shown = [line for line in lines if line.startswith("seatrial")]
    return [body.strip()] + (["", "```sh", *shown, "```"] if shown else [])


def options(command: Any) -> list[str]:
    rows = []
    for p in command.params:
        if p.name == "help":
            continue
        argument = p.param_type_name == "argument"
        names = (p.metavar or p.name.upper()) if argument else ""
        default = "" if argument or p.default in (None, False, (), []) else p.default
        rows.append((code(names or ", ".join([*p.opts, *p.secondary_opts])), p.help, default))
    return table(("argument or option", "meaning", "default"), rows) if rows else []


def campaign() -> list[str]:
    """Every table of ``campaign.toml``, key by key."""
    from seatrial.campaign import tables

    known = [
        c
        for _, c in inspect.getmembers(tables, inspect.isclass)
        if issubclass(c, tables.Table) and c not in (tables.Table, tables.CampaignTable, tables.SensorTable)
    ]
    order = [c for c in vars(tables).values() if c in known]
    lines = [
        "# campaign.toml",
        "",
        "One vessel, one day, several logs. SI units; angles in degrees only where a key",
        "ends in `_deg`. An unknown key is an error that names the nearest known one.",
        "",
    ]
    for model in order:
        if model is tables.SensorsTable:
            continue
        doc = inspect.cleandoc(model.__doc__ or "")
        header, _, sentence = doc.partition(": ")
        lines += [f"## {header.replace('``', '`').rstrip('.')}", "", sentence or header, ""]
        fields = model.model_fields.items()
        lines += table(
            ("key", "value", "meaning", "default"),
            (
                (code(n), kind(f.annotation, f.metadata), f.description or "", default_of(f))
                for n, f in fields
            ),
        )
    return lines


def default_of(field: Any) -> str:
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    return (
        "" if value is None or value == {} or not isinstance(value, (str, int, float, list)) else code(value)
    )


NAMES = {float: "number", int: "whole number", str: "text", bool: "true or false", type(None): ""}


def kind(annotation: Any, metadata: Sequence[Any] = ()) -> str:
    """What a value may be, in words."""
    from pydantic import BaseModel

    origin, inside = get_origin(annotation), get_args(annotation)
    if annotation in NAMES:
        limit = next((m for m in metadata if type(m).__name__ in ("Gt", "Ge")), None)
        word = NAMES[annotation]
        return word if limit is None else f"{word} {'above' if hasattr(limit, 'gt') else 'from'} 0"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "table"
    if hasattr(annotation, "__metadata__"):
        return kind(inside[0], [m for f in annotation.__metadata__ for m in (f, *getattr(f, "metadata", ()))])
    if str(origin) == "typing.Literal":
        return ", ".join(code(v) for v in inside)
    if origin is list:
        length = next((m.max_length for m in metadata if hasattr(m, "max_length")), None)
        return f"list of {length or 'two or more'} {kind(inside[0])}s"
    if origin is dict:
        return "table"
    return " or ".join(filter(None, (kind(a) for a in inside)))


def errors() -> list[str]:
    """The tree of errors with what each means and the exit status that it gives."""
    from ingest import errors as module

    tree = re.search(r"::\n\n((?: {4}.*\n)+)", (inspect.getdoc(module) or "") + "\n")
    classes = [
        c for _, c in inspect.getmembers(module, inspect.isclass) if issubclass(c, module.SeatrialError)
    ]
    classes.sort(key=lambda c: (len(c.__mro__), c.__name__))
    rows = ((code(c.__name__), c.exit_status, (c.__doc__ or "").splitlines()[0]) for c in classes)
    lines = [
        "# Errors",
        "",
        "Each is one sentence: where, what was expected, what was found, and how to cure it.",
        "",
    ]
    if tree:
        lines += ["```text", inspect.cleandoc(tree.group(1)), "```", ""]
    return lines + table(("error", "exit status", "meaning"), rows)


def schemas() -> dict[str, dict[str, Any]]:
    """The JSON schemas by name, as ``seatrial schema`` prints them."""
    from seatrial.cli.schema_command import Which, schema_of

    return {which.value: schema_of(which) for which in Which}


def files() -> list[str]:
    """``report.json`` and ``model.json`` key by key; the schemas themselves lie beside this page."""
    lines = ["# Files of the results", ""]
    for name, schema in schemas().items():
        if name == "campaign":
            continue
        lines += [f"## {name}.json", "", f"`seatrial schema {name}` prints the JSON schema.", ""]
        lines += table(("key", "value"), ((code(k), shape(v)) for k, v in schema["properties"].items()))
        for part, entry in schema.get("$defs", {}).items():
            rows = ((code(k), shape(v)) for k, v in entry.get("properties", {}).items())
            said = (entry.get("description") or "").split("\n\n")[0]
            lines += [f"### {part}", "", said, "", *table(("key", "value"), rows)]
    return lines


def shape(entry: dict[str, Any]) -> str:
    """What a value of a schema is, in words."""
    if "$ref" in entry:
        return entry["$ref"].rsplit("/", 1)[-1]
    if "const" in entry:
        return code(entry["const"])
    if "enum" in entry:
        return ", ".join(code(v) for v in entry["enum"])
    if "anyOf" in entry:
        return " or ".join(dict.fromkeys(shape(e) for e in entry["anyOf"]))
    if entry.get("type") == "array":
        inside = entry.get("items")
        return f"list of {shape(inside)}" if inside else "list"
    inner = entry.get("additionalProperties")
    if isinstance(inner, dict) and inner:
        return f"object of {shape(inner)}"
    return str(entry.get("type", "any"))
