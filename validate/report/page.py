"""report.html: one self-contained page for a person."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib import metadata
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from identify.fit import Estimated, Fit
from preprocess.trial import Trial
from validate.diagnosis import Results
from validate.report import words
from validate.report.contents import logs_with_trials, report_of, seatrial_version
from validate.report.effect_terms import beside, equations_and_terms
from validate.report.figures import SYMBOL, Figure, channel_figure, input_figure
from validate.report.labels import advice_words, finding_words, in_words
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
from validate.report.round_rows import found_apart, round_rows, spreads
from validate.report.sailed import particulars, prime, ranges
from validate.report.scores import has_two, log_scores, score_rows, score_words
from validate.structure_left import seconds_ahead

LIBRARIES = ("numpy", "scipy", "pandas", "numba", "pyarrow", "rerun-sdk")
#: The bars of what stays unexplained reach so many times what is material, or the largest of them.
WITHIN_REACH = 3.0
#: A standard error of more than so many times the value is not given as a share of it.
UNKNOWN = 10.0
#: Logs that are drawn; the others are in the recording.
PLOTTED = 24
#: Figures of the first log that stand at the top: its track and the first channels.
TOP = 4


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
        "unexplained": unexplained_rows(found.unexplained, found.materiality) if found else [],
        "material_at": 100 * found.materiality / reach(found.unexplained, found.materiality) if found else 0.0,
        "ahead": f"{seconds_ahead(results.after.vessel.length):.0f} s",
        "materiality": found.materiality if found else 0.0,
        "statistical": words.STATISTICAL,
        "advice": advice_words(found.advice) if found else "",
    }  # fmt: skip


def reach(unexplained: Mapping[str, float], materiality: float) -> float:
    """The share that a whole bar stands for: the mark of what is material is seen, and what is far above it."""
    return min(
        1.0,
        max([WITHIN_REACH * max(materiality, 1e-3), *(x for x in unexplained.values() if np.isfinite(x))]),
    )


def unexplained_rows(
    unexplained: Mapping[str, float], materiality: float
) -> list[tuple[str, float, float, bool]]:
    """Channel, share that stays unexplained, length of its bar in %, and whether it is material."""
    whole = reach(unexplained, materiality)
    return [
        (SYMBOL.get(c, c), x, round(100 * min(1.0, max(0.0, np.nan_to_num(x)) / whole), 1), x > materiality)
        for c, x in unexplained.items()
    ]


def model(results: Results) -> dict[str, Any]:
    """Equations, parameters, their intervals and correlations."""
    fit = results.after
    without_dimension, speed = prime(fit, results.trials)
    return {
        "fit": fit,
        "particulars": particulars(fit.vessel, results.trials),
        "ranges": ranges(results.trials),
        "prime_speed": speed if without_dimension else 0.0,
        "with_effects": words.joined(dict.fromkeys(words.name_of(e) for e in fit.effects)),
        "beside": list(beside(fit)),
        "equations": list(results.equations) or words.equations(fit),
        "legend": legend(fit),
        "parameters": parameter_rows(fit, without_dimension),
        "intervals": interval_figure(fit),
        "correlations": correlation_figure(fit),
        "pairs": strong_pairs(fit)[:8],
    }


def parameter_rows(fit: Fit, without_dimension: Mapping[int, str]) -> list[dict[str, Any]]:
    """Every parameter as it is shown, with its prime value where there is one (by its place)."""
    named = zip(labels(fit), all_parameters(fit), equations_and_terms(fit), strict=True)
    return [
        {
            "name": name,
            "dof": words.RATES.get(dof, dof),
            "term": term,
            "value": words.plus_minus(p.value, p.stderr),
            "interval": words.interval(p.value, p.stderr),
            "unit": "–" if p.unit in ("", "1") else p.unit,
            "sure": p.identifiable and not p.at_bound,
            "bound": p.at_bound,
            "remark": remark(p),
            "prime": without_dimension.get(k, ""),
        }
        for k, (name, p, (dof, term)) in enumerate(named)
    ]


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
        "plots": [{**p, "above": k == 0, "figures": p["figures"][TOP * (k == 0) :]} for k, p in enumerate(plots)],
        "not_drawn": [name for name, _ in drawn[PLOTTED:]],
        "hero": plots[0]["figures"][:TOP] if plots else [],
        "rounds": [round_rows(r, spreads(results)) for r in rounds],
        "apart": found_apart(results.diagnosis),
    }  # fmt: skip


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
