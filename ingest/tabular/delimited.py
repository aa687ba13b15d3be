"""The reader of delimited text: CSV, TSV, blank-separated ``.dat``, exports of IMU software."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from ingest.blocks import fit_together
from ingest.clock import continue_clock, without_strays
from ingest.log import Finding, Source
from ingest.reader import Decoded, Reader, ReadOptions
from ingest.repeats import repeated, said
from ingest.tabular.beyond import without_beyond
from ingest.tabular.dialect import GROUPED, HEAD, Dialect, HeaderAlone, detect, encoding_of
from ingest.tabular.lines import NEWLINE, Lines, Spans, count_fields, runs, spans_of, with_whole_fields
from ingest.tabular.namesakes import namesakes
from ingest.tabular.naming import sources_of, split_unit
from ingest.tabular.positions import in_degrees
from ingest.tabular.timeline import Clock, Nanoseconds, clock_of
from ingest.tabular.unstated import GUESSED

TOPIC = ""
#: How sure a header alone is a table: enough to say so.
HARDLY = 0.02


def sniff(head: bytes) -> float:
    """How sure the bytes are delimited text: never above one half, other text formats are surer of theirs."""
    if not head.startswith((b"\xff\xfe", b"\xfe\xff")):
        control = sum(head.count(c) for c in (b"\x00", b"\x01", b"\x02", b"\x03", b"\x04", b"\x06"))
        if control > len(head) // 1000:
            return 0.0
    try:
        text = with_whole_fields(as_plain_text(memoryview(head), encoding_of(head)))
        dialect = detect(text.tobytes())
    except HeaderAlone:
        return HARDLY
    except (ValueError, LookupError):
        return 0.0
    return 0.5 * dialect.likeness if dialect.likeness > 0.5 else 0.0


def as_plain_text(data: memoryview, encoding: str) -> memoryview:
    """Return the text with one byte per line end and ASCII digits: UTF-16 recoded, old line ends replaced."""
    if _is_wide(encoding):
        data = memoryview(data.tobytes()[: len(data) & ~1].decode(encoding, "replace").encode("utf-8"))
    head = bytes(data[:HEAD])
    if b"\n" not in head and b"\r" in head:
        return memoryview(data.tobytes().replace(b"\r", b"\n"))
    return data


def _is_wide(encoding: str) -> bool:
    return encoding.lower().replace("_", "-").startswith("utf-16")


def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Read delimited text into one table of the topic ``""``.

    Raises
    ------
    ValueError
        Where no line looks like a row of numbers, or no column looks like time.
    """
    given = dict(options.dialect)
    encoding = str(given.get("encoding") or encoding_of(bytes(data[:HEAD])))
    if _is_wide(encoding) and b"\0" not in bytes(data[:HEAD]):
        given["encoding"] = encoding = "utf-8"  # as it is by now
    text = as_plain_text(data, encoding)
    if text is not data:
        given["encoding"] = "utf-8"
    text = with_whole_fields(text)
    dialect = detect(bytes(text[:HEAD]), given)
    array = np.frombuffer(text, np.uint8)
    lines = count_fields(array, dialect.delimiter, dialect.body)
    whole = _whole_lines(lines, len(dialect.columns))
    if whole.sum() < 2:
        raise ValueError("a table of one row, which is too short for a log")
    findings = _bad_lines(lines, whole, array)
    frame = _parse(text, spans_of(lines, whole | (lines.fields == 0)), dialect)
    del lines, whole
    table, cells = _numbers(frame, dialect.decimal)
    decoded = timed(table, {str(k): v for k, v in dialect.units.items()})
    bad = sum(f.length or 0 for f in findings)
    findings += [*cells, *namesakes(table, TOPIC)]
    return Decoded(
        tables=decoded.tables,
        units=decoded.units,
        utc_of_index_zero_ns=decoded.utc_of_index_zero_ns,
        findings=(*findings, *decoded.findings),
        messages=len(decoded.tables[TOPIC]),
        bytes_damaged=bad,
        sources=decoded.sources,
    )


def timed(table: pd.DataFrame, units: dict[str, str], topic: str = TOPIC) -> Decoded:
    """Return a table with its time column found, as what a reader gives.

    Raises
    ------
    ValueError
        Where no column looks like time.
    """
    table, beyond = without_beyond(table, topic)
    clock = clock_of(table, units)
    if clock is None or not clock.good.any():
        raise ValueError(f"no column looks like time; columns: {', '.join(map(str, table.columns))}")
    findings = _remarks(clock)
    table = table if clock.good.all() else table[clock.good]
    table, ns, twice = _once(table, clock.ns[clock.good])
    ns, strayed = without_strays(ns)
    ns, clock_findings = (ns, []) if fit_together(ns) else continue_clock(ns)
    table = table.set_axis(pd.Index(ns, name="t_ns"), axis=0)
    stated = {c: units.get(c) or split_unit(c)[1] for c in map(str, table.columns)}
    table, stated, positions = in_degrees(table, stated)
    sources = sources_of(table, units | stated, topic)
    return Decoded(
        tables={topic: table},
        units={(topic, c): u for c, u in stated.items() if u},
        utc_of_index_zero_ns=0 if clock.utc else None,
        findings=(*beyond, *findings, *twice, *strayed, *clock_findings, *positions, *_guessed(sources)),
        messages=len(table),
        sources=sources,
    )


def _once(table: pd.DataFrame, ns: Nanoseconds) -> tuple[pd.DataFrame, Nanoseconds, list[Finding]]:
    """A table and its times without blocks of rows that follow their like."""
    if not (np.diff(ns) < 0).any():
        return table, ns, []
    rows = pd.util.hash_pandas_object(table, index=False).to_numpy()
    twice = repeated(
        ns, np.ones(len(ns), bool), lambda a, b, n: np.array_equal(rows[a : a + n], rows[b : b + n])
    )
    return table[~twice], ns[~twice], said(twice, TOPIC)


def _remarks(clock: Clock) -> list[Finding]:
    missing = int((~clock.good).sum())
    found = [Finding("clock", clock.note)] if clock.note else []
    if missing:
        found.append(Finding("damaged", f"{missing} rows without a time in '{clock.column}'", count=missing))
    return found


def _guessed(sources: tuple[Source, ...]) -> list[Finding]:
    return [_guess(s) for s in sources if GUESSED in s.options]


def _guess(source: Source) -> Finding:
    said = f"'{source.name}' states no unit; taken as {source.unit} from {source.options[GUESSED]}"
    return Finding("note", said, topic=source.topic, signal=source.name)


def _whole_lines(lines: Lines, width: int) -> np.ndarray:
    whole = lines.fields == width
    if not whole.any():
        raise ValueError(f"no line has {width} fields")
    return cast("np.ndarray", whole)


def _bad_lines(lines: Lines, whole: np.ndarray, array: np.ndarray) -> list[Finding]:
    findings = []
    for a, b in runs(~whole & (lines.fields > 0)):
        start, end = int(lines.start[a]), int(lines.end[b - 1])
        cut = end == len(array) and b - a == 1 and array[-1] != NEWLINE
        kind, text = (
            ("truncated", "the last line is cut off") if cut else ("damaged", _says(lines, whole, a, b))
        )
        findings.append(Finding(kind, text, offset=start, length=end - start, topic=TOPIC, count=b - a))
    return findings


def _says(lines: Lines, whole: np.ndarray, a: int, b: int) -> str:
    width = int(lines.fields[np.argmax(whole)])
    found = "/".join(str(n) for n in sorted(set(lines.fields[a:b].tolist()))[:4])
    return f"{b - a} lines with {found} fields instead of {width}"


def _parse(text: memoryview, pieces: Iterable[list[tuple[int, int]]], dialect: Dialect) -> pd.DataFrame:
    """The table of a text, parsed piece by piece: what the parser holds is as large as a piece."""
    frames = [_parse_piece(text, spans, dialect) for spans in pieces if spans]
    return frames[0] if len(frames) == 1 else joined(frames)


def joined(frames: list[pd.DataFrame]) -> pd.DataFrame:
    """Tables below each other, column by column, each let go as soon as it is copied."""
    names = list(frames[0].columns)
    columns = {name: pd.concat([f.pop(name) for f in frames], ignore_index=True) for name in names}
    return pd.DataFrame(columns, copy=False)


def _parse_piece(text: memoryview, spans: list[tuple[int, int]], dialect: Dialect) -> pd.DataFrame:
    blank = dialect.delimiter == " "
    return pd.read_csv(
        io.BufferedReader(Spans(text, spans), 1 << 20),
        header=None,
        names=list(dialect.columns),
        index_col=False,
        sep=r"\s+" if blank else dialect.delimiter,
        skipinitialspace=True,
        decimal=dialect.decimal,
        encoding=dialect.encoding,
        encoding_errors="replace",
        na_values=["-", "--", "*", "?", "NAN", "none", "None"],
        low_memory=False,
    )


def _numbers(frame: pd.DataFrame, decimal: str) -> tuple[pd.DataFrame, list[Finding]]:
    """Columns of text that are mostly numbers become numbers; the cells that are not are findings."""
    columns, findings = {}, []
    for name in frame.columns:
        column = frame[name]
        if not pd.api.types.is_numeric_dtype(column):
            column, bad = _as_numbers(column, decimal)
            if bad:
                text = f"{bad} cells of '{name}' are not numbers"
                findings.append(Finding("damaged", text, topic=TOPIC, count=bad))
        columns[str(name)] = column
    return pd.DataFrame(columns), findings


def _as_numbers(column: pd.Series, decimal: str) -> tuple[pd.Series, int]:
    present = column.notna()
    text = column.astype(str).str.strip().str.replace(r"(?<=[\d.])[dD](?=[+-]?\d)", "e", regex=True)
    numbers = pd.to_numeric(text.where(present), errors="coerce")
    grouped = present & numbers.isna() & text.str.match(GROUPED[decimal])
    if grouped.any():
        whole = text[grouped].str.replace("." if decimal == "," else ",", "").str.replace(",", ".")
        numbers[grouped] = pd.to_numeric(whole, errors="coerce")
    if not present.any() or numbers[present].notna().mean() < 0.5:
        return column, 0
    return numbers.astype(float), int((present & numbers.isna()).sum())


DELIMITED = Reader("csv", (".csv", ".tsv", ".dat", ".txt", ".asc"), sniff, read)
