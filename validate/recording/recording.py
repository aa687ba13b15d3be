"""Write the Rerun recording of a run."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import rerun as rr

from preprocess.signals import STATES
from preprocess.trial import Trial
from validate.diagnosis import Results
from validate.recording import entities
from validate.recording.glyphs import drawable
from validate.recording.layout import LogView, blueprint, bounds
from validate.recording.ranges import ranges_of
from validate.recording.series import PREDICTED, send_inputs, send_predictions, send_signals
from validate.recording.story import send_documents, send_events
from validate.recording.stream import Clock, most_rows
from validate.recording.tracks import send_tracks
from validate.report.contents import logs_with_trials
from validate.report.figures import column
from validate.report.names import file_names
from validate.report.scores import has_two
from validate.report.svg import finite_range
from validate.report.words import headline


def write_recording(results: Results, path: Path) -> None:
    """Write everything that a run found out along the time line, with its blueprint.

    Parameters
    ----------
    results : Results
        What a run found out.
    path : Path
        The ``.rrd`` to write; replaced where it is there.
    """
    rec = rr.RecordingStream(entities.APPLICATION, recording_id=recording_id(results), send_properties=False)
    rec.save(path)
    names = file_names([*results.predictions, *(t.name for t in results.trials)])
    trials = {name: found for name, _, found in logs_with_trials(results)}
    two = has_two(results)
    views = []
    for name, table in results.predictions.items():
        send_log(rec, names[name], table, results, name, trials.get(name, []), two)
        shown = ranges_of(table, results.actuators.get(name), trials.get(name, []))
        views.append(view_of(names[name], table, trials.get(name, []), results.after.vessel.length, shown))
    send_documents(rec, results)
    rec.send_recording_name(drawable(f"{results.after.vessel.name}, {results.after.model}"))
    rec.send_blueprint(blueprint(views, len(results.diagnosis.rounds) if results.diagnosis else 0))
    rec.flush()
    rec.disconnect()


def recording_id(results: Results) -> str:
    """The same for two runs on the same trials with the same settings and seed."""
    fit = results.after
    facts = (
        fit.digest,
        results.campaign,
        fit.model,
        fit.estimator,
        fit.optimiser,
        fit.seed,
        len(fit.effects),
    )
    return hashlib.sha256(repr(facts).encode()).hexdigest()[:32]


def send_log(
    rec: rr.RecordingStream,
    name: str,
    table: pd.DataFrame,
    results: Results,
    key: str,
    trials: list[Trial],
    two: bool,
) -> None:
    """Everything of one log; ``name`` is its unique file name, ``key`` its name in the campaign."""
    utc_ns = next((t.utc_ns for t in trials if t.utc_ns is not None), None)
    clock = Clock(utc_ns, most_rows(len(results.predictions)))
    parts = ("before", "after") if two else ("after",)
    send_tracks(rec, name, table, trials, results.after, clock, ("smoothed", *parts))
    send_signals(rec, name, table, trials, clock)
    send_predictions(rec, name, table, trials, clock, parts)
    send_inputs(rec, name, table, results.actuators.get(key), trials, clock)
    send_events(rec, name, trials, clock, headline(results))


def view_of(
    name: str,
    table: pd.DataFrame,
    trials: list[Trial],
    length: float,
    ranges: Mapping[str, tuple[float, float]],
) -> LogView:
    """What the blueprint must know of one log."""
    extents = {
        "north": finite_range([table["x"].to_numpy(np.float64)]),
        "east": finite_range([table["y"].to_numpy(np.float64)]),
    }
    declared = trials[0].inputs_declared if trials else ()
    predicted = tuple(c for c in PREDICTED if column(table, f"{c}_after") is not None)
    return LogView(
        name=name,
        span=finite_range([table["t"].to_numpy(np.float64)]),
        bounds=bounds(extents, length),
        has_map=any(t.origin for t in trials),
        channels=predicted,
        signals=tuple(s for s in STATES if column(table, s) is not None),
        inputs=tuple(i.name for i in declared if column(table, i.name) is not None),
        validates=any(t.role == "validate" for t in trials),
        ranges=ranges,
    )
