"""Write the reference from the code: commands, campaign keys, formats, models, effects, signals, errors, schemas.

    python docs/generate.py [--out docs/reference]

Nothing here is written twice: every sentence stands in the declaration that it describes.
"""

from __future__ import annotations

import argparse
import inspect
import json
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, get_args, get_origin

REFERENCE = Path(__file__).parent / "reference"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=REFERENCE)
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)
    for name, write in PAGES.items():
        (out / f"{name}.md").write_text("\n".join(write()).rstrip() + "\n", encoding="utf-8")
    for name, schema in schemas().items():
        text = json.dumps(schema, indent=2, ensure_ascii=False)
        (out / f"{name}.schema.json").write_text(text + "\n", encoding="utf-8")
    return 0


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """A Markdown table."""
    lines = [list(head), ["---"] * len(head), *([cell(c) for c in row] for row in rows)]
    return [f"| {' | '.join(line)} |" for line in lines] + [""]


def cell(value: object) -> str:
    """Text of one cell: on one line, with its bars told from those of the table."""
    return re.sub(r"\s+", " ", "" if value is None else str(value)).replace("|", "\\|").strip()


def code(text: object) -> str:
    """Text as code, empty where there is none."""
    return f"`{text}`" if text not in (None, "") else ""


# ---- commands ------------------------------------------------------------------------------------------


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


# ---- campaign.toml -------------------------------------------------------------------------------------


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


# ---- formats, models, effects --------------------------------------------------------------------------


#: What lies behind the names that do not say it.
CONTENT = {
    "tlog": "MAVLink telemetry log of a ground station",
    "dataflash": "ArduPilot's log on board",
    "dataflash_text": "the same, converted to text",
    "ulog": "PX4's log on board",
    "candump": "SocketCAN: NMEA 2000, or any bus with a DBC file",
    "asc": "Vector's text log of a CAN bus",
    "blf": "Vector's binary log of a CAN bus",
    "trc": "PEAK's trace of a CAN bus",
    "can-csv": "CAN frames as delimited text",
    "mf4": "ASAM MDF 4 with CAN frames (extra `seatrial[mf4]`)",
    "actisense": "NMEA 2000 in Actisense's formats",
    "ydraw": "NMEA 2000 in Yacht Devices' RAW format",
    "nmea0183": "NMEA 0183 sentences, also mixed with UBX and RTCM3, with or without the logger's time stamps",
    "ubx": "u-blox binary, also mixed with NMEA 0183",
    "mcap": "ROS 1 and ROS 2 messages, protobuf, JSON; finished or not",
    "rosbag2": "a ROS 2 bag in SQLite form",
    "csv": "delimited text: the dialect is found, or given in the campaign",
    "matlab": "vectors and structs of a MATLAB file",
}


def formats() -> list[str]:
    """Every reader in the order in which they are asked."""
    from ingest.readers import READERS

    rows = ((code(r.name), ", ".join(r.suffixes), CONTENT.get(r.name) or about(r.read)) for r in READERS)
    return [
        "# Formats",
        "",
        "The bytes decide, not the name of the file; the suffix only breaks a tie. Plain, or packed",
        "with gzip, xz or zstd.",
        "",
        *table(("name", "usual suffixes", "what it reads"), rows),
    ]


def about(function: Callable[..., Any]) -> str:
    """First line of a function's docstring, or of its module's."""
    function = getattr(function, "func", function)
    text = inspect.getdoc(function) or inspect.getdoc(inspect.getmodule(function)) or ""
    return text.splitlines()[0] if text else ""


def models() -> list[str]:
    """Every model with its equations."""
    from identify.models import MODELS

    lines = [
        "# Models",
        "",
        "A model contains exactly these terms, per unit inertia, one coefficient (a, b, c) per term and equation.",
        "U is the speed through the water, Δu = u − u₀; δ is the mean of the rudders, n that of the propellers.",
        "T, F_y and N_F are thrust, side force and moment of all inputs by their geometry, with one gain per",
        "kind of input; a rudder there gives side force U²δ.",
        "",
    ]
    for model in MODELS:
        lines += [
            f"## {model.name}",
            "",
            f"{model.source}." + (" Discrete, at a fixed step." if model.discrete else ""),
            "",
        ]
        lines += ["```text", *equations(model), "```", ""]
        lines += flow_parameters() if model.flow else []
        lines += [f"Predicts {', '.join(model.predicts)}.", ""]
    return lines


def flow_parameters() -> list[str]:
    """What the model ``mmg`` has beside its terms."""
    from identify.flow import PARAMETERS

    rows = (
        (code(p.name), p.meaning, p.usual, p.sd, code(f"[vessel.{p.key[0]}] {p.key[1]}")) for p in PARAMETERS
    )
    return [
        "T_P is the propeller's thrust and F_N the rudder's normal force by the flow behind the hull, each per mass;",
        "the turning of the axes (ur) follows from mass and added mass. The flow's parameters are fitted with what is",
        "known of them beforehand (1σ); those that the data do not narrow down are reported so. The report gives the",
        "coefficients as hull derivatives without dimension, t_P, t_R, a_H and x_H′ too. The scale of F_N is shared by",
        "ε, γ_R and the rudder's gains: without a measured rudder force only their products show.",
        "",
        *table(("parameter", "meaning", "usual", "known to", "campaign"), rows),
    ]


def equations(model: Any) -> list[str]:
    out = []
    for left, letter, terms in (("u̇", "a", model.surge), ("v̇", "b", model.sway), ("ṙ", "c", model.yaw)):
        dof = {"u̇": "u", "v̇": "v", "ṙ": "r"}[left]
        fixed = [f"{factor:g} {text}".removeprefix("1 ") for d, text, factor in model.fixed if d == dof]
        parts = [f"{letter}{subscript(k + 1)} {text}" for k, text in enumerate(terms)]
        if parts or fixed:
            out.append(f"{left} = {' + '.join(parts + fixed)}")
    for dof in dict.fromkeys(d for d, _ in model.extra):
        parts = [f"d{subscript(k + 1)} {text}" for k, (d, text) in enumerate(model.extra) if d == dof]
        out.append(f"ė{dof[1:]} = {' + '.join(parts)}")
    return [re.sub(r"([eė])(\d)", lambda m: m[1] + subscript(int(m[2])), line) for line in out]


def subscript(number: int) -> str:
    return str(number).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))


def effects() -> list[str]:
    """Every effect that is searched for, from its declaration."""
    from identify.effects import EFFECTS
    from validate import waves

    lines = [
        "# Effects",
        "",
        "What the search looks for. An effect is declared once; regression, simulation, search,",
        "report and this page read the same declaration.",
        "",
    ]
    lines += table(
        ("effect", "acts on", "what it is"), ((code(e.name), e.place, e.sentence) for e in EFFECTS)
    )
    for effect in EFFECTS:
        lines += [f"## {effect.name}", "", effect.sentence, "", "```text", effect.equation, "```", ""]
        rows = [(code(p.name), p.unit, bounds(p.bounds), f"{p.null:g}") for p in effect.parameters]
        lines += table(("searched parameter", "unit", "possible", "not there at"), rows) if rows else []
        if effect.reported:
            names = ", ".join(f"`{n}` ({u})" for n, u in effect.reported.items())
            lines += [f"Reported as {names}.", ""]
        lines += [f"Check on the vessel: {effect.check}", "", f"Source: {effect.source}.", ""]
    lines += ["## waves", "", inspect.getdoc(waves) or "", ""]
    return [*lines, "Reported as `frequency` (rad/s) and the amplitudes `u`, `v` (m/s²), `r` (rad/s²).", ""]


def bounds(pair: tuple[float, float]) -> str:
    low, high = (f"{b:.4g}" if abs(b) < 1e300 else "" for b in pair)
    return f"{low} … {high}" if low or high else "any"


def methods() -> list[str]:
    """Estimators and optimisers."""
    from identify.estimators import ESTIMATORS
    from identify.optimisers import OPTIMISERS

    lines = ["# Estimators and optimisers", "", "## Estimators", ""]
    lines += table(
        ("name", "what it does", "tuned", "source"),
        (
            (code(e.name), about(e.fit), ", ".join(f"`{h}`" for h in e.hyper), e.source)
            for e in ESTIMATORS.values()
        ),
    )
    lines += [
        "`weak_form` integrates both sides of the equations against smooth weights instead of differentiating;",
        "`output_error` fits free-running predictions to the raw measurements; `auto` is `output_error`.",
        "",
    ]
    lines += [
        "## Optimisers",
        "",
        "All by ask and tell: a run can be saved, resumed and repeated from its state.",
        "",
    ]
    return lines + table(("name", "source"), ((code(o.name), o.source) for o in OPTIMISERS.values()))


def signals() -> list[str]:
    """The closed vocabulary."""
    from preprocess.signals import VOCABULARY

    rows = ((code(s.name), s.symbol, s.unit, s.frame, s.sentence) for s in VOCABULARY)
    return [
        "# Signals",
        "",
        "After preprocessing every quantity has one of these names. SI units and radians; earth frame north, east;",
        "body frame forward, starboard.",
        "",
        *table(("name", "symbol", "unit", "frame", "what it is"), rows),
        "Columns of `predictions/*.parquet`: `t`, `utc_ns` where known, `role`, the states `x y psi u v r`, the same",
        "with `_measured`, `_before` and `_after`, and every input under its name in `campaign.toml`.",
    ]


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


# ---- schemas -------------------------------------------------------------------------------------------


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


PAGES: dict[str, Callable[[], list[str]]] = {
    "commands": commands,
    "campaign": campaign,
    "formats": formats,
    "models": models,
    "methods": methods,
    "effects": effects,
    "signals": signals,
    "files": files,
    "errors": errors,
}

if __name__ == "__main__":
    sys.exit(main())
