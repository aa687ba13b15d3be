"""Whether what was named is what is true."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from identify.fit import FittedEffect

#: A record's entry of a true or a named effect: name, input, parameters and options.
Entry = Mapping[str, Any]

#: Options that are part of what an effect is; the rest is detail.
ESSENTIAL = ("stream", "swapped", "reversed")
#: Options whose value is detail, but which a label shows.
SHOWN = ("stream", "form", "swapped", "reversed", "logs")
#: Standard normal quantile of a two-sided 95 % interval.
TWO_SIDED = 1.96


def same_cause(true: Entry, named: Entry) -> bool:
    """Whether two entries mean the same effect on the same input, stream or wiring."""
    if true["name"] != named["name"]:
        return False
    if any(sorted(_option(true, o)) != sorted(_option(named, o)) for o in ESSENTIAL):
        return False
    return _same_input(true, named) and (sides(true) == sides(named) or sides(true) == sides(named)[::-1])


def _same_input(true: Entry, named: Entry) -> bool:
    """Tell inputs apart where that matters: a ratio of one of a pair says the same of the other."""
    free = true.get("input") is None or named.get("input") is None
    return free or true["name"] == "thrust_asymmetry" or true["input"] == named["input"]


def _option(entry: Entry, option: str) -> Sequence[str]:
    value = entry.get(option) or ()
    return (value,) if isinstance(value, str) else tuple(str(v) for v in value)


def sides(entry: Entry) -> tuple[frozenset[str], frozenset[str]]:
    """Return the logs to identify on in which an effect is, and in which it is not; none where it is in all.

    That the vessel was heavier in some says the same as that it was lighter in the others.
    """
    mine, among = frozenset(_option(entry, "logs")), frozenset(_option(entry, "among"))
    return mine & among, (among - mine if mine else frozenset())


def label_of(entry: Entry) -> str:
    """Return a name that tells an effect from the same effect elsewhere."""
    parts = [entry.get("input"), *(" and ".join(_option(entry, o)) for o in SHOWN)]
    inside = ", ".join(str(p) for p in parts if p)
    return f"{entry['name']} ({inside})" if inside else str(entry["name"])


def alike(true: Entry, look_alikes: Sequence[str]) -> bool:
    """Whether a true effect is among look-alikes: by its name alone, or by a label with the same particulars."""
    return any(_is_meant(true, label) for label in look_alikes)


def _is_meant(true: Entry, label: str) -> bool:
    name, _, inside = label.partition(" (")
    particulars = [true.get("input"), *(v for o in ESSENTIAL for v in _option(true, o))]
    return name == true["name"] and (not inside or all(str(p) in inside for p in particulars if p))


def named_among(true: Entry, record: Mapping[str, Any]) -> bool:
    """Whether a true effect was named, or is among the look-alikes of one that was."""
    return any(same_cause(true, n) or alike(true, n["look_alikes"]) for n in record["named"])


def entry_of(fitted: FittedEffect, among: Sequence[str]) -> dict[str, Any]:
    """Return a fitted effect as data, as the truth is written; ``among``: the logs to identify on."""
    parameters = {e.name: [e.value, e.stderr] for e in fitted.parameters}
    entry = {"name": fitted.name, "input": fitted.input, "parameters": parameters} | dict(fitted.options)
    return entry | ({"among": list(among)} if "logs" in entry else {})


def deviations(true: Entry, named: Entry) -> dict[str, float]:
    """(value - truth) / standard error of every parameter that has a truth; only for the same cause."""
    truth = true_values(true, named)
    found: dict[str, float] = {}
    for name, (value, stderr) in named["parameters"].items():
        if name in truth and stderr > 0:
            found[name] = apart(value, truth[name], angle=name == "direction") / stderr
    return found


def true_values(true: Entry, named: Entry) -> dict[str, float]:
    """Return the true parameters as they should be reported for the input and the logs that were named."""
    values = {k: float(v) for k, v in true["parameters"].items()}
    elsewhere = true["name"] == "thrust_asymmetry" and named.get("input") != true.get("input")
    others = sides(true) != sides(named)
    return {k: 1.0 / v for k, v in values.items()} if elsewhere or others else values


def apart(value: float, truth: float, *, angle: bool) -> float:
    """Difference; of angles the short way round."""
    difference = value - truth
    return math.remainder(difference, 2 * math.pi) if angle else difference
