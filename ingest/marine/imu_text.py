"""Lines of numbers from a port, with names or without, as inertial sensors print them.

``#YPR=12.3,-1.0,0.4``, ``!ANG:1.2,3.4,5.6``, ``yaw:12.3 pitch:-1.0 roll:0.4``, ``1.0, 2.0, 3.0``. All numbers of a
text are taken out at once; what remains of a line is its shape, and each shape is looked at once only.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.detect import Rule, detect
from ingest.log import Source

#: Topic of lines that have no label.
TOPIC = "IMU"
#: Stands for a number in the shape of a line.
MARK = b"\x01"
NUMBER = re.compile(rb"(?<![\w.+-])[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d++)?(?![\w.])")
#: No part of a shape can be taken in two ways: a long line that is none would be tried in all of them.
NAMED = re.compile(rb"\b([A-Za-z_]\w*+)\s*+[:=]\s*+" + MARK + rb"(?![,]*" + MARK + rb")")
PARTED = rb"(?:\s*+[,;]\s*+|\s++)"
LABELLED = re.compile(rb"[#!$]?([A-Za-z_]\w*+)?\s*+[:=,]?\s*+" + MARK + rb"(?:" + PARTED + MARK + rb")+")

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Text:
    """What the lines held.

    Attributes
    ----------
    tables : mapping of str to (DataFrame, (n,) int64)
        By label: the values, and where the line of each ends.
    damage : (m, 2) int64
        Lines that are neither blank nor numbers.
    """

    tables: Mapping[str, tuple[pd.DataFrame, Integers]]
    damage: Integers


def read_lines(data: bytes) -> Text:
    """Tables of the whole lines of a text."""
    text = data[: data.rfind(b"\n") + 1].replace(MARK, b"?")
    ends = np.flatnonzero(np.frombuffer(text, np.uint8) == 10) + 1
    numbers = np.array(NUMBER.findall(text) or [b"0"]).astype(np.float64)
    shapes = [line.strip().rstrip(b",; \t") for line in NUMBER.sub(MARK, text).split(b"\n")[:-1]]
    codes, distinct = pd.factorize(np.array([*shapes, b""], object))
    counts = np.array([shape.count(MARK) for shape in distinct], np.int64)[codes[:-1]]
    first = np.cumsum(counts) - counts
    parts: dict[str, list[tuple[pd.DataFrame, Integers]]] = {}
    good = np.array([not shape for shape in distinct])[codes[:-1]]
    for code, shape in enumerate(distinct):
        said = meaning(shape)
        rows = np.flatnonzero(codes[:-1] == code)
        if said is not None and len(rows):
            label, names = said
            values = numbers[first[rows][:, None] + np.arange(len(names))]
            parts.setdefault(label, []).append((pd.DataFrame(values, columns=list(names)), ends[rows]))
            good[rows] = True
    starts = np.concatenate([[0], ends[:-1]]) if len(ends) else ends
    damage = np.column_stack([starts[~good], ends[~good]]).astype(np.int64)
    return Text({label: _together(pieces) for label, pieces in parts.items()}, damage)


def meaning(shape: bytes) -> tuple[str, tuple[str, ...]] | None:
    """Label and names of the values of lines of one shape; None where it is no line of numbers."""
    names = NAMED.findall(shape)
    if len(names) >= 2 and len(names) == shape.count(MARK) == len(set(names)):
        return TOPIC, tuple(n.decode("ascii") for n in names)
    found = LABELLED.fullmatch(shape)
    if found is None:
        return None
    return (found[1] or TOPIC.encode()).decode("ascii"), tuple(
        f"value[{i}]" for i in range(shape.count(MARK))
    )


def _together(parts: list[tuple[pd.DataFrame, Integers]]) -> tuple[pd.DataFrame, Integers]:
    ends = np.concatenate([e for _, e in parts])
    order = np.argsort(ends)
    table = pd.concat([t for t, _ in parts], ignore_index=True).iloc[order].reset_index(drop=True)
    return table, ends[order]


#: ``#YPR=`` of Razor AHRS and its descendants: yaw, pitch, roll in degrees.
RULES = (Rule("heading", "YPR", {"value": "value[0]"}, "deg", 40, {"magnetic": True}),)


def sources_of(tables: Mapping[str, pd.DataFrame]) -> tuple[Source, ...]:
    """What the names of the values say, best first."""
    from ingest.tabular.naming import sources_of as named

    found = [*detect(RULES, tables), *(s for topic, table in tables.items() for s in named(table, {}, topic))]
    return tuple(sorted(found, key=lambda s: -s.rank))
