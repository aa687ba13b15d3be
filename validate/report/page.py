"""report.html: one self-contained page for a person."""

from __future__ import annotations

import platform
from importlib import metadata
from typing import Any

import jinja2
from markupsafe import Markup

from ingest.log import Log
from preprocess.trial import Trial
from validate.diagnosis import Candidate, ChannelScore, Results, Round, Validation
from validate.report import words
from validate.report.contents import logs_with_trials, report_of, seatrial_version
from validate.report.figures import CHANNELS, DEG, Figure, channel_figure, input_figure
from validate.report.names import slug
from validate.report.parameters import (
    all_parameters,
    correlation_figure,
    interval_figure,
    labels,
    strong_pairs,
)
from validate.report.plan import plan_figure
from validate.report.schema import LogEntry, SignalEntry

LIBRARIES = ("numpy", "scipy", "pandas", "numba", "pyarrow", "rerun-sdk")
#: The share of a channel's standard deviation above which structure is material, unless the run was told otherwise.
MATERIALITY = 0.10


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
        "number": words.number, "p": words.probability, "size": words.size, "duration": words.duration,
        "plain": words.plain_name, "joined": words.joined, "svg": lambda f: Markup(f.svg),
    }  # fmt: skip
    return environment.get_template("page.html").render(**context(results))


def context(results: Results) -> dict[str, Any]:
    """Everything that the template shows."""
    return answer(results) | model(results) | evidence(results) | settings(results)


def has_two(results: Results) -> bool:
    """Whether effects were taken, so that there is a before and an after."""
    return bool(results.after.effects) or results.after is not results.before


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
        "effects": [(words.effect_words(e.fitted), e.p_value, [words.plain_name(x) for x in e.look_alikes])
                    for e in (found.effects if found else ())],
        "unexplained": list(found.unexplained.items()) if found else [],
        "materiality": MATERIALITY,
        "advice": found.advice if found else "",
    }  # fmt: skip


def score_rows(before: Validation, after: Validation) -> list[tuple[str, str, str, str, str]]:
    """Channel, RMSE before and after, R² before and after; position and heading have no R²."""
    rows = []
    for channel, meaning, unit, scale in CHANNELS[:3]:
        b, a = before.channels.get(channel), after.channels.get(channel)
        if b is None or a is None or (b.rmse is None and a.rmse is None):
            continue
        rows.append((f"{channel}, {meaning} ({unit})", scaled(b.rmse, scale), scaled(a.rmse, scale),
                     words.share(b.r2), words.share(a.r2)))  # fmt: skip
    for name, b_value, a_value, scale in (
        ("position (m)", before.position_rmse, after.position_rmse, 1.0),
        ("heading (°)", before.heading_rmse, after.heading_rmse, DEG),
    ):
        if b_value is not None or a_value is not None:
            rows.append((name, scaled(b_value, scale), scaled(a_value, scale), "", ""))
    return rows


def scaled(value: float | None, scale: float) -> str:
    """A number in the unit for reading."""
    return words.number(None if value is None else value * scale)


def model(results: Results) -> dict[str, Any]:
    """Equations, parameters, their intervals and correlations."""
    fit = results.after
    rows = [
        {
            "name": name, "dof": p.dof, "term": p.term, "value": words.plus_minus(p.value, p.stderr),
            "interval": words.interval(p.value, p.stderr), "unit": "–" if p.unit in ("", "1") else p.unit,
            "sure": p.identifiable and not p.at_bound, "bound": p.at_bound,
            "remark": p.reason or ("at its bound" if p.at_bound else "" if p.identifiable else "not identifiable"),
        }
        for name, p in zip(labels(fit), all_parameters(fit), strict=True)
    ]  # fmt: skip
    return {
        "fit": fit,
        "equations": list(results.equations) or words.equations(fit),
        "parameters": rows,
        "intervals": interval_figure(fit),
        "correlations": correlation_figure(fit),
        "pairs": strong_pairs(fit)[:8],
    }


def evidence(results: Results) -> dict[str, Any]:
    """What was read, the plots of every log, residual tests and candidates of every round."""
    logs = logs_with_trials(results)
    entries = report_of(results).logs
    rounds = results.diagnosis.rounds if results.diagnosis else ()
    plots = [log_plots(results, name, trials) for name, _, trials in logs if name in results.predictions]
    plots.sort(key=lambda p: "validate" not in p["role"])
    return {
        "logs": [(entry, manoeuvres(trials)) for entry, (_, _, trials) in zip(entries, logs, strict=True)],
        "signals": signal_rows(entries),
        "noticed": noticed(logs),
        "plots": plots,
        "hero": [again(f, plots[0]["id"]) for f in plots[0]["figures"][:3]] if plots else [],
        "rounds": [round_rows(r) for r in rounds],
    }  # fmt: skip


def signal_rows(entries: list[LogEntry]) -> list[dict[str, Any]]:
    """Signals by name and source: in how many logs, at which rates, with how many gaps and samples set aside."""
    grouped: dict[tuple[str, str], list[tuple[str, SignalEntry]]] = {}
    for entry in entries:
        for s in entry.signals:
            grouped.setdefault((s.name, s.source), []).append((entry.path, s))
    return [
        {
            "name": name, "source": source, "logs": len(found), "rate": rate_words([s.rate_hz for _, s in found]),
            "gaps": sum(s.gaps for _, s in found), "outliers": sum(s.outliers for _, s in found),
            "worst": worst_log(found),
        }
        for (name, source), found in grouped.items()
    ]  # fmt: skip


def rate_words(rates: list[float | None]) -> str:
    """One rate, or the range."""
    known = list(dict.fromkeys(words.number(r) for r in sorted(r for r in rates if r is not None)))
    return "–" if not known else known[0] if len(known) == 1 else f"{known[0]} to {known[-1]}"


def worst_log(found: list[tuple[str, SignalEntry]]) -> str:
    """The log with most trouble in one signal, where there are several and one has any."""
    path, s = max(found, key=lambda f: f[1].gaps + f[1].outliers)
    return path if len(found) > 1 and s.gaps + s.outliers else ""


def noticed(logs: list[tuple[str, Log | None, list[Trial]]]) -> list[tuple[str, list[str]]]:
    """What was noticed, by log; what holds for every log is said once."""
    by_log = {
        name: list(dict.fromkeys([*log_findings(log), *(f for t in trials for f in t.findings)]))
        for name, log, trials in logs
    }
    every = [
        f for f in next(iter(by_log.values()), []) if len(by_log) > 1 and all(f in v for v in by_log.values())
    ]
    out = [("All logs", every)] + [
        (name, [f for f in found if f not in every]) for name, found in by_log.items()
    ]
    return [(name, found) for name, found in out if found]


def again(figure: Figure, key: str) -> Figure:
    """The same figure for a second place on the page: its ids must differ."""
    return Figure(
        figure.caption,
        figure.svg.replace(f'id="{key}-', f'id="top-{key}-').replace(f"#{key}-", f"#top-{key}-"),
    )


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
        out.append(f"{message}{of}" + (f", {sum(counts)} times" if sum(counts) > 1 else ""))
    return out


def log_plots(results: Results, name: str, trials: list[Trial]) -> dict[str, Any]:
    """All figures of one log."""
    table, two, key = results.predictions[name], has_two(results), slug(name)
    roles = list(dict.fromkeys(t.role for t in trials))
    scores = (log_scores(results.validation_before, name), log_scores(results.validation_after, name))
    figures: list[Figure | None] = [plan_figure(f"{key}-plan", name, table, trials, results.after, two)]
    figures += [
        channel_figure(
            f"{key}-{c}", name, table, trials, c, two, score_words(scores[0].get(c), scores[1].get(c), two)
        )
        for c in ("u", "v", "r", "psi")
    ]
    figures.append(input_figure(f"{key}-inputs", name, table, results.actuators.get(name), trials))
    return {"name": name, "id": key, "role": " and ".join(roles), "figures": [f for f in figures if f]}


def log_scores(validation: Validation, name: str) -> dict[str, ChannelScore]:
    """Scores of a log: of its unseen part where it has one."""
    found = sorted((s for s in validation.logs if s.path == name), key=lambda s: s.role != "validate")
    return dict(found[0].channels) if found else {}


def score_words(before: ChannelScore | None, after: ChannelScore | None, two: bool) -> str:
    """``R² −0.68 → 0.999``."""
    last = words.share(after.r2 if after else None)
    if last == "–":
        return ""
    return f"R² {words.share(before.r2 if before else None)} → {last}" if two else f"R² {last}"


def round_rows(r: Round) -> dict[str, Any]:
    """One round: tests by name with a p-value per channel, candidates best first with the width of their bar."""
    names = list(dict.fromkeys(t.name for t in r.residual_tests))
    channels = list(dict.fromkeys(t.channel for t in r.residual_tests))
    value = {(t.name, t.channel): t.p_value for t in r.residual_tests}
    ranked = sorted(r.candidates, key=lambda c: -c.evidence)
    most = max((c.evidence for c in ranked), default=0.0)
    return {
        "channels": channels,
        "tests": [(n, [value.get((n, c)) for c in channels]) for n in names],
        "candidates": [candidate_row(c, most, r.accepted) for c in ranked],
        "accepted": r.accepted,
    }


def candidate_row(c: Candidate, most: float, accepted: str | None) -> dict[str, Any]:
    """One candidate as it is shown."""
    scale = {name: factor for name, _, _, factor in CHANNELS}
    change = [
        (k, scaled(c.rmse_before[k], scale.get(k, 1.0)), scaled(c.rmse_after.get(k), scale.get(k, 1.0)))
        for k in c.rmse_before
    ]
    return {
        "name": words.plain_name(c.effect) + (f" of {c.input}" if c.input else ""),
        "evidence": c.evidence,
        "bar": round(100 * c.evidence / most, 1) if most > 0 and c.evidence > 0 else 0,
        "p_value": c.p_value,
        "change": change,
        "note": c.note,
        "taken": accepted == c.effect,
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
