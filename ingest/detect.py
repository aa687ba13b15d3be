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
placeholders (latitude and longitude both zero, or beyond a pole; a measured quantity that is zero throughout).

Ranks: 50 is a plain, direct measurement. Use 60-70 for a better one (RTK, dual antenna), 40 for a filter's
output (its errors are correlated and it may have used the model), 30 for something derived, 20 for a poor
substitute (course as heading). Rate, share of usable samples and coverage of the log add at most 9.

Options that the conversion to a trial understands:

``quality``
    Column that must be at least ``quality_min``, at most ``quality_max``, or one of ``quality_in``.
``satellites``
    Column with the number of satellites.
``hdop``
    Column with the horizontal dilution, times ``hdop_scale`` (default 1). Beyond ``WORST_HDOP`` a sample is bad.
``accuracy``
    Column with the standard deviation, to the power ``accuracy_power`` (default 1; ½ for a variance), times
    ``accuracy_scale`` (default 1), in SI; see :func:`stated_sigma`.
``fixes``
    {code of ``quality``: usual error of a position of that kind, m}: orders sources, and is no measurement.
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
from ingest.units import factor_to_si

#: Quantities of which a constant zero can be true: a rudder that is kept amidships, a propeller at rest.
MAY_BE_ZERO = frozenset({"rudder", "propeller"})
#: Options that name a column.
COLUMNS = ("quality", "satellites", "hdop", "accuracy", "time")
#: A dilution beyond this is rated poor by every receiver's handbook: no position to steer by.
WORST_HDOP = 20.0
#: Fewer satellites give no fix at all.
FEWEST_SATELLITES = 3
#: Error of a plain fix, m, and of a velocity, m/s: a source that is as good gets nothing for its precision.
PLAIN: Mapping[str, float] = {"position": 2.5, "velocity": 0.1}


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
        f"{k}{suffix}" for k in silent for suffix in ("", "_scale", "_power", "_unit", "_min", "_max", "_in")
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
    even = 3.0 * covered / max(span, 1) + 3.0 * count / len(rows) + min(rate, 100.0) * 0.03
    return rule.rank + even + precision(rule, rows[good] if count < len(rows) else rows)


def precision(rule: Rule, rows: pd.DataFrame) -> float:
    """What a receiver's own word on its precision adds to a rank: 2 for each power of ten, −2 to 4."""
    plain = PLAIN.get(rule.quantity)
    if plain is None:
        return 0.0
    stated = stated_sigma(rule.options, rows)
    error = usual_error(rule.options, rows) if stated is None else stated
    known = error[np.isfinite(error) & (error > 0.0)]
    return float(np.clip(2.0 * np.log10(plain / np.median(known)), -2.0, 4.0)) if len(known) else 0.0


def stated_sigma(options: Mapping[str, object], rows: pd.DataFrame) -> NDArray[np.float64] | None:
    """Standard deviation of each sample as the sensor itself states it.

    Parameters
    ----------
    options : mapping
        Of a source or a rule: ``accuracy``, ``accuracy_scale`` and ``accuracy_power``.
    rows : DataFrame
        The samples.

    Returns
    -------
    (n,) float or None
        In SI units of the quantity (m, m/s, rad), NaN where a sample states none; None where the source has no
        accuracy.
    """
    if options.get("accuracy") not in rows.columns:
        return None
    scale = float(str(options.get("accuracy_scale", 1.0)))
    power = float(str(options.get("accuracy_power", 1.0)))
    stated = pd.to_numeric(rows[options["accuracy"]], errors="coerce").to_numpy(dtype=float)
    with np.errstate(invalid="ignore"):
        return np.asarray(scale * np.where((stated > 0.0) & np.isfinite(stated), stated, np.nan) ** power)


def usual_error(options: Mapping[str, object], rows: pd.DataFrame) -> NDArray[np.float64]:
    """Error of a position that is usual for its kind of fix and its dilution; (n,) m, NaN where unknown."""
    fixes, column = options.get("fixes"), options.get("quality")
    if not isinstance(fixes, Mapping) or column not in rows.columns:
        return np.full(len(rows), np.nan)
    kind = pd.to_numeric(rows[column], errors="coerce").to_numpy(dtype=float)
    error = np.full(len(rows), np.nan)
    for code, usual in fixes.items():
        error[kind == float(code)] = float(usual)
    hdop = dilution(options, rows)
    return error if hdop is None else error * np.where(hdop > 0.0, np.maximum(hdop, 0.5), 1.0)


def dilution(options: Mapping[str, object], rows: pd.DataFrame) -> NDArray[np.float64] | None:
    """Horizontal dilution of each sample, (n,); None where the source has none."""
    if options.get("hdop") not in rows.columns:
        return None
    values = pd.to_numeric(rows[options["hdop"]], errors="coerce").to_numpy(dtype=float)
    return np.asarray(values * float(str(options.get("hdop_scale", 1.0))))


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
        good &= np.abs(values[:, 0]) * factor_to_si(rule.unit or "deg")[0] <= np.pi / 2.0
    if rule.quantity not in MAY_BE_ZERO and not values[good].any():
        good[:] = False
    return np.asarray(good, dtype=bool)


def quality_mask(options: Mapping[str, object], rows: pd.DataFrame) -> NDArray[np.bool_]:
    """Find samples that the receiver itself does not call bad; (n,) bool.

    Their ``quality`` passes ``quality_min``, ``quality_max``, ``quality_in``; their dilution is no worse than
    ``WORST_HDOP``, and there are not too few satellites for a fix (zero is what those write who do not count).
    """
    good = np.ones(len(rows), dtype=bool)
    hdop = dilution(options, rows)
    if hdop is not None:
        good &= ~(hdop > WORST_HDOP)
    if options.get("satellites") in rows.columns:
        count = pd.to_numeric(rows[options["satellites"]], errors="coerce").to_numpy(dtype=float)
        good &= ~((count > 0) & (count < FEWEST_SATELLITES))
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
