"""The report as Markdown, for the recording; without times of computation, so that equal runs are equal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from validate.diagnosis import Results, Round
from validate.report import words
from validate.report.labels import (
    advice_words,
    in_words,
    label_of,
    outcome_words,
    ranked,
    short_remark_of,
    taken_of,
    taken_words,
)
from validate.report.parameters import all_parameters, labels
from validate.report.scores import has_two, score_rows


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(c.replace("|", "\\|") for c in line) + " |" for line in lines) + "\n"


def report_markdown(results: Results) -> str:
    """Verdict, errors, equations, parameters, advice."""
    fit, two = results.after, has_two(results)
    rows = score_rows(results.validation_before, results.validation_after)
    head = ["RMS error of", "declared model", "with effects"] if two else ["RMS error of", "model"]
    errors = [[r[0], r[1], r[2]] if two else [r[0], r[2]] for r in rows]
    verdict = words.BADGES[results.diagnosis.verdict if results.diagnosis else None]
    advice = advice_words(results.diagnosis.advice) if results.diagnosis else ""
    parts = [
        f"# {fit.vessel.name}: {verdict.lower()}",
        words.headline(results),
        f"**What to do next.** {advice}" if advice else "",
        "## On logs held back\n\n" + table(head, errors),
        "## Model\n\n"
        + "\n".join(f"`{words.in_powers(e)}`\n" for e in results.equations or words.equations(fit)),
        table(["parameter", "value", "unit"], parameter_rows(results)) + f"\n± {words.STATISTICAL}",
        "## Logs\n\n"
        + table(["log", "role", "manoeuvre"], [[t.name, t.role, t.manoeuvre or "–"] for t in results.trials]),
    ]
    return "\n\n".join(p for p in parts if p)


def parameter_rows(results: Results) -> list[list[str]]:
    """Name, value with error, unit."""
    fit = results.after
    return [
        [
            name,
            words.plus_minus(p.value, p.stderr) + ("" if p.identifiable else " (not identifiable)"),
            p.unit,
        ]
        for name, p in zip(labels(fit), all_parameters(fit), strict=True)
    ]


def diagnosis_markdown(results: Results) -> str:
    """What is missing, what looks like it, what stays unexplained."""
    found = results.diagnosis
    if found is None:
        return "The search for missing effects was switched off for this run."
    effects = [
        f"* **{words.effect_words(e.fitted)}**, p {words.probability(e.p_value)}"
        + (f"; looks like {words.joined(map(in_words, e.look_alikes), 'or')}" if e.look_alikes else "")
        for e in found.effects
    ]
    rest = table(
        ["channel", "unexplained share"], [[k, words.percent(v)] for k, v in found.unexplained.items()]
    )
    title = f"# {words.BADGES[found.verdict]}\n\n{found.verdict.value}"
    advice = f"**What to do next.** {advice_words(found.advice)}" if found.advice else ""
    return "\n\n".join(p for p in (title, "\n".join(effects), advice, rest) if p)


def round_markdown(number: int, r: Round) -> str:
    """Candidates by rank, and the residual tests."""
    taken = taken_of(r)
    rows = [
        [str(k), in_words(label_of(c)), words.number(c.evidence),
         words.probability(c.p_value), taken_words(r) if c is taken else short_remark_of(c)]
        for k, c in enumerate(ranked(r), start=1)
    ]  # fmt: skip
    tests = [[in_words(t.name), t.channel, words.probability(t.p_value)] for t in r.residual_tests]
    outcome = outcome_words(r)
    candidates = (
        table(["rank", "candidate", "evidence", "p", ""], rows) if rows else "No candidate was tried."
    )
    whiteness = "## Residual tests\n\n" + table(["test", "channel", "p"], tests) if tests else ""
    return f"## Round {number}: {outcome}\n\n{candidates}\n\n{whiteness}"
