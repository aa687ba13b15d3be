"""ArduPilot DataFlash logs as text (``.log``): a record a line, already scaled, described by FMT lines."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ingest.log import SOURCE
from ingest.reader import Decoded, Reader, ReadOptions

if TYPE_CHECKING:
    import pandas as pd

    from ingest.mavlink.dataflash_format import Format, Meanings

FMT_LINE = re.compile(rb"^FMT, *\d+, *\d+, *\w+, *\w+, *", re.MULTILINE)
LETTERS_OF_TEXT = frozenset("nNZaM")


def sniff(head: bytes) -> float:
    """Near certain with FMT lines."""
    found = len(FMT_LINE.findall(head[:16_384]))
    return 0.98 if found >= 2 else 0.8 * found


def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Decode a DataFlash text log."""
    from ingest.damage import damage_findings
    from ingest.detect import detect
    from ingest.mavlink.dataflash import units, wanted
    from ingest.mavlink.dataflash_clock import utc_of_zero
    from ingest.mavlink.dataflash_rules import RULES, with_accuracy
    from ingest.mavlink.text_lines import find_lines

    lines = find_lines(data)
    groups = grouped(data, lines)
    formats = formats_in(data, lines[groups.get("FMT", np.empty(0, dtype=np.int64))])
    if not formats:
        raise ValueError("no FMT line, so that nothing else can be decoded")
    good = np.zeros(len(lines), dtype=bool)
    whole = {
        name: parsed(data, lines, groups[name], f, good) for name, f in formats.items() if name in groups
    }
    formats = meant(whole, formats)
    times = timeline(whole, groups, formats, len(lines))
    tables = {
        topic: table
        for name, frame in whole.items()
        if options.topics is None or wanted(name, options.topics)
        for topic, table in by_instance(formats[name], with_time(frame, times)).items()
    }
    if not any(len(t) for t in whole.values()):
        raise ValueError("no line that fits its FMT line")
    tables = with_accuracy(tables)
    utc, clock = utc_of_zero(tables)
    bad = ~good & (lines["end"] > lines["start"])
    start, end = lines["start"][bad], lines["end"][bad]
    return Decoded(
        tables=tables,
        units=units(tables, {(f.kind, 0): f for f in formats.values()}),
        utc_of_index_zero_ns=utc,
        findings=(*damage_findings(np.column_stack([start, end - start]), len(data)), *clock),
        messages=int(good.sum()),
        bytes_damaged=int((end - start).sum()),
        sources=detect(RULES, tables),
    )


def grouped(data: memoryview, lines: NDArray[np.void]) -> dict[str, NDArray[np.int64]]:
    """Positions of the lines by first word; words that cannot be names of records are left out."""
    order = np.argsort(lines["hash"], kind="stable")
    _, first = np.unique(lines["hash"][order], return_index=True)
    out = {}
    for which in np.split(order, first[1:]):
        line = lines[which[0]] if len(which) else None
        word = bytes(data[int(line["start"]) : int(line["word"])]) if line is not None else b""
        if re.fullmatch(rb"\w{1,16}", word):
            out[word.decode("ascii")] = which
    return out


def formats_in(data: memoryview, lines: NDArray[np.void]) -> dict[str, Format]:
    """Give the formats that FMT lines define, by name."""
    from ingest.mavlink.dataflash_format import TYPES, Format, unique

    out = {}
    for line in lines:
        parts = bytes(data[int(line["start"]) : int(line["end"])]).decode("latin-1").split(",", 5)
        parts = [p.strip() for p in parts]
        if len(parts) < 5 or not parts[1].isdecimal() or any(x not in TYPES for x in parts[4]):
            continue
        columns = [c.strip() for c in parts[5].split(",")] if len(parts) > 5 else []
        columns = (columns + [f"field{k}" for k in range(len(columns), len(parts[4]))])[: len(parts[4])]
        out[parts[3]] = Format(int(parts[1]) & 255, parts[3], parts[4], tuple(unique(columns)))
    return {name: layout for name, layout in out.items() if layout.columns}


def parsed(
    data: memoryview,
    lines: NDArray[np.void],
    which: NDArray[np.int64],
    layout: Format,
    good: NDArray[np.bool_],
) -> pd.DataFrame:
    """Give the lines of one type that fit, indexed by their position; marks them in ``good``."""
    import pandas as pd

    from ingest.mavlink.text_lines import rests

    width = len(layout.columns)
    commas = lines["commas"][which]
    open_end = layout.letters[-1] in "NZ"
    printable = lines["odd"][which] == 0
    which = which[((commas == width) & printable) | (open_end & (commas >= width))]
    if open_end:
        frame = split_text(rests(data, lines[which]), layout)
    else:
        text = io.BytesIO(rests(data, lines[which]))
        frame = pd.read_csv(
            text, header=None, names=list(layout.columns), skipinitialspace=True, quoting=3,
            na_values=["nan", "-nan"], keep_default_na=False, encoding="latin-1", skip_blank_lines=False,
            index_col=False, low_memory=False,
        )  # fmt: skip
    frame, fits = typed(frame, layout)
    good[which[fits]] = True
    return frame[fits].set_axis(which[fits], axis=0)


def split_text(text: bytes, layout: Format) -> pd.DataFrame:
    """Lines whose last field is text and may hold commas itself (few)."""
    import pandas as pd

    width = len(layout.columns)
    rows = [line.decode("latin-1").split(",", width - 1) for line in text.split(b"\n")[:-1]]
    return pd.DataFrame([[x.strip() for x in r] for r in rows], columns=list(layout.columns), dtype=object)


def typed(frame: pd.DataFrame, layout: Format) -> tuple[pd.DataFrame, NDArray[np.bool_]]:
    """Numbers as numbers, and which rows have them all."""
    import pandas as pd

    fits = np.ones(len(frame), dtype=bool)
    columns = {}
    for name, letter in zip(layout.columns, layout.letters, strict=True):
        values = frame[name]
        if letter in LETTERS_OF_TEXT:
            columns[name] = values
            continue
        numbers = pd.to_numeric(values, errors="coerce")
        if values.dtype.kind not in "iuf":
            fits &= numbers.notna().to_numpy() | values.isin(["nan", "-nan", ""]).to_numpy()
        columns[name] = numbers
    if layout.time_width:
        t = columns[layout.columns[0]].to_numpy(dtype=float)
        fits &= (t >= 0) & (t < 9e15 / 8 ** (8 - layout.time_width))
    return pd.DataFrame(columns), fits


def meant(whole: Mapping[str, pd.DataFrame], formats: Mapping[str, Format]) -> dict[str, Format]:
    """Give the formats with units and instances."""
    from ingest.mavlink.dataflash_format import with_meaning

    meanings = meanings_in(whole)
    return {name: with_meaning(layout, meanings) for name, layout in formats.items()}


def meanings_in(whole: Mapping[str, pd.DataFrame]) -> Meanings:
    """Give what UNIT, MULT and FMTU lines say."""
    from ingest.mavlink.dataflash_format import Meanings

    def rows(name: str, *columns: str) -> list[tuple[object, ...]]:
        table = whole.get(name)
        if table is None or not set(columns) <= set(table.columns):
            return []
        return list(table[list(columns)].itertuples(index=False, name=None))

    return Meanings(
        units={identifier(i): str(label) for i, label in rows("UNIT", "Id", "Label")},
        multipliers={identifier(i): float(str(m)) for i, m in rows("MULT", "Id", "Mult")},
        by_kind={
            identifier(k): (str(u), str(m)) for k, u, m in rows("FMTU", "FmtType", "UnitIds", "MultIds")
        },
    )


def identifier(value: object) -> int:
    """Code of a unit or multiplier, written as a number."""
    return int(float(str(value))) & 255


def timeline(
    whole: Mapping[str, pd.DataFrame],
    groups: Mapping[str, NDArray[np.int64]],
    formats: Mapping[str, Format],
    count: int,
) -> NDArray[np.int64]:
    """Nanoseconds since boot of every line, in order; those without a time take that before."""
    from ingest.clock import continue_clock, mended
    from ingest.mavlink.dataflash import carried

    t = np.full(count, -1, dtype=np.int64)
    for name, table in whole.items():
        width = formats[name].time_width
        if width and len(table):
            factor = 1_000 if width == 8 else 1_000_000
            t[table.index.to_numpy()] = table[formats[name].columns[0]].to_numpy(dtype=np.int64) * factor
    timed = t >= 0
    at = np.flatnonzero(timed)
    good, _ = mended(t[timed], np.zeros(len(at), dtype=bool), at)
    good, _ = continue_clock(good)
    return carried(t, timed, good)


def with_time(frame: pd.DataFrame, times: NDArray[np.int64]) -> pd.DataFrame:
    """Give the table, indexed by time."""
    return frame.set_axis(times[frame.index.to_numpy(dtype=np.int64)], axis=0)


def by_instance(layout: Format, whole: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Give the table by topic: the lowest instance has the plain name, the others their number behind it."""
    if layout.instance is None or not len(whole):
        return {layout.name: whole}
    instance = whole[layout.instance].to_numpy(dtype=float)
    numbers = [int(k) for k in np.unique(instance[np.isfinite(instance)])]
    names = [layout.name, *(f"{layout.name}[{k}]" for k in numbers[1:])]
    return {
        name: whole[instance == k].assign(**{SOURCE: np.int32(k)})
        for name, k in zip(names, numbers, strict=True)
        if abs(k) < 2**31
    }


DATAFLASH_TEXT = Reader("dataflash_text", (".log", ".txt"), sniff, read)
