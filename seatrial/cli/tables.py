"""Tables for a terminal of 80 columns, plain where the output is no terminal."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from types import MappingProxyType

from rich import box
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from seatrial.inspection import Candidate, FieldFacts, LogFacts, TopicFacts

NARROWEST, WIDEST = 40, 100
#: No column but that of the signals is given more.
WIDEST_CELL = 20
#: Findings that are shown of one log; the rest is in the JSON.
MOST_FINDINGS = 8
#: The number of an element of an array; more than so many are shown as one.
ELEMENT, MOST_ELEMENTS = re.compile(r"\[(\d+)\]$"), 4


def console() -> Console:
    """Stdout: 80 columns where it is no terminal."""
    plain = Console(highlight=False)
    width = max(NARROWEST, min(plain.width, WIDEST)) if plain.is_terminal else 80
    return Console(highlight=False, width=width)


def say(*items: RenderableType) -> None:
    """Print to stdout; text that may not wrap (a path that people copy) is printed as it is."""
    out = console()
    for item in items:
        out.print(item, soft_wrap=isinstance(item, Text) and bool(item.no_wrap))


def table_of(columns: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[str] = ()) -> Table:
    """A table with these columns; those in ``right`` hold numbers."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False, show_edge=False)
    for name in columns:
        table.add_column(
            name, justify="right" if name in right else "left", overflow="fold", no_wrap=name in right
        )
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    return table


def inspection_tables(
    facts: LogFacts, declared: Mapping[str, str] = MappingProxyType({})
) -> Iterator[RenderableType]:
    """What ``seatrial inspect`` prints of one log; ``declared`` signals by quantity and ``input NAME``."""
    yield Text(facts.path, style="bold", no_wrap=True)
    yield Text(head_line(facts))
    yield from (Text(f"  {line}") for line in finding_lines(facts))
    yield Text("")
    told = {signal for signals in declared.values() for signal in signals.split(" + ")}
    open_ = [c for c in facts.candidates if told.isdisjoint(c.signal.split(" + "))]
    shown = [c for c in open_ if c.moves or c.quantity != "input"]
    if shown:
        yield candidate_table(shown)
    if len(shown) < len(open_):
        yield Text(f"and {len(open_) - len(shown)} inputs that never move (--json shows all)")
    yield from (Text(f"Declared as {kind}: {signal}") for kind, signal in declared.items())
    yield from (Text(line, style="yellow") for line in missing_lines(facts.candidates, declared))
    yield Text("")
    yield topic_table(facts.topics)


def head_line(facts: LogFacts) -> str:
    """Format, size, messages, duration and clock in one line."""
    clock = f"from {facts.utc}" if facts.utc else "without UTC"
    size = f"{facts.bytes_read:,} bytes, {facts.messages:,} messages"
    return f"{facts.format}, {size}, {facts.duration_s:.1f} s {clock}"


def finding_lines(facts: LogFacts) -> Iterator[str]:
    """Damage first, then what else was noticed."""
    share = 100.0 * facts.bytes_damaged / max(facts.bytes_read, 1)
    yield f"{facts.bytes_damaged:,} bytes damaged ({share:.3g} %)" if facts.bytes_damaged else "no damage"
    for finding in facts.findings[:MOST_FINDINGS]:
        at = f" at byte {finding.offset:,}" if finding.offset is not None else ""
        topic = f" ({finding.topic})" if finding.topic else ""
        yield f"{finding.kind}: {finding.message}{at}{topic}"
    if len(facts.findings) > MOST_FINDINGS:
        yield f"and {len(facts.findings) - MOST_FINDINGS} more findings (--json shows all)"


def candidate_table(candidates: Sequence[Candidate]) -> Table:
    """What looks like what; signals are kept whole as far as the width allows, since people copy them."""
    with_source = any(c.source is not None for c in candidates)
    columns = ("Looks like", "Signal", *(("Src",) if with_source else ()), "Rate", "Values")
    rows = [candidate_row(c, with_source) for c in candidates]
    table = table_of(columns, rows, ("Rate",))
    others = sum(min(WIDEST_CELL, max(map(len, cells))) + 2 for cells in zip(columns, *rows, strict=True))
    longest = max(len(line) for row in rows for line in row[1].splitlines())
    own = min(WIDEST_CELL, max(len(row[1]) for row in rows))
    table.columns[1].min_width = max(len("Signal"), min(longest, console().width - (others - own)))
    return table


def candidate_row(c: Candidate, with_source: bool) -> Sequence[str]:
    """One candidate; the signals of a pair below each other."""
    kind = c.quantity.removeprefix("input (").removesuffix(")")
    source = (source_text(c.source),) if with_source else ()
    return kind, c.signal.replace(" + ", "\n"), *source, rate(c.rate_hz), values(c)


def values(c: Candidate) -> str:
    """Range and unit, and below them what the sensor itself says of its quality."""
    return "\n".join(filter(None, (f"{span(c.low, c.high)} {c.unit}".strip(), *c.quality.split(", "))))


def missing_lines(candidates: Sequence[Candidate], declared: Mapping[str, str]) -> Iterator[str]:
    """What a run needs and was neither recognised nor declared."""
    there = {*declared, *(c.quantity for c in candidates)}
    for quantity in ("position", "heading"):
        if quantity not in there:
            yield f"Nothing looks like {quantity}: name its signal under [sensors.{quantity}]."
    if not any(q.startswith("input") for q in there):
        yield "Nothing looks like an input: name the signals under [inputs.NAME]."


def topic_table(topics: Sequence[TopicFacts]) -> Table:
    """Topics with their fields."""
    rows = [
        (t.name or "(columns)", f"{t.messages:,}", rate(t.rate_hz), str(t.gaps or ""), fields(t))
        for t in topics
    ]
    return table_of(("Topic", "Messages", "Rate", "Gaps", "Fields"), rows, ("Messages", "Rate", "Gaps"))


def fields(topic: TopicFacts) -> str:
    """Field names with units (and ranges, where names say little), and the devices, if several."""
    shown = together(topic.fields) if topic.name else topic.fields
    names = ", ".join(field_text(f, with_range=not topic.name) for f in shown)
    devices = f"; sources {', '.join(map(str, topic.sources))}" if len(topic.sources) > 1 else ""
    return names + devices


def together(fields: Iterable[FieldFacts]) -> Iterator[FieldFacts]:
    """The fields, many elements of one array as one: ``covariance[0…35]``."""
    for (array, unit), found in groupby(fields, key=lambda f: (ELEMENT.sub("[", f.name), f.unit)):
        same = list(found)
        if not array.endswith("[") or len(same) <= MOST_ELEMENTS:
            yield from same
            continue
        first, last = (ELEMENT.search(f.name) for f in (same[0], same[-1]))
        if first and last:
            yield FieldFacts(f"{array}{first[1]}…{last[1]}]", unit, None, None)


def field_text(field: FieldFacts, with_range: bool) -> str:
    """One field."""
    said = field.name.rstrip("])").endswith(field.unit)
    unit = f" [{field.unit}]" if field.unit and not said else ""
    return f"{field.name}{unit} {span(field.low, field.high) if with_range else ''}".rstrip()


def rate(hertz: float | None) -> str:
    """A rate with three digits."""
    return f"{hertz:.3g} Hz" if hertz else ""


def source_text(source: int | None) -> str:
    """A device."""
    return "" if source is None else str(source)


def span(low: float | None, high: float | None) -> str:
    """Least to greatest value."""
    if low is None or high is None:
        return ""
    if high <= low:
        return f"always {short(low)}"
    digits = next((n for n in range(3, 12) if short(low, n) != short(high, n)), 12)
    return f"{short(low, digits)}…{short(high, digits)}"


def short(value: float, digits: int = 3) -> str:
    """A number in few characters: with so many digits, and those of whole numbers."""
    whole = f"{value:.0f}" if 1000 <= abs(value) < 1e7 else ""
    return whole if whole and len(whole.lstrip("-")) >= digits else f"{value:.{digits}g}"
