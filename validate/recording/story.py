"""The words in the recording: verdict, report, manoeuvres; and the candidates as bars."""

from __future__ import annotations

import numpy as np
import rerun as rr

from preprocess.trial import Trial
from validate.diagnosis import Results, Round
from validate.recording import entities
from validate.recording.glyphs import drawable
from validate.recording.stream import Clock
from validate.report.labels import ranked
from validate.report.markdown import diagnosis_markdown, report_markdown, round_markdown
from validate.report.names import slug
from validate.report.words import headline

#: A bar below zero is drawn at least so far down.
LEAST_FLOOR = 20.0


def send_documents(rec: rr.RecordingStream, results: Results) -> None:
    """Verdict in one sentence, the report, and each round of the search."""
    document(rec, entities.VERDICT, headline(results))
    document(rec, entities.REPORT, report_markdown(results))
    document(rec, f"{entities.DIAGNOSIS}/summary", diagnosis_markdown(results))
    rounds = results.diagnosis.rounds if results.diagnosis else ()
    for k, r in enumerate(rounds, start=1):
        document(rec, f"{entities.DIAGNOSIS}/round_{k}/table", round_markdown(k, r))
        send_candidates(rec, f"{entities.DIAGNOSIS}/round_{k}/candidates", r)


def document(rec: rr.RecordingStream, path: str, words: str) -> None:
    """A Markdown document that holds at all times."""
    rec.log(path, rr.TextDocument(drawable(words), media_type=rr.MediaType.MARKDOWN), static=True)


def send_candidates(rec: rr.RecordingStream, path: str, r: Round) -> None:
    """Evidence of each candidate as a bar, in the order of the table beside it; what lies far below zero is cut."""
    evidence = np.nan_to_num([c.evidence for c in ranked(r)], posinf=0.0, neginf=0.0)
    if len(evidence):
        evidence = np.maximum(evidence, -max(LEAST_FLOOR, 0.2 * evidence.max()))
        ranks = np.arange(1, len(evidence) + 1) - 0.4
        rec.log(
            path,
            rr.BarChart(
                evidence, color=entities.COLOURS["after"], abscissa=ranks, widths=np.full(len(ranks), 0.8)
            ),
            static=True,
        )


def send_events(rec: rr.RecordingStream, name: str, trials: list[Trial], clock: Clock, verdict: str) -> None:
    """Manoeuvre, unbroken stretches and verdict as text along the time line."""
    lines: list[tuple[float, str]] = []
    for trial in trials:
        start = trial.segments[0][0] if trial.segments else 0.0
        role = "held back for validation" if trial.role == "validate" else "used to identify"
        lines.append((start, f"{name}: {trial.manoeuvre or 'manoeuvre not declared'}, {role}"))
        lines += [(a, f"{name}: unbroken stretch of {b - a:.1f} s begins") for a, b in trial.segments[1:]]
    end = max((trial.segments[-1][1] for trial in trials if trial.segments), default=0.0)
    lines = sorted([*lines, (end, f"{name}: {verdict}")])
    columns = rr.TextLog.columns(text=[drawable(w) for _, w in lines], level=["INFO"] * len(lines))
    times = clock.columns(np.array([t for t, _ in lines], dtype=np.float64))
    rec.send_columns(f"{entities.EVENTS}/{slug(name)}", indexes=times, columns=columns)
