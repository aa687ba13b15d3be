"""Errors of a receiver's velocity that wander, told by its positions: over all logs, whatever model there is.

A receiver filters the velocity that it gives: its errors last for some tenths of a second to some seconds. The position
less the integral of the velocity has no motion in it; how the position's own errors wander is told beside it anew, and
whether smoothly: of what looks like either, satellites move a position by metres, and a Doppler velocity by little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from preprocess.findings import POSITION_WANDERS, wandering
from preprocess.integrated import Run, in_long_blocks, runs_of, sensed
from preprocess.less_sure import with_wanders
from preprocess.told_wanders import Smooth, Told, Wander, told
from preprocess.trial import Trial

#: How positions wander smoothly, all of which is their own.
RECEIVERS = Smooth((40.0, 20.0, 80.0, 160.0), 10.0, 1.0)
#: North and east.
AXES = (0, 1)


def with_velocity_wander(trials: Sequence[Trial]) -> list[Trial]:
    """The trials with the wander of their velocities, where they show one, and what wanders of positions beside it."""
    found = moving_wanders(trials)
    if found.rate is None and not (found.own and found.own.smooth):
        return list(trials)
    return [
        with_wanders(_with_position(t, found.own), {"velocity": found.rate}) if _of_one_receiver(t) else t
        for t in trials
    ]


def _of_one_receiver(trial: Trial) -> bool:
    """Whether a log has positions and velocities that one receiver gives."""
    position, velocity = (trial.measurements.get(k) for k in ("position", "velocity"))
    return position is not None and velocity is not None and position.sender == velocity.sender


def _with_position(trial: Trial, own: Wander | None) -> Trial:
    """The trial with its positions' wander as it was told over all logs, in place of what its own told."""
    size, time, smooth = (own.size, own.time, own.smooth) if own else (0.0, 0.0, False)
    known = replace(trial.measurements["position"], wander=size, correlation_time=time, smooth=smooth)
    findings = tuple(f for f in trial.findings if not f.startswith(POSITION_WANDERS))
    said = (f"{wandering(size, time, smooth)}, as all logs tell.",) if own else ()
    return replace(trial, measurements={**trial.measurements, "position": known}, findings=(*findings, *said))


def moving_wanders(trials: Sequence[Trial]) -> Told:
    """The wander of the positions and that of the velocities of one receiver; none where none shows."""
    both = [t for t in trials if _of_one_receiver(t)]
    if not both:
        return Told()
    pairs = [(t, axis) for t in both for axis in AXES]
    runs = [run for number, (t, axis) in enumerate(pairs) for run in _runs(number, t, axis)]
    columns = [np.column_stack([run.rate, run.slope]) for run in runs]
    rates = [sensed(t.measurements["velocity"], 0) for t in both]
    return told(in_long_blocks(runs, columns, len(pairs)), rates, RECEIVERS)


def _runs(number: int, trial: Trial, axis: int) -> list[Run]:
    position, velocity = (sensed(trial.measurements[k], axis) for k in ("position", "velocity"))
    return runs_of(number, position, velocity, trial.segments)
