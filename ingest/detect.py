r"""Which signals of a log look like position, heading and the rest: one small rule language for all formats.

A reader declares rules and calls :func:`detect` on its tables::

    RULES = (
        Rule("position", r"GPS(\[\d+\])?", {"latitude": "Lat", "longitude": "Lng"}, "deg", rank=50,
             options={"quality": "Status", "quality_min": 2, "satellites": "NSats", "hdop": "HDop"}),
        Rule("heading", "ATT", {"value": "Yaw"}, "deg", rank=50),
    )
    sources = detect(RULES, tables)

A rule holds for every topic that its pattern matches wholly and that has all its fields, once per device
(value of the ``source`` column), if there are usable samples: all fields finite, quality good enough, not
placeholders (latitude and longitude both zero; a measured quantity that is zero throughout).

Ranks: 50 is a plain, direct measurement. Use 60-70 for a better one (RTK, dual antenna), 40 for a filter's
output (its errors are correlated and it may have used the model), 30 for something derived, 20 for a poor
substitute (course as heading). Rate, share of usable samples and coverage of the log add at most 9.

Options that the conversion to a trial understands:

``quality``
    Column that must be at least ``quality_min``, at most ``quality_max``, or one of ``quality_in``.
``satellites``
    Column with the number of satellites.
``hdop``
    Column with the horizontal dilution, times ``hdop_scale`` (default 1).
``accuracy``
    Column with the standard deviation, times ``accuracy_scale`` (default 1), in SI.
``speed_unit``
    Unit of a speed beside an angle.
``frame``
    ``"enu"`` or ``"frd"``/``"flu"`` where it is not NED and forward-starboard.
``magnetic``
    True: a magnetic heading.
``reference``
    ``"true"`` or ``"relative"`` wind.
``sign``
    −1 where positive is to port.
``time``
    Column with the sensor's own time stamp, ``time_unit`` its unit.
``where``
    {column: value}: only the rows in which each column has that value.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import SOURCE, Source

#: Quantities of which a constant zero can be true: a rudder that is kept amidships, a propeller at rest.
MAY_BE_ZERO = frozenset({"rudder", "propeller"})
#: Options that name a column.
COLUMNS = ("quality", "satellites", "hdop", "accuracy", "time")


@dataclass(frozen=True)
class Rule:
    """How a quantity can be recognised.

    Attributes
    ----------
    quantity : str
        As in ``Source``.
    topic : str
        Regular expression that must match the whole topic.
    fields : mapping of str to str
        Component to column, as in ``Source``.
    unit : str
        Of the values (of the angle, where there are two).
    rank : float
        See the module.
    options : mapping
        See the module.
    """

    quantity: str
    topic: str
    fields: Mapping[str, str]
    unit: str
    rank: float = 50.0
    options: Mapping[str, object] = field(default_factory=dict)


def detect(rules: Iterable[Rule], tables: Mapping[str, pd.DataFrame]) -> tuple[Source, ...]:
    """Give sources for the rules that hold, best first within each quantity (stable order).

    Parameters
    ----------
    rules : iterable of Rule
    tables : mapping of str to DataFrame
        As in ``Log`` or ``Decoded``: index in nanoseconds.
    """
    span = log_span_ns(tables)
    found = [s for rule in rules for s in matches(rule, tables, span)]
    return tuple(sorted(found, key=lambda s: -s.rank))


def log_span_ns(tables: Mapping[str, pd.DataFrame]) -> int:
    """Nanoseconds from the earliest record to the latest."""
    first = min((int(t.index[0]) for t in tables.values() if len(t)), default=0)
    last = max((int(t.index[-1]) for t in tables.values() if len(t)), default=0)
    return last - first


def matches(rule: Rule, tables: Mapping[str, pd.DataFrame], span: int) -> Iterator[Source]:
    """Give the sources that one rule gives."""
    pattern = re.compile(rule.topic)
    for topic, table in tables.items():
        if not pattern.fullmatch(topic) or not set(rule.fields.values()) <= set(table.columns):
            continue
        for device, rows in per_device(table):
            rank = graded(rule, rows, span)
            if rank is not None:
                yield Source(rule.quantity, topic, rule.fields, rule.unit, device, rank, known(rule, rows))


def known(rule: Rule, rows: pd.DataFrame) -> dict[str, object]:
    """Give the options of a rule, without those that name a column that is not there or says nothing."""
    silent = [k for k in COLUMNS if k in rule.options and not telling(k, rule.options[k], rows)]
    companions = {
        name for k in silent for name in (k, f"{k}_scale", f"{k}_unit", f"{k}_min", f"{k}_max", f"{k}_in")
    }
    return {k: v for k, v in rule.options.items() if k not in companions}


def telling(option: str, column: object, rows: pd.DataFrame) -> bool:
    """Whether the column that an option names is there; an accuracy must also be positive somewhere."""
    if column not in rows.columns:
        return False
    if option not in ("hdop", "accuracy"):
        return True
    with np.errstate(invalid="ignore"):
        return bool((rows[column].to_numpy(dtype=float) > 0.0).any())


def per_device(table: pd.DataFrame) -> Iterator[tuple[int | None, pd.DataFrame]]:
    """Give the rows of each device that sent a topic."""
    if SOURCE not in table.columns:
        yield None, table
        return
    source = table[SOURCE].to_numpy()
    if len(source) and source[0] == source.min() == source.max():
        yield int(source[0]), table
        return
    for device in np.unique(source[source == source]):
        yield int(device), table[source == device]


def graded(rule: Rule, rows: pd.DataFrame, span: int) -> float | None:
    """Rank of a rule on the rows of one device; None where there is nothing usable."""
    good = usable(rule, rows)
    count = int(good.sum())
    if count < 2:
        return None
    t = rows.index.to_numpy()[good]
    covered = int(t[-1]) - int(t[0])
    rate = 1e9 * (count - 1) / max(covered, 1)
    return rule.rank + 3.0 * covered / max(span, 1) + 3.0 * count / len(rows) + min(rate, 100.0) * 0.03


def usable(rule: Rule, rows: pd.DataFrame) -> NDArray[np.bool_]:
    """Give samples that are finite, good enough and not a placeholder; (n,) bool."""
    try:
        with np.errstate(invalid="ignore"):  # signalling NaNs
            values = np.column_stack([rows[c].to_numpy(dtype=float) for c in rule.fields.values()])
    except (TypeError, ValueError):
        return np.zeros(len(rows), dtype=bool)
    good = np.isfinite(values).all(axis=1) & quality_mask(rule.options, rows)
    if "latitude" in rule.fields:
        good &= ~(values[:, :2] == 0.0).all(axis=1)
    if rule.quantity not in MAY_BE_ZERO and not values[good].any():
        good[:] = False
    return np.asarray(good, dtype=bool)


def quality_mask(options: Mapping[str, object], rows: pd.DataFrame) -> NDArray[np.bool_]:
    """Find samples whose quality passes ``quality_min``, ``quality_max``, ``quality_in``; (n,) bool."""
    good = np.ones(len(rows), dtype=bool)
    column = options.get("quality")
    if column not in rows.columns:
        return good
    quality = pd.to_numeric(rows[column], errors="coerce").to_numpy(dtype=float)
    if "quality_min" in options:
        good &= quality >= float(str(options["quality_min"]))
    if "quality_max" in options:
        good &= quality <= float(str(options["quality_max"]))
    if "quality_in" in options:
        good &= np.isin(quality, np.asarray(options["quality_in"], dtype=float))
    return good
