"""Many campaigns at once: each a task of its own, finished ones not run again, a summary that grows as they finish."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ingest.errors import SeatrialError, UsageError
from seatrial.campaign import check_number, load_campaign
from seatrial.campaign.load import bytes_of, campaign_file
from seatrial.parallel import Done, Failure, map_tasks
from seatrial.writable import check_file, check_folder

if TYPE_CHECKING:
    import pandas as pd

#: Name of a campaign's file, and how a summary may be written.
FILENAME, SUFFIXES = "campaign.toml", (".csv", ".parquet")
#: Status of a campaign; it is wrong where its file is, or names a log or a signal that is not there.
DONE, FAILED, WRONG = "done", "failed", "wrong campaign"
COLUMNS = (
    "campaign", "status", "vessel", "model", "verdict", "effects", "look_alikes", "fitness_before", "fitness_after",
    "r2_u", "r2_v", "r2_r", "position_rmse", "unexplained_u", "unexplained_v", "unexplained_r", "seconds", "error",
    "results", "key",
)  # fmt: skip

Row = dict[str, Any]


@dataclass(frozen=True)
class Options:
    """Options of every run, as those of ``seatrial.run``."""

    model: str | None = None
    estimator: str | None = None
    optimiser: str | None = None
    seed: int = 0
    loop: bool = True


@dataclass(frozen=True)
class Voyage:
    """One campaign of a fleet: its file, where its results go, and what it was made of."""

    campaign: str
    results: str
    options: Options
    key: str


def campaigns_in(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Campaign files: those named, and every one below a folder that is none itself.

    Raises
    ------
    UsageError
        A path leads to no campaign.
    """
    found: list[Path] = []
    for path in paths:
        below = sorted(path.glob(f"**/{FILENAME}")) if path.is_dir() else []
        found += below if below and not (path / FILENAME).is_file() else [campaign_file(path)]
    return tuple(dict.fromkeys(p.resolve() for p in found))


def voyages(files: Sequence[Path], options: Options, folder: Path | None = None) -> tuple[Voyage, ...]:
    """What is to be run; results go beside each campaign, or into a folder of its own under ``folder``."""
    return tuple(
        Voyage(str(f), str(_results_of(f, files, folder)), options, key_of(f, options)) for f in files
    )


def _results_of(file: Path, files: Sequence[Path], folder: Path | None) -> Path:
    if folder is None:
        return file.parent / "results"
    names = [f.parent.name for f in files]
    name = file.parent.name
    again = names[: list(files).index(file)].count(name)
    return folder.absolute() / (f"{name}-{again + 1}" if again else name)


def key_of(file: Path, options: Options) -> str:
    """Digest of the campaign's text, its folder's files (names, sizes, times) and the options."""
    sha = hashlib.sha256(json.dumps(asdict(options), sort_keys=True).encode())
    sha.update(bytes_of(file))
    for log in logs_of(file):
        facts = log.stat()
        sha.update(f"{log.name} {facts.st_size} {facts.st_mtime_ns}".encode())
    return sha.hexdigest()


def logs_of(file: Path) -> tuple[Path, ...]:
    """The logs that a campaign names; none where it cannot be read (its run says why)."""
    try:
        return tuple(entry.file for entry in load_campaign(file).logs)
    except SeatrialError:
        return ()


def run_voyage(voyage: Voyage) -> Row:
    """Run one campaign and sum up its report."""
    from seatrial.pipeline import run

    options = asdict(voyage.options)
    began = time.perf_counter()
    run(load_campaign(voyage.campaign), voyage.results, **options)
    return summed_up(voyage, time.perf_counter() - began)


def summed_up(voyage: Voyage, seconds: float) -> Row:
    """A row of the summary, from the report that a run wrote."""
    report = json.loads((Path(voyage.results) / "report.json").read_text(encoding="utf-8"))
    before, after = report["validation"]["before"], report["validation"]["after"]
    diagnosis = report["diagnosis"] or {}
    effects = diagnosis.get("effects", [])
    row: Row = {
        "campaign": voyage.campaign,
        "status": DONE,
        "vessel": report["vessel"],
        "model": report["model"],
        "verdict": diagnosis.get("verdict"),
        "effects": ", ".join(_named(e) for e in effects),
        "look_alikes": ", ".join(dict.fromkeys(n for e in effects for n in e["look_alikes"])),
        "fitness_before": before["fitness"],
        "fitness_after": after["fitness"],
        "position_rmse": after["position_rmse"],
        "seconds": seconds,
        "results": voyage.results,
        "key": voyage.key,
    }
    for channel in ("u", "v", "r"):
        row[f"r2_{channel}"] = (after["channels"].get(channel) or {}).get("r2")
        row[f"unexplained_{channel}"] = (diagnosis.get("unexplained") or {}).get(channel)
    return row


def _named(effect: Mapping[str, Any]) -> str:
    return f"{effect['name']} ({effect['input']})" if effect.get("input") else str(effect["name"])


def fleet(
    planned: Sequence[Voyage],
    summary: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    again: bool = False,
    tell: Callable[[Row, int, int], None] = lambda row, count, total: None,
) -> pd.DataFrame:
    """Run what is not finished yet, and write the summary anew after each.

    Parameters
    ----------
    planned : sequence of Voyage
    summary : Path
        ``.csv`` or ``.parquet``; what it holds of earlier runs is kept.
    workers, scheduler
        As for ``map_tasks``.
    again : bool
        Run finished ones too.
    tell : callable
        Told ``(row, finished, total)``.

    Returns
    -------
    DataFrame
        One row per campaign, in the order given.
    """
    check_number("workers", workers, 1)
    known = {r["campaign"]: r for r in read_summary(summary)}
    kept = {} if again else {v.campaign: known[v.campaign] for v in planned if finished(v, known)}
    rows: dict[str, Row] = known | kept
    write_summary(rows, summary)
    left = [v for v in planned if v.campaign not in kept]
    for count, (voyage, row) in enumerate(_runs(left, workers, scheduler), 1):
        rows[voyage.campaign] = row
        write_summary(rows, summary)
        tell(row, len(kept) + count, len(planned))
    return table_of_rows([rows[v.campaign] for v in planned])


def _runs(left: Sequence[Voyage], workers: int, scheduler: str | None) -> Iterator[tuple[Voyage, Row]]:
    for done in map_tasks(run_voyage, left, workers, scheduler):
        yield left[done.index], _row_of(left[done.index], done)


def _row_of(voyage: Voyage, done: Done[Row]) -> Row:
    if done.failure is None:
        return done.result()
    status = WRONG if issubclass(done.failure.kind, UsageError) else FAILED
    why = _sentence(done.failure)
    return {"campaign": voyage.campaign, "status": status, "error": why, "results": "", "key": voyage.key}


def _sentence(failure: Failure) -> str:
    text = " ".join(str(failure.error()).split())
    return text if issubclass(failure.kind, SeatrialError) else f"unexpected {failure.kind.__name__}: {text}"


def finished(voyage: Voyage, known: Mapping[str, Row]) -> bool:
    """Whether a campaign was run with the same logs, text and options, and its results are still there."""
    row = known.get(voyage.campaign, {})
    there = (
        row.get("status") == DONE and row.get("key") == voyage.key and row.get("results") == voyage.results
    )
    return there and (Path(voyage.results) / "report.json").is_file()


def table_of_rows(rows: Sequence[Row]) -> pd.DataFrame:
    """The rows as a table with all columns."""
    import pandas as pd

    return pd.DataFrame(list(rows)).reindex(columns=list(COLUMNS))


def checked_summary(path: Path) -> Path:
    """The path itself, if a summary can be written there.

    Raises
    ------
    UsageError
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"--out: expected a file {' or '.join(SUFFIXES)}, found '{path.name}'.")
    check_file(path, "--out")
    check_folder(path.absolute().parent, "--out")
    return path


def read_summary(path: Path) -> list[Row]:
    """Rows of an earlier summary; none where there is no such file.

    Raises
    ------
    UsageError
        The file holds something else.
    """
    import pandas as pd

    if not path.is_file():
        return []
    try:
        table = pd.read_csv(path) if path.suffix.lower() == ".csv" else pd.read_parquet(path)
    except (ValueError, OSError) as error:
        raise UsageError(f"--out: {path} is there and holds no summary ({error}).") from error
    if not set(COLUMNS) <= set(table.columns):
        raise UsageError(f"--out: {path} is there and holds no summary. Give another name.")
    return [{str(k): v for k, v in r.items() if v == v} for r in table.to_dict("records")]


def write_summary(rows: Mapping[str, Row], path: Path) -> None:
    """Write the summary beside its place, then move it there, so that it is never half written."""
    table = table_of_rows(list(rows.values()))
    for column in ("error", "results", "verdict", "effects", "look_alikes", "vessel", "model"):
        table[column] = table[column].astype("string")
    unfinished = path.with_name(f".{path.name}")
    if path.suffix.lower() == ".csv":
        table.to_csv(unfinished, index=False)
    else:
        table.to_parquet(unfinished, index=False)
    unfinished.replace(path)
