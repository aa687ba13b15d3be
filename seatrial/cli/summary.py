"""The answer of a run in a screenful."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ingest.log import Log
from preprocess.trial import Trial
from seatrial.cli.tables import say, table_of
from validate.diagnosis import ChannelScore, Diagnosis, Results, TakenEffect, Validation
from validate.report.contents import log_entry, logs_with_trials
from validate.report.labels import advice_words, in_words
from validate.report.units import with_input_units
from validate.report.words import (
    BADGES,
    duration,
    effect_words,
    headline,
    number,
    percent,
    plus_minus,
    probability,
    size,
)

CHANNELS = {"u": "surge u, m/s", "v": "sway v, m/s", "r": "yaw rate r, rad/s"}
MOST_FINDINGS = 6
STYLES = {"ADEQUATE": "green", "EXPLAINED": "green", "AMBIGUOUS": "yellow", "UNEXPLAINED": "red"}


def print_summary(results: Results, folder: Path, verbose: bool = False) -> None:
    """Print what was read, what was found wrong with it, the model, what it lacks, and what to do next."""
    say(*summary(results, verbose), *where(folder, results.timing_s.get("total")))


def summary(results: Results, verbose: bool = False) -> Iterator[RenderableType]:
    """What a run found out, without the places of its files."""
    results = with_input_units(results)
    yield Text("")
    yield log_table(results)
    yield from (Text(line) for line in finding_lines(results, None if verbose else MOST_FINDINGS))
    yield Text("")
    if verbose:
        yield parameter_table(results)
        yield Text("")
    yield score_table(results)
    yield from (Text(line) for line in track_lines(results))
    yield Text("")
    yield Text(headline(results), style="bold")
    if results.diagnosis is not None:
        yield from diagnosis_lines(results.diagnosis)


def log_table(results: Results) -> Table:
    """The logs, one per line."""
    rows = [log_row(name, log, trials) for name, log, trials in logs_with_trials(results)]
    right = ("Lasts", "Read", "Damaged", "Gaps", "Outliers")
    return table_of(("Log", "Role", "Format", *right), rows, right)


def log_row(name: str, log: Log | None, trials: list[Trial]) -> Sequence[str]:
    """One log."""
    entry = log_entry(log, name, trials)
    return (
        name,
        entry.role,
        entry.format,
        duration(entry.duration_s),
        size(entry.bytes_read),
        f"{entry.bytes_damaged} B" if entry.bytes_damaged else "",
        str(sum(s.gaps for s in entry.signals) or ""),
        str(sum(s.outliers for s in entry.signals) or ""),
    )


def finding_lines(results: Results, most: int | None = MOST_FINDINGS) -> Iterator[str]:
    """What was noticed while preprocessing and fitting, each sentence once."""
    sentences = dict.fromkeys(f for t in results.trials for f in t.findings)
    sentences |= dict.fromkeys(results.after.notes)
    yield from (f"  · {sentence}" for sentence in list(sentences)[:most])
    if most is not None and len(sentences) > most:
        yield f"  · and {len(sentences) - most} more in report.html"


def parameter_table(results: Results) -> Table:
    """The coefficients with their errors, those that the data cannot give marked."""
    rows = [
        (
            p.dof,
            p.name,
            p.term,
            plus_minus(p.value, p.stderr),
            p.unit,
            "" if p.identifiable else "not identifiable",
        )
        for p in results.after.coefficients
    ]
    return table_of(("", "Parameter", "Term", "Value", "Unit", ""), rows, ("Value",))


def score_table(results: Results) -> Table:
    """Errors of the free-running prediction of what the fit has not seen, before and after."""
    before, after = results.validation_before, results.validation_after
    found = bool(results.diagnosis and results.diagnosis.effects)
    columns = ("Unseen logs", "RMSE", "R²", *(("RMSE after", "R² after") if found else ()))
    rows = [
        (name, *score(before, key), *(score(after, key) if found else ())) for key, name in CHANNELS.items()
    ]
    table = table_of(columns, rows, columns[1:])
    table.title = f"model {results.after.model}, estimator {results.after.estimator}"
    table.title_justify = "left"
    return table


def score(validation: Validation, channel: str) -> tuple[str, str]:
    """RMSE and R² of a channel."""
    found: ChannelScore | None = validation.channels.get(channel)
    return (number(found.rmse), number(found.r2)) if found else ("–", "–")


def track_lines(results: Results) -> Iterator[str]:
    """Position error before and after."""
    before, after = results.validation_before.position_rmse, results.validation_after.position_rmse
    if before is not None and after is not None:
        change = f" → {number(after)}" if results.diagnosis and results.diagnosis.effects else ""
        yield f"position, m: {number(before)}{change}"


def diagnosis_lines(found: Diagnosis) -> Iterator[Text]:
    """The verdict, the effects with their look-alikes, what stays unexplained, and the advice."""
    yield Text(
        f"Verdict: {BADGES[found.verdict].lower()}. {found.verdict.value}", style=STYLES[found.verdict.name]
    )
    yield from (Text(f"  + {effect_line(e)}") for e in found.effects)
    shares = ", ".join(f"{k} {percent(v)}" for k, v in found.unexplained.items())
    yield Text(f"  Unexplained share of 30 s predictions: {shares or 'none'}.")
    if found.advice:
        yield Text(f"  Next: {advice_words(found.advice)}")


def effect_line(effect: TakenEffect) -> str:
    """One effect with its p-value and its look-alikes."""
    alike = f"; looks like {', '.join(map(in_words, effect.look_alikes))} here" if effect.look_alikes else ""
    return f"{effect_words(effect.fitted)} (p {probability(effect.p_value)}{alike})"


def where(folder: Path, seconds: float | None) -> Iterator[Text]:
    """Where the results are."""
    yield Text("")
    yield Text(f"Report     {folder / 'report.html'}", no_wrap=True)
    yield Text(f"Recording  {folder / 'recording.rrd'}", no_wrap=True)
    yield Text(f"           seatrial view {folder}", no_wrap=True)
    if seconds is not None:
        yield Text(f"Done in {seconds:.1f} s.", style="dim")
