"""One unit for a signal in all logs of a campaign, where none is stated: a log of small angles says nothing of it.

A rudder in degrees that stays within one and a half in a straight run looks like radians there, and a thrust command
that once is a little over one like percent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from ingest.errors import MissingSignal
from ingest.log import Log, Source
from ingest.tabular.unstated import BETWEEN, GUESSED, SIZE
from preprocess.actuators import guessed_unit, logged_values, usable_unit
from preprocess.raw import read_raw
from preprocess.resolve import choose_source
from preprocess.run_of_log import LoggedRun
from preprocess.trial import FloatArray
from preprocess.vessel import Input, Vessel
from preprocess.wild import wild

#: Of two units of one quantity that one is which gives the smaller values in SI: what is large in any log decides.
LARGER = ("deg", "deg/s", "rpm")
#: Quantity and name of a source.
Named = tuple[str, str]
#: A yaw rate is held against the heading in steps of so many s, from so many samples on, if it turned so far, rad.
STEP, FEWEST, ENOUGH = 5.0, 10, 0.2


def with_common_units(runs: Sequence[LoggedRun], vessel: Vessel) -> list[LoggedRun]:
    """The logs with one unit for every source whose unit was guessed from its values.

    A yaw rate's is that which goes with the heading: of a large ship degrees per second are as small as radians.
    """
    logs = [r.log for r in runs]
    rates = {s.name for log in logs for s in log.sources if s.quantity == "yaw_rate" and _is_guessed(s)}
    turning = {("yaw_rate", n): unit for n in rates if (unit := _unit_of_turning(logs, n, vessel))}
    logs = [_with_units(log, turning) for log in logs]
    logs = [_with_units(log, _larger(logs)) for log in logs]
    return [replace(r, log=log) for r, log in zip(runs, logs, strict=True)]


def _larger(logs: Sequence[Log]) -> dict[Named, str]:
    """The unit that gives the smaller values, of every source for which different ones were guessed.

    What other signals of a log told goes before what was guessed from the size of the values in another.
    """
    guessed: dict[Named, set[tuple[bool, bool, str]]] = {}
    for source in (s for log in logs for s in log.sources if _is_guessed(s)):
        order = (source.options[GUESSED] != SIZE, source.unit in LARGER, source.unit)
        guessed.setdefault((source.quantity, source.name), set()).add(order)
    return {k: max(units)[-1] for k, units in guessed.items() if len(units) > 1}


def _is_guessed(source: Source) -> bool:
    return GUESSED in source.options


def _with_units(log: Log, some: Mapping[Named, str]) -> Log:
    """The log with other units for some sources, by quantity and name, whose own were guessed."""
    return replace(
        log,
        sources=tuple(
            replace(s, unit=some.get((s.quantity, s.name), s.unit)) if _is_guessed(s) else s
            for s in log.sources
        ),
    )


def _unit_of_turning(logs: Sequence[Log], name: str, vessel: Vessel) -> str | None:
    """Unit of a yaw rate by what the heading turned while it was logged; None where it hardly turned."""
    pairs = [both for log in logs if (both := _turned(log, name, vessel)) is not None]
    if not pairs:
        return None
    turned, summed = np.concatenate(pairs, axis=1)
    if turned @ turned < ENOUGH**2:
        return None
    return "deg/s" if abs(summed @ turned) > BETWEEN * (turned @ turned) else "rad/s"


def _turned(log: Log, name: str, vessel: Vessel) -> FloatArray | None:
    """What the heading turned (rad) and what a yaw rate adds up to, as logged (2, n), in steps of ``STEP``."""
    rate = next((s for s in log.sources if (s.quantity, s.name) == ("yaw_rate", name)), None)
    heading = choose_source(log, "heading", None)
    if rate is None or heading is None:
        return None
    h, r = (read_raw(log, s, None, vessel) for s in (heading, replace(rate, unit="rad/s")))
    good = [np.isfinite(x.value) & ~x.flagged for x in (h, r)]
    if min(np.sum(g) for g in good) < FEWEST:
        return None
    t = np.arange(max(h.t[0], r.t[0]), min(h.t[-1], r.t[-1]), STEP)
    psi = np.interp(t, h.t[good[0]], np.unwrap(h.value[good[0]]))
    total = np.append(0.0, cumulative_trapezoid(r.value[good[1]], r.t[good[1]]))
    return np.array([np.diff(psi), np.diff(np.interp(t, r.t[good[1]], total))])


def in_one_unit(inputs: Sequence[Input], logs: Sequence[Log]) -> list[Input]:
    """The inputs with the unit that their values in all logs look like, where none is declared or stated."""
    return [i if i.pwm or i.unit else _settled(i, logs) for i in inputs]


def _settled(declared: Input, logs: Sequence[Log]) -> Input:
    every = []
    for log in logs:
        with suppress(MissingSignal):
            source, values, t = logged_values(log, declared)
            if usable_unit(declared.kind, source.unit):
                return declared
            every.append(values[~wild(t, values)])
    unit = guessed_unit(declared.kind, np.concatenate(every)) if every else None
    return replace(declared, unit=unit) if unit else declared
