"""report.json from the results of a run."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from importlib import metadata
from pathlib import PurePath

import numpy as np

from identify.fit import Estimated
from ingest.log import Log
from preprocess.trial import Measurement, Trial
from validate.diagnosis import (
    Candidate,
    ChannelScore,
    Diagnosis,
    Results,
    Round,
    TakenEffect,
    Validation,
)
from validate.report import schema
from validate.report.labels import label_of, ranked, remark_of
from validate.report.schema import plain
from validate.report.words import joined

#: An interval counts as a gap above this many sample times.
GAP_FACTOR = 3.5


def seatrial_version() -> str:
    """Version of the installed program; ``0`` where it runs from a bare checkout."""
    try:
        return metadata.version("seatrial")
    except metadata.PackageNotFoundError:
        return "0"


def report_of(results: Results) -> schema.Report:
    """Everything of report.json, in the contract's shape.

    Parameters
    ----------
    results : Results
        What a run found out.

    Returns
    -------
    Report
        Frozen; ``validate.report.schema.to_json`` writes it.
    """
    fit = results.after
    return schema.Report(
        schema=schema.REPORT,
        seatrial_version=seatrial_version(),
        campaign=results.campaign,
        vessel=fit.vessel.name,
        model=fit.model,
        estimator=fit.estimator,
        optimiser=fit.optimiser,
        seed=fit.seed,
        logs=[log_entry(log, name, trials) for name, log, trials in logs_with_trials(results)],
        parameters=[parameter_entry(p) for p in fit.coefficients],
        validation=schema.ValidationPair(
            before=validation_entry(results.validation_before),
            after=validation_entry(results.validation_after),
        ),
        diagnosis=None if results.diagnosis is None else diagnosis_entry(results.diagnosis),
        timing_s=dict(results.timing_s),
    )


def logs_with_trials(results: Results) -> list[tuple[str, Log | None, list[Trial]]]:
    """Each log's name in the campaign, the log as read, and the trials made of it, in campaign order."""
    named: dict[str, list[Trial]] = {}
    for trial in results.trials:
        named.setdefault(trial.name, []).append(trial)
    folder, at = PurePath(results.campaign).parent, {PurePath(log.path): log for log in results.logs}
    found = {name: at.get(folder / name) or _log_of(name, results.logs) for name in named}
    used = {id(log) for log in found.values()}
    rest = [(log.path.name, log, list[Trial]()) for log in results.logs if id(log) not in used]
    return [(name, found[name], trials) for name, trials in named.items()] + rest


def _log_of(name: str, logs: tuple[Log, ...]) -> Log | None:
    """The log whose path ends as the campaign writes it; failing that, the one with its file name."""
    wanted = [p for p in PurePath(name).parts if p not in (".", "..")]
    for parts in (wanted, wanted[-1:]):
        for log in logs:
            if list(log.path.parts[-len(parts) :]) == parts:
                return log
    return None


def log_entry(log: Log | None, name: str, trials: list[Trial]) -> schema.LogEntry:
    """One log; its signals are those that the trials use."""
    roles = {t.role for t in trials}
    span = max((float(t.states["t"].max()) for t in trials if len(t.states)), default=0.0)
    role = "both" if len(roles) > 1 else next(iter(roles), "identify")
    return schema.LogEntry.model_validate(
        {
            "path": name,
            "role": role,
            "format": log.format if log else "",
            "duration_s": (log.duration_s if log else 0.0) or span,
            "messages": log.messages if log else 0,
            "bytes_read": log.bytes_read if log else 0,
            "bytes_damaged": log.bytes_damaged if log else 0,
            "signals": signal_entries(trials),
        }
    )


def signal_entries(trials: list[Trial]) -> list[schema.SignalEntry]:
    """Sensors first, then inputs; the parts of a divided log are added up."""
    parts: dict[str, list[tuple[Measurement, bool]]] = {}
    for trial in trials:
        for m, is_input in [(m, False) for m in trial.measurements.values()] + [
            (m, True) for m in trial.inputs.values()
        ]:
            parts.setdefault(m.name, []).append((m, is_input))
    return [_signal_entry(name, pieces) for name, pieces in parts.items()]


def _signal_entry(name: str, pieces: list[tuple[Measurement, bool]]) -> schema.SignalEntry:
    times = [m.sample_time or median_step(m.t) for m, _ in pieces]
    step = float(np.nanmedian(times)) if np.isfinite(times).any() else np.nan
    return schema.SignalEntry(
        name=name,
        source=re.sub(r"(^|\s)\.", r"\1", pieces[0][0].source),
        rate_hz=1.0 / step if step > 0 else None,
        gaps=sum(gaps(m) for m, is_input in pieces if not (is_input and m.held)),
        outliers=sum(int((~m.good).sum()) for m, _ in pieces),
    )


def median_step(t: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Median interval between samples, s; NaN for fewer than two."""
    return float(np.median(np.diff(t))) if len(t) > 1 else float("nan")


def gaps(measurement: Measurement) -> int:
    """Intervals longer than ``GAP_FACTOR`` sample times."""
    step = measurement.sample_time or median_step(measurement.t)
    return int((np.diff(measurement.t) > GAP_FACTOR * step).sum()) if step > 0 else 0


def parameter_entry(p: Estimated) -> schema.ParameterEntry:
    """One coefficient."""
    return schema.ParameterEntry(
        dof=p.dof, name=p.name, value=p.value, stderr=p.stderr, unit=p.unit, identifiable=p.identifiable
    )


def channels_entry(channels: Mapping[str, ChannelScore]) -> dict[str, schema.ScoreEntry]:
    """Scores by channel."""
    return {k: schema.ScoreEntry(mse=c.mse, rmse=c.rmse, r2=c.r2, nrmse=c.nrmse) for k, c in channels.items()}


def validation_entry(v: Validation) -> schema.ValidationEntry:
    """Scores of one model."""
    logs = [{"path": s.path, "role": s.role, "channels": channels_entry(s.channels)} for s in v.logs]
    return schema.ValidationEntry(
        channels=channels_entry(v.channels),
        fitness=v.fitness,
        position_rmse=v.position_rmse,
        heading_rmse=v.heading_rmse,
        logs=[schema.LogScoreEntry.model_validate(s) for s in logs],
    )


def effect_entry(e: TakenEffect) -> schema.EffectEntry:
    """One effect that was taken, its options beside its name."""
    return schema.EffectEntry.model_validate(
        plain(e.fitted.options)
        | {
            "name": e.fitted.name,
            "input": e.fitted.input,
            "p_value": e.p_value,
            "look_alikes": list(e.look_alikes),
            "parameters": [
                schema.EffectParameterEntry(name=p.name, value=p.value, stderr=p.stderr, unit=p.unit)
                for p in e.fitted.parameters
            ],
        }
    )


def candidate_entry(c: Candidate) -> schema.CandidateEntry:
    """One candidate."""
    return schema.CandidateEntry(
        effect=c.effect,
        input=c.input,
        evidence=c.evidence,
        p_value=c.p_value,
        rmse_before=dict(c.rmse_before),
        rmse_after=dict(c.rmse_after),
        label=label_of(c),
        note=remark_of(c) or ran_away(c),
        promise=c.promise,
    )


def ran_away(c: Candidate) -> str:
    """That the cross-validated errors of a refit are not known because predictions ran away; empty where they are."""
    sides = (("without it", c.rmse_before), ("with it", c.rmse_after))
    lost = [side for side, rmse in sides if any(math.isinf(x) for x in rmse.values())]
    return f"cross-validated, predictions ran away {joined(lost)}" if lost else ""


def round_entry(r: Round) -> schema.RoundEntry:
    """One turn of the loop; candidates best first, those that were refitted before the others."""
    tests = [
        schema.ResidualTestEntry(name=t.name, channel=t.channel, statistic=t.statistic, p_value=t.p_value)
        for t in r.residual_tests
    ]
    return schema.RoundEntry(
        residual_tests=tests,
        candidates=[candidate_entry(c) for c in ranked(r)],
        accepted=r.accepted,
        stands=r.stands if r.accepted else None,
        note=r.remark,
    )


def diagnosis_entry(d: Diagnosis) -> schema.DiagnosisEntry:
    """What the model lacks."""
    return schema.DiagnosisEntry.model_validate(
        {
            "verdict": d.verdict.name.lower(),
            "effects": [effect_entry(e) for e in d.effects],
            "rounds": [round_entry(r) for r in d.rounds],
            "unexplained": dict(d.unexplained),
            "advice": d.advice,
        }
    )
