"""How a delimited text is written: encoding, delimiter, decimal mark, header, names of the columns."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ingest.tabular.naming import is_unit, split_unit
from ingest.tabular.sexagesimal import is_written
from ingest.tabular.timeline import TIME_NAMES

NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eEdD][+-]?\d+)?$")
#: A number whose thousands are told apart: by commas, or by points where the decimal mark is a comma.
GROUPED = {",": r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d*)?$", ".": r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?$"}
MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "inf", "-inf", "-", "--", "*", "?"})
TIME = re.compile(
    r"(\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d([.,]\d+)?)?(Z|[+-]\d\d:?\d\d)?)?|\d\d?:\d\d(:\d\d([.,]\d+)?)?)$"
)
DELIMITERS = ("\t", ";", ",", "|", " ")
COMMENTS = ("#", "%", "//", "!")
HEAD = 1 << 16


class HeaderAlone(ValueError):
    """A text is the header of a table, and nothing else."""

    def __init__(self, names: Sequence[str]) -> None:
        super().__init__(f"a header ({', '.join(names)}) and no row below it")


@dataclass(frozen=True)
class Dialect:
    """The form of a delimited text.

    Attributes
    ----------
    encoding, delimiter, decimal : str
        A blank as delimiter stands for any run of blanks and tabs.
    body : int
        Byte offset of the first line of data.
    columns : tuple of str
        Name of each column.
    units : mapping of str to str
        Units from a row of units below the header.
    likeness : float
        Share of the fields in the head that are numbers, times or empty.
    """

    encoding: str
    delimiter: str
    decimal: str
    body: int
    columns: tuple[str, ...]
    units: Mapping[str, str]
    likeness: float


def encoding_of(head: bytes) -> str:
    """UTF-8 (with or without its mark), UTF-16 with its mark, or else the Western European code page."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    try:
        head[: max(0, len(head) - 4)].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig" if head.startswith(b"\xef\xbb\xbf") else "utf-8"


def split(line: str, delimiter: str) -> list[str]:
    """Return the fields of a line, stripped of blanks and quotes."""
    if delimiter == " ":
        return line.split()
    if '"' in line:
        return [_unquoted(field.strip()) for field in _outside_quotes(line, delimiter)]
    return [field.strip() for field in line.split(delimiter)] if line.strip() else []


def _outside_quotes(line: str, delimiter: str) -> list[str]:
    """The fields of a line as they stand; a delimiter between quotes is none (RFC 4180)."""
    parts = line.split('"')
    parts[::2] = [part.replace(delimiter, "\n") for part in parts[::2]]
    return '"'.join(parts).split("\n")


def _unquoted(field: str) -> str:
    quoted = len(field) > 1 and field[0] == field[-1] == '"'
    return field[1:-1].replace('""', '"').strip() if quoted else field.strip('"')


def is_value(field: str) -> bool:
    """Whether a field is a number, a time or a latitude, or says that there is none."""
    grouped = "," in field and "." in field and any(re.match(form, field) for form in GROUPED.values())
    plain = NUMBER.match(field) or grouped or field.lower() in MISSING or TIME.match(field)
    return bool(plain) or is_written(field)


def likeness_of(fields: Sequence[str]) -> float:
    """Share of the fields that are values; 0 where none is a number or a time."""
    known = sum(map(is_value, fields))
    return known / len(fields) if any(f and is_value(f) for f in fields) else 0.0


def detect(head: bytes, given: Mapping[str, object] | None = None) -> Dialect:
    """Detect the form of a text from its first bytes; what is ``given`` is taken as it is.

    Parameters
    ----------
    head : bytes
        The first 64 KiB.
    given : mapping, optional
        ``columns`` (a list, or names separated by blanks), ``skip`` (lines), ``delimiter``, ``encoding``,
        ``decimal``.

    Raises
    ------
    ValueError
        Where no line looks like a row of numbers; ``HeaderAlone`` where there is but a header.
    """
    given = given or {}
    encoding = str(given.get("encoding") or encoding_of(head))
    lines = _lines(head, encoding)
    skip = int(str(given.get("skip", 0)))
    _beyond_header(lines[skip:])
    delimiter = str(given["delimiter"]) if given.get("delimiter") else _best_delimiter(lines[skip:])
    delimiter = " " if delimiter.strip(" ") == "" else delimiter[:1]
    rows = [split(line, delimiter) for line in lines]
    width, first = _first_row(rows, skip, given.get("columns"))
    columns, units = _header(rows[skip:first], lines[skip:first], width, delimiter)
    if given.get("columns"):
        columns, units = _named(given["columns"]), {}
    body = sum(map(len, re.findall(rb"[^\n]*\n|[^\n]+$", head)[:first]))
    below = [row for row in rows[first : first + 100] if any(row)]
    table = [row for row in below if len(row) == width]
    likeness = sum(map(likeness_of, table)) / max(1, len(below))
    decimal = str(given.get("decimal") or _decimal(table, delimiter))
    return Dialect(encoding, delimiter, decimal, body, columns, units, likeness)


def _beyond_header(lines: Sequence[str]) -> None:
    """Make sure that there is more than one line of names, one of which is that of a clock."""
    written = [line for line in lines if line.strip()]
    for names in (split(line, mark) for line in written for mark in DELIMITERS if len(written) == 1):
        if len(names) > 1 and any(split_unit(name)[0] in TIME_NAMES for name in names):
            raise HeaderAlone(names)


def _named(columns: object) -> tuple[str, ...]:
    names = columns.replace(",", " ").split() if isinstance(columns, str) else columns
    if not isinstance(names, Sequence):
        raise ValueError(f"dialect.columns must be a list of names, found {columns!r}")
    return tuple(map(str, names))


def _lines(head: bytes, encoding: str) -> list[str]:
    text = head.decode("utf-8" if encoding == "utf-8-sig" else encoding, "replace")
    lines = [line.rstrip("\r").lstrip("\ufeff") for line in text.split("\n")]
    return lines[:-1] if len(lines) > 2 and len(head) >= HEAD else lines


def _best_delimiter(lines: Sequence[str]) -> str:
    tail = [line for line in lines if line.strip() and not line.lstrip().startswith(COMMENTS)][-60:]

    def score(delimiter: str) -> float:
        rows = [split(line, delimiter) for line in tail]
        counts = Counter(len(row) for row in rows if len(row) > 1)
        if not counts:
            return 0.0
        width = max(counts, key=lambda n: (counts[n], n))
        return sum(likeness_of(row) for row in rows if len(row) == width) / len(rows)

    return max(DELIMITERS, key=score)


def _first_row(rows: Sequence[Sequence[str]], skip: int, columns: object) -> tuple[int, int]:
    """Width of the table and index of its first row of values, which may have lost some."""
    data = [(i, len(r)) for i, r in enumerate(rows) if i >= skip and len(r) > 1 and likeness_of(r) >= 0.5]
    if not data:
        raise ValueError("no line looks like a row of numbers")
    width = len(_named(columns)) if columns else Counter(n for _, n in data).most_common(1)[0][0]
    first = next((i for i, n in data if n == width), None)
    if first is None:
        found = Counter(n for _, n in data).most_common(1)[0][0]
        raise ValueError(f"dialect.columns names {width} columns, the rows have {found}")
    of_values = {i for i, _ in data}
    while first - 1 in of_values:
        first -= 1
    return width, first


def _header(
    rows: Sequence[list[str]], lines: Sequence[str], width: int, delimiter: str
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names and units from the lines above the first row of values."""
    candidates = []
    for row, line in zip(rows, lines, strict=True):
        bare = line.lstrip()
        mark = next((m for m in COMMENTS if bare.startswith(m)), "")
        fields = (
            split(bare[len(mark) :].strip() if delimiter == " " or mark else bare, delimiter) if mark else row
        )
        if len(fields) == width and any(fields):
            candidates.append(fields)
    if not candidates:
        return tuple(f"c{i}" for i in range(width)), {}
    names, units = candidates[-1], {}
    if len(candidates) > 1 and all(is_unit(f.strip("[]()")) or not f for f in candidates[-1]):
        names = candidates[-2]
        below = zip(_unique(names), candidates[-1], strict=True)
        units = {n: u.strip("[]()") for n, u in below if u.strip("[]()-")}
    return _unique(names), units


def _unique(names: Sequence[str]) -> tuple[str, ...]:
    seen: Counter[str] = Counter()
    result = []
    for i, name in enumerate(names):
        name = name or f"c{i}"
        seen[name] += 1
        result.append(name if seen[name] == 1 else f"{name}.{seen[name] - 1}")
    return tuple(result)


def _decimal(rows: Sequence[Sequence[str]], delimiter: str) -> str:
    numbers = [f for row in rows for f in row if NUMBER.match(f)]
    commas = [f for f in numbers if "," in f]
    if any("." in f for f in numbers) or not commas:
        return "."
    # between commas a field with one is quoted, and may be a whole number with its thousands told apart
    return "." if delimiter == "," and all(re.match(GROUPED["."], f) for f in commas) else ","
