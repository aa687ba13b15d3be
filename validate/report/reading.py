"""What was read and what was wrong with it, as rows of the report."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from ingest.log import Log
from preprocess.trial import Trial
from validate.report import words
from validate.report.schema import LogEntry, SignalEntry

#: How a finding begins that is about the logs together.
OF_ALL = "The logs to identify on: "
NUMBER = re.compile(r"\d+(?:\.\d+)?")
#: Logs from which on a sentence that differs in numbers alone is said once.
SEVERAL = 4


def signal_rows(entries: list[LogEntry]) -> list[dict[str, Any]]:
    """Signals by name and source: number of logs, rates, gaps and samples set aside."""
    grouped: dict[tuple[str, str], list[tuple[str, SignalEntry]]] = {}
    for entry in entries:
        for s in entry.signals:
            grouped.setdefault((s.name, s.source), []).append((entry.path, s))
    return [
        {
            "name": name,
            "source": source,
            "logs": len(found),
            "rate": rate_words([s.rate_hz for _, s in found]),
            "gaps": sum(s.gaps for _, s in found),
            "outliers": sum(s.outliers for _, s in found),
            "worst": worst_log(found),
        }
        for (name, source), found in grouped.items()
    ]


def rate_words(rates: list[float | None]) -> str:
    """One rate, or the range."""
    known = sorted(r for r in rates if r is not None)
    if not known or known[-1] < 1.02 * known[0]:
        return words.number(known[0]) if known else "–"
    return f"{words.number(known[0])} to {words.number(known[-1])}"


def worst_log(found: list[tuple[str, SignalEntry]]) -> str:
    """The log with most trouble in one signal, where there are several and one has any."""
    path, s = max(found, key=lambda f: f[1].gaps + f[1].outliers)
    return path if len(found) > 1 and s.gaps + s.outliers else ""


def noticed(logs: list[tuple[str, Log | None, list[Trial]]]) -> list[tuple[str, list[str]]]:
    """What was noticed, by log; what holds for every log, or in numbers alone differs between several, is said once."""
    by_log = {
        name: list(dict.fromkeys([*log_findings(log), *(f for t in trials for f in t.findings)]))
        for name, log, trials in logs
    }
    every = [
        f for f in next(iter(by_log.values()), []) if len(by_log) > 1 and all(f in v for v in by_log.values())
    ]
    together = [f for found in by_log.values() for f in found if f.startswith(OF_ALL)]
    left = {name: [f for f in found if f not in {*every, *together}] for name, found in by_log.items()}
    common = [
        k for k in kinds(left).values() if len(k) >= SEVERAL and not next(iter(k.values()))[:1].islower()
    ]
    several = [alike(k) for k in common]
    said = {(name, f) for k in common for name, f in k.items()}
    left = {name: [f for f in found if (name, f) not in said] for name, found in left.items()}
    out = [("All logs", [*every, *together]), ("Several logs", several), *left.items()]
    return [(name, found) for name, found in out if found]


def kinds(by_log: Mapping[str, Iterable[str]]) -> dict[str, dict[str, str]]:
    """Findings that differ in numbers alone: each log's first of a kind, by log."""
    out: dict[str, dict[str, str]] = {}
    for name, found in by_log.items():
        for sentence in found:
            out.setdefault(NUMBER.sub("#", sentence), {}).setdefault(name, sentence)
    return out


def alike(by_log: Mapping[str, str]) -> str:
    """Findings of one kind as one sentence."""
    (name, sentence), others = next(iter(by_log.items())), len(by_log) - 1
    return f"{name}: {and_others(sentence, others)}"


def and_others(sentence: str, others: int) -> str:
    """A finding, and in how many other logs there is one like it."""
    end = "" if sentence.endswith(("?", "!")) else "."
    return f"{sentence.rstrip('.')}{end} The like in {others} more." if others else sentence


def manoeuvres(trials: list[Trial]) -> str:
    """The manoeuvres of a log's trials."""
    return ", ".join(dict.fromkeys(t.manoeuvre for t in trials if t.manoeuvre))


def log_findings(log: Log | None) -> list[str]:
    """What the reader noticed, one line per kind of trouble, worst first."""
    lines: dict[tuple[str, str], list[int]] = {}
    for f in log.findings if log else ():
        lines.setdefault((f.message, f.topic or ""), []).append(f.count)
    out = []
    for (message, topic), counts in sorted(lines.items(), key=lambda kv: -sum(kv[1])):
        of = f" ({topic})" if topic else ""
        often = sum(counts) > 1 and str(sum(counts)) not in NUMBER.findall(message)
        out.append(f"{message}{of}" + (f", {sum(counts)} times" if often else ""))
    return out
