"""The answer of a run in a screenful."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ingest.log import Log
from preprocess.trial import Trial
from seatrial.cli.tables import say, table_of
from validate.diagnosis import ChannelScore, Diagnosis, Results, TakenEffect, Validation, Verdict
from validate.report.contents import log_entry, logs_with_trials
from validate.report.labels import advice_words, finding_words, in_words
from validate.report.names import short_names
from validate.report.reading import NUMBER, OF_ALL, and_others, kinds, log_findings
from validate.report.units import with_input_units
from validate.report.words import (
    BADGES,
    DEGREES,
    duration,
    effect_words,
    headline,
    number,
    percent,
    plus_minus,
    probability,
    share,
    size,
)
from validate.structure_left import seconds_ahead

#: channel: what it is, and the factor from SI to the unit for reading
CHANNELS = {"u": ("surge u, m/s", 1.0), "v": ("sway v, m/s", 1.0), "r": ("yaw rate r, °/s", DEGREES)}
MOST_FINDINGS = 6
#: Share of a log above which it is used as a whole.
MOSTLY = 0.95
#: Kinds of finding of a reader that are told: those after which the samples or their times are other than logged.
NOT_AS_RECORDED = ("clock", "duplicate", "damaged", "truncated")
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
    yield Text(
        f"Free-running on unseen logs: model {results.after.model}, estimator {results.after.estimator}"
    )
    yield score_table(results)
    yield Text("")
    yield Text(headline(results), style="bold")
    if results.diagnosis is not None:
        yield from diagnosis_lines(results.diagnosis, seconds_ahead(results.after.vessel.length))


def log_table(results: Results) -> Table:
    """The logs, one per line."""
    found = logs_with_trials(results)
    shown = short_names([name for name, _, _ in found])
    rows = [log_row(shown[name], log, name, trials) for name, log, trials in found]
    right = ("Lasts", "Read", "Damaged", "Gaps", "Outliers")
    return table_of(("Log", "Role", "Format", *right), rows, right)


def log_row(shown: str, log: Log | None, name: str, trials: list[Trial]) -> Sequence[str]:
    """One log."""
    entry = log_entry(log, name, trials)
    return (
        shown,
        entry.role,
        entry.format,
        lasts(entry.duration_s, trials),
        size(entry.bytes_read),
        f"{entry.bytes_damaged} B" if entry.bytes_damaged else "",
        str(sum(s.gaps for s in entry.signals) or ""),
        str(sum(s.outliers for s in entry.signals) or ""),
    )


def lasts(seconds: float | None, trials: list[Trial]) -> str:
    """How long a log lasts, and how much of that is used where a good part is not."""
    times = [(t.states["t"].min(), t.states["t"].max()) for t in trials if len(t.states)]
    used = max(b for _, b in times) - min(a for a, _ in times) if times else np.inf
    in_part = seconds is not None and used < MOSTLY * seconds
    return f"{duration(used)} of {duration(seconds)}" if in_part else duration(seconds)


def finding_lines(results: Results, most: int | None = MOST_FINDINGS) -> Iterator[str]:
    """What was noticed of the logs and while fitting; of sentences that differ in numbers alone, the first."""
    logs = logs_with_trials(results)
    shown = short_names([name for name, _, _ in logs])
    if most is None:
        own = [f"{shown[name]}: {s}" for name, log, trials in logs for s in all_of(log, trials)]
        lines = [*results.remarks, *own, *results.after.notes]
    else:
        by_log = (
            {name: said_of(trials, usable=False) for name, _, trials in logs},
            {name: of_reading(log) for name, log, _ in logs},
            {name: said_of(trials, usable=True) for name, _, trials in logs},
        )
        lines = [*results.remarks, *(finding_line(k, shown) for x in by_log for k in kinds(x).values())]
        lines += dict.fromkeys(results.after.notes)
    yield from (f"  · {finding_words(line)}" for line in lines[:most])
    if most is not None and len(lines) > most:
        yield f"  · and {len(lines) - most} more in report.html"


def all_of(log: Log | None, trials: list[Trial]) -> list[str]:
    """What was noticed of a log as it was read, and of what was made of it."""
    return list(dict.fromkeys([*log_findings(log), *(s for t in trials for s in t.findings)]))


def said_of(trials: list[Trial], *, usable: bool) -> list[str]:
    """What was noticed of the trials of a log of which something can be used, or nothing."""
    return [s for t in trials if bool(t.segments) == usable for s in t.findings]


def of_reading(log: Log | None) -> list[str]:
    """What of a log is not as it was recorded, one sentence of a kind."""
    told: dict[str, list[str]] = {}
    for f in log.findings if log else ():
        if f.kind in NOT_AS_RECORDED:
            told.setdefault(NUMBER.sub("#", f.message), []).append(f.message)
    return [k[0] + (f", the first of {len(k)} such" if len(k) > 1 else "") for k in told.values()]


def finding_line(by_log: Mapping[str, str], shown: Mapping[str, str]) -> str:
    """A finding with the log that has it; the same sentence in every log without."""
    (name, sentence), others = next(iter(by_log.items())), len(by_log) - 1
    if sentence.startswith(OF_ALL):
        return sentence
    if others and len(by_log) == len(shown) and len(set(by_log.values())) == 1:
        return sentence
    return f"{shown[name]}: {and_others(sentence, others)}"


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
    sides = (before, after) if found else (after,)
    rows = [(what, *(x for v in sides for x in score(v, k, scale))) for k, (what, scale) in CHANNELS.items()]
    if any(v.position_rmse is not None for v in sides):
        rows.append(("position, m", *(x for v in sides for x in (number(v.position_rmse), ""))))
    return table_of(columns, rows, columns[1:])


def score(validation: Validation, channel: str, scale: float) -> tuple[str, str]:
    """RMSE in the unit for reading, and R², of a channel."""
    found: ChannelScore | None = validation.channels.get(channel)
    if found is None:
        return "–", "–"
    return number(None if found.rmse is None else found.rmse * scale), share(found.r2)


def diagnosis_lines(found: Diagnosis, ahead: float) -> Iterator[Text]:
    """The verdict, the effects with their look-alikes, what stays unexplained so many s ahead, and the advice."""
    yield Text(
        f"Verdict: {BADGES[found.verdict].lower()}. {found.verdict.value}", style=STYLES[found.verdict.name]
    )
    yield from (Text(f"  + {effect_line(e)}") for e in found.effects)
    shares = ", ".join(f"{k} {percent(v)}" for k, v in found.unexplained.items())
    far = "" if found.verdict is not Verdict.UNEXPLAINED else ", or of whole logs where that is more"
    yield Text(f"  Unexplained share of {ahead:.0f} s predictions{far}: {shares or 'none'}.")
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
