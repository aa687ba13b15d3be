"""Errors of a receiver's velocity that wander, told by its positions: over all logs, whatever model there is.

A receiver filters the velocity that it gives: its errors last for some tenths of a second to some seconds. The position
less the integral of the velocity has no motion in it; how the position's own errors wander is told beside it anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from preprocess.integrated import Run, in_long_blocks, runs_of, sensed
from preprocess.less_sure import with_wanders
from preprocess.told_wanders import Told, told
from preprocess.trial import Trial

#: North and east.
AXES = (0, 1)


def with_velocity_wander(trials: Sequence[Trial]) -> list[Trial]:
    """The trials with the wander of their velocities, where they show one, and what wanders of positions beside it."""
    found = moving_wanders(trials)
    if found.rate is None:
        return list(trials)
    size, time = (found.own.size, found.own.time) if found.own else (0.0, 0.0)
    return [
        with_wanders(_with_position(t, size, time), {"velocity": found.rate}) if _of_one_receiver(t) else t
        for t in trials
    ]


def _of_one_receiver(trial: Trial) -> bool:
    """Whether a log has positions and velocities that one receiver gives."""
    position, velocity = (trial.measurements.get(k) for k in ("position", "velocity"))
    return position is not None and velocity is not None and position.sender == velocity.sender


def _with_position(trial: Trial, size: float, time: float) -> Trial:
    known = replace(trial.measurements["position"], wander=size, correlation_time=time)
    return replace(trial, measurements={**trial.measurements, "position": known})


def moving_wanders(trials: Sequence[Trial]) -> Told:
    """The wander of the positions and that of the velocities of one receiver; none where none shows."""
    both = [t for t in trials if _of_one_receiver(t)]
    if not both:
        return Told()
    pairs = [(t, axis) for t in both for axis in AXES]
    runs = [run for number, (t, axis) in enumerate(pairs) for run in _runs(number, t, axis)]
    columns = [np.column_stack([run.rate, run.slope]) for run in runs]
    rates = [sensed(t.measurements["velocity"], 0) for t in both]
    return told(in_long_blocks(runs, columns, len(pairs)), rates)


def _runs(number: int, trial: Trial, axis: int) -> list[Run]:
    position, velocity = (sensed(trial.measurements[k], axis) for k in ("position", "velocity"))
    return runs_of(number, position, velocity, trial.segments)
