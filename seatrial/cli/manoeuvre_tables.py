"""What ``seatrial simulate`` prints: the measures of a manoeuvre, angles in degrees, lengths also in ship lengths."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from seatrial.cli.tables import table_of

if TYPE_CHECKING:
    from rich.console import RenderableType

    from identify.fit import Estimated
    from identify.simulate import Manoeuvre, Measure

_SHOWN = {"rad": ("°", 180.0 / math.pi), "rad/s": ("°/s", 180.0 / math.pi)}


def manoeuvre_tables(m: Manoeuvre, length: float) -> Iterator[RenderableType]:
    """Title, table and notes of one manoeuvre."""
    yield Text(f"{m.order.title}, approach at {m.speed:.3g} m/s", style="bold")
    limits = any(x.limit is not None for x in m.measures)
    columns = ("Measure", "Value", "±", "95 %", "L", *(("IMO at most",) if limits else ()))
    yield table_of(columns, [_row(x, length, limits) for x in m.measures], columns[1:])
    yield from (Text(f"  {note}", style="yellow") for note in m.notes)
    yield Text("")


def prime_tables(coefficients: Sequence[Estimated], length: float, speed: float) -> Iterator[RenderableType]:
    """The derivatives without dimension."""
    yield Text(f"prime system: lengths in {length:.4g} m, speeds in {speed:.4g} m/s", style="bold")
    columns = ("Derivative", "Of", "Value", "±", "%")
    rows = [
        (
            c.name + "'",
            c.term,
            _short(c.value),
            _short(c.stderr),
            _short(100.0 * c.stderr / abs(c.value)) if c.value else "",
        )
        for c in coefficients
    ]
    yield table_of(columns, rows, columns[2:])
    yield Text(
        "Per unit of inertia: accelerations in U²/L and U²/L², revolutions in U/L, angles in rad.",
        style="dim",
    )


def _row(m: Measure, length: float, limits: bool) -> tuple[str, ...]:
    unit, factor = _SHOWN.get(m.unit, (m.unit, 1.0))
    value, error, low, high = (_short(x * factor) for x in (m.value, m.stderr, m.low, m.high))
    lengths = _short(m.value / length) if m.unit == "m" else ""
    limit = (f"{_short(m.limit * factor)} {unit}" if m.limit is not None else "",) if limits else ()
    interval = f"{low}…{high}" if low and high else ""
    reached = f"{value} {unit}" if value else "not reached"
    return m.name.replace("_", " "), reached, error, interval, lengths, *limit


def _short(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else ""
