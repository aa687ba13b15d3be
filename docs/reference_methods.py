"""The reference of the methods: formats, models, estimators and optimisers, effects, signals."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from reference_markup import code, table

from identify.effect import Effect, Parameter, Setting
from identify.term import Term, unit_of
from preprocess.vessel import Input, Vessel

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
        "U is the speed through the water, Δu = u − u₀, where u₀ is found with the coefficients unless",
        "`[model] u0` says it; δ is the mean of the rudders, n that of the propellers.",
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
        rows = [(code(p.name), p.unit, _possible(p), f"{p.null:g}") for p in effect.parameters]
        lines += table(("searched parameter", "unit", "possible", "not there at"), rows) if rows else []
        rows = [(code(n), t.dof, t.text, unit_of(t.text, t.dof)) for n, t in _linear(effect)]
        lines += table(("coefficient", "equation of", "times", "unit"), rows) if rows else []
        if effect.reported:
            names = ", ".join(f"`{n}` ({u})" for n, u in effect.reported.items())
            lines += [f"Reported as {names}.", ""]
        lines += [f"Check on the vessel: {effect.check}", "", f"Source: {effect.source}.", ""]
    lines += ["## waves", "", inspect.getdoc(waves) or "", ""]
    return [*lines, "Reported as `frequency` (rad/s) and the amplitudes `u`, `v` (m/s²), `r` (rad/s²).", ""]


def _linear(effect: Effect) -> list[tuple[str, Term]]:
    """Linear coefficients of an effect and their terms, on a boat with a rudder and a propeller that has none yet."""
    inputs = (
        Input("rudder", "rudder", position=(-1.0, 0.0)),
        Input("propeller", "propeller", position=(-1.0, 0.0)),
    )
    setting = Setting(Vessel("boat", length=2.0, beam=0.6), inputs, (), ("a", "b"), wind_logged=True)
    variants = (*effect.variants(setting), *effect.variants(replace(setting, wind_logged=False)))
    return list(effect.terms(setting, variants[0]).items()) if effect.terms and variants else []


def bounds(pair: tuple[float, float]) -> str:
    low, high = (f"{b:.4g}" if abs(b) < 1e300 else "" for b in pair)
    return f"{low} … {high}" if low or high else "any"


def _possible(parameter: Parameter) -> str:
    if parameter.within:
        return "by the vessel's size"
    of_input = parameter.relative and parameter.bounds[0] > 0.0
    return bounds(parameter.bounds) + (" (the least: of the input's amplitude)" if of_input else "")


def methods() -> list[str]:
    """Estimators and optimisers."""
    from identify.estimators import ESTIMATORS
    from identify.optimisers import OPTIMISERS
    from identify.references import REFERENCES

    biased = ", ".join(code(e.name) for e in ESTIMATORS.values() if e.bias)
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
        f"The bias of {biased} is part of the model: every equation that lacks the term 1",
        "gets it, and the report has its coefficient.",
        "",
    ]
    lines += [
        "## Optimisers",
        "",
        "All by ask and tell: a run can be saved, resumed and repeated from its state. `auto` is Gauss-Newton with",
        "`output_error`; with a regression it leaves the hyper-parameters to the estimator. The report has the name of",
        "what was at work: `auto`, too, where an estimator has nothing to search for.",
        "",
    ]
    lines += table(("name", "source"), ((code(o.name), o.source) for o in OPTIMISERS.values()))
    return [*lines, "", "## References", "", *(f"- **{key}**: {text}." for key, text in REFERENCES.items())]


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
        "",
        "Columns of `trial/*.parquet`, one row per time of any sensor or input: `t`, `utc_ns` where known, `role`,",
        "`part` (of a log that is several trials), the smoothed states and accelerations with `sigma_` of each where",
        "`is_state`, every input under its name; the samples of each sensor and input as `heading_measured`,",
        "`position_measured_north`, …, with `_good` where they were used. Units are in the columns' metadata; vessel,",
        "noise levels and history in the file's. `preprocess.restore.read_trials` makes trials of it again.",
    ]
