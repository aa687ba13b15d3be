"""report.html: one self-contained page for a person."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib import metadata
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from identify.fit import Estimated
from preprocess.trial import Trial
from validate.diagnosis import Candidate, Results, Round
from validate.report import words
from validate.report.contents import logs_with_trials, report_of, seatrial_version
from validate.report.figures import CHANNELS, SYMBOL, Figure, channel_figure, column, input_figure
from validate.report.labels import (
    advice_words,
    bars,
    finding_words,
    in_words,
    label_of,
    outcome_words,
    ranked,
    refitted,
    short_remark_of,
    taken_of,
    taken_words,
)
from validate.report.legend import legend
from validate.report.names import slug
from validate.report.parameters import (
    all_parameters,
    correlation_figure,
    interval_figure,
    labels,
    strong_pairs,
)
from validate.report.plan import plan_figure
from validate.report.reading import manoeuvres, noticed, signal_rows
from validate.report.scores import has_two, log_scores, scaled, score_rows, score_words
from validate.structure_left import seconds_ahead

LIBRARIES = ("numpy", "scipy", "pandas", "numba", "pyarrow", "rerun-sdk")
#: The share of a channel's standard deviation above which structure is material, unless told otherwise.
MATERIALITY = 0.10
#: A standard error of more than so many times the value is not given as a share of it.
UNKNOWN = 10.0
#: A prediction ran away where its error is so many times the standard deviation of what was measured.
RUN_AWAY = 10.0
#: Logs that are drawn; the others are in the recording.
PLOTTED = 24
#: Candidates of a round that are shown; the others are in report.json.
RANKED = 12


def report_page(results: Results) -> str:
    """The page as HTML.

    Parameters
    ----------
    results : Results
        What a run found out.

    Returns
    -------
    str
        One document without any reference outside itself except links beside it.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("validate.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    environment.filters |= {
        "number": words.number, "p": unbroken_probability, "in_powers": words.in_powers,
        "share": words.percent, "size": words.size, "duration": words.duration,
        "in_words": in_words, "finding": finding_words, "joined": words.joined, "svg": lambda f: Markup(f.svg),
    }  # fmt: skip
    return environment.get_template("page.html").render(**context(results))


def unbroken_probability(value: float | None) -> str:
    """A p-value that no line ends within."""
    return words.probability(value).replace(" ", "\u00a0")


def context(results: Results) -> dict[str, Any]:
    """Everything that the template shows."""
    return answer(results) | model(results) | evidence(results) | settings(results)


def answer(results: Results) -> dict[str, Any]:
    """Verdict, sentence, numbers before and after, effects, advice."""
    found, two = results.diagnosis, has_two(results)
    verdict = found.verdict if found else None
    return {
        "results": results,
        "vessel": results.after.vessel,
        "headline": words.headline(results),
        "verdict": verdict.name.lower() if verdict else "none",
        "verdict_words": verdict.value if verdict else "",
        "badge": words.BADGES[verdict],
        "two": two,
        "scores": score_rows(results.validation_before, results.validation_after),
        "effects": [(words.effect_words(e.fitted), e.p_value, [in_words(x) for x in e.look_alikes])
                    for e in (found.effects if found else ())],
        "unexplained": list(found.unexplained.items()) if found else [],
        "ahead": f"{seconds_ahead(results.after.vessel.length):.0f} s",
        "materiality": MATERIALITY,
        "statistical": words.STATISTICAL,
        "advice": advice_words(found.advice) if found else "",
    }  # fmt: skip


def model(results: Results) -> dict[str, Any]:
    """Equations, parameters, their intervals and correlations."""
    fit = results.after
    rows = [
        {
            "name": name,
            "dof": p.dof,
            "term": p.term,
            "value": words.plus_minus(p.value, p.stderr),
            "interval": words.interval(p.value, p.stderr),
            "unit": "–" if p.unit in ("", "1") else p.unit,
            "sure": p.identifiable and not p.at_bound,
            "bound": p.at_bound,
            "remark": remark(p),
        }
        for name, p in zip(labels(fit), all_parameters(fit), strict=True)
    ]
    return {
        "fit": fit,
        "equations": list(results.equations) or words.equations(fit),
        "legend": legend(fit),
        "parameters": rows,
        "intervals": interval_figure(fit),
        "correlations": correlation_figure(fit),
        "pairs": strong_pairs(fit)[:8],
    }


def remark(p: Estimated) -> str:
    """What is to be said of a parameter beside its value."""
    if not p.identifiable and p.stderr > UNKNOWN * abs(p.value):
        return "the standard error is many times the value"
    return p.reason or ("at its bound" if p.at_bound else "" if p.identifiable else "not identifiable")


def evidence(results: Results) -> dict[str, Any]:
    """What was read, the plots of every log, residual tests and candidates of every round."""
    logs = logs_with_trials(results)
    entries = report_of(results).logs
    rounds = results.diagnosis.rounds if results.diagnosis else ()
    drawn = [(name, trials) for name, _, trials in logs if name in results.predictions]
    drawn.sort(key=lambda d: all(t.role != "validate" for t in d[1]))
    plots = [log_plots(results, name, trials) for name, trials in drawn[:PLOTTED]]
    return {
        "logs": [(entry, manoeuvres(trials)) for entry, (_, _, trials) in zip(entries, logs, strict=True)],
        "signals": signal_rows(entries),
        "noticed": [*([("The logs together", results.remarks)] if results.remarks else []), *noticed(logs)],
        "plots": plots,
        "not_drawn": [name for name, _ in drawn[PLOTTED:]],
        "hero": [again(f, plots[0]["id"]) for f in plots[0]["figures"][:4]] if plots else [],
        "rounds": [round_rows(r, spreads(results)) for r in rounds],
        "apart": found_apart(results),
    }  # fmt: skip


def again(figure: Figure, key: str) -> Figure:
    """The same figure for a second place on the page: its ids must differ."""
    return Figure(
        figure.caption,
        figure.svg.replace(f'id="{key}-', f'id="top-{key}-').replace(f"#{key}-", f"#top-{key}-"),
    )


def log_plots(results: Results, name: str, trials: list[Trial]) -> dict[str, Any]:
    """All figures of one log."""
    table, two, key = results.predictions[name], has_two(results), slug(name)
    roles = list(dict.fromkeys(t.role for t in trials))
    scores = (log_scores(results.validation_before, name), log_scores(results.validation_after, name))
    figures: list[Figure | None] = [plan_figure(f"{key}-plan", name, table, trials, results.after, two)]
    carried = results.carried.get(name)
    words_of = {c: score_words(scores[0].get(c), scores[1].get(c), two) for c in ("u", "v", "r", "psi")}
    figures += [
        channel_figure(f"{key}-{c}", name, table, trials, c, two, words_of[c], carried) for c in words_of
    ]
    figures.append(input_figure(f"{key}-inputs", name, table, results.actuators.get(name), trials))
    return {"name": name, "id": key, "role": " and ".join(roles), "figures": [f for f in figures if f]}


def spreads(results: Results) -> dict[str, float]:
    """Standard deviation of every channel over all logs, SI."""
    tables = results.predictions.values()
    found = {c: [v for t in tables if (v := column(t, c)) is not None] for c, _, _, _ in CHANNELS}
    return {c: float(np.nanstd(np.concatenate(v))) for c, v in found.items() if v}


def round_rows(r: Round, spread: Mapping[str, float]) -> dict[str, Any]:
    """One round: tests by name with p-values per channel, candidates best first with their bars."""
    names = list(dict.fromkeys(t.name for t in r.residual_tests))
    channels = list(dict.fromkeys(t.channel for t in r.residual_tests))
    value = {(t.name, t.channel): t.p_value for t in r.residual_tests}
    order = ranked(r)
    taken = taken_of(r)
    return {
        "channels": [SYMBOL.get(c, c) for c in channels],
        "tests": [(n, [value.get((n, c)) for c in channels]) for n in names],
        "candidates": [
            candidate_row(c, share, c is taken, spread)
            for c, share in list(zip(order, bars(order), strict=True))[:RANKED]
        ],
        "more": len(order) - RANKED,
        "outcome": outcome_words(r),
        "taken": taken_words(r),
    }


def found_apart(results: Results) -> list[str]:
    """Effects that no round took: those with a test of their own (waves, wiring)."""
    found = results.diagnosis
    if found is None:
        return []
    accepted = {r.accepted for r in found.rounds}
    return [in_words(e.fitted.name) for e in found.effects if e.fitted.name not in accepted]


def tamed(value: float | None, scale: float, spread: float) -> str:
    """An error in the unit for reading; in words where the prediction ran away."""
    if value is not None and (np.isinf(value) or value > RUN_AWAY * spread):
        return "runs away"
    return scaled(value, scale)


def candidate_row(c: Candidate, share: float, taken: bool, spread: Mapping[str, float]) -> dict[str, Any]:
    """One candidate as it is shown; ``spread`` is the standard deviation of each channel."""
    scale = {name: factor for name, _, _, factor in CHANNELS}
    change = [
        (
            k,
            *(
                tamed(x, scale.get(k, 1.0), spread.get(k, np.inf))
                for x in (c.rmse_before[k], c.rmse_after.get(k))
            ),
        )
        for k in c.rmse_before
        if refitted(c) and c.rmse_before[k] != c.rmse_after.get(k)
    ]
    return {
        "name": in_words(label_of(c)),
        "evidence": c.evidence,
        "bar": round(100 * share, 1),
        "p_value": c.p_value,
        "change": change,
        "note": short_remark_of(c),
        "taken": taken,
    }


def settings(results: Results) -> dict[str, Any]:
    """What would repeat the run, and what it rests on."""
    fit = results.after
    versions = {"Seatrial": seatrial_version(), "Python": platform.python_version()}
    versions |= {name: metadata.version(name) for name in LIBRARIES}
    return {
        "settings": {
            "campaign": results.campaign, "model": fit.model, "estimator": fit.estimator,
            "optimiser": fit.optimiser, "seed": str(fit.seed), "digest of the trials": fit.digest,
            "why the search stopped": fit.stopped, "χ² per degree of freedom": words.number(fit.chi2_per_dof),
        },
        "versions": versions,
        "timing": {k: f"{v:.1f} s" for k, v in results.timing_s.items()},
        "papers": results.papers,
    }  # fmt: skip
