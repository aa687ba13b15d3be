"""Which trials can be used, and what is said where none can."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.stretch import STREAMS
from ingest.errors import NotIdentifiable
from preprocess.findings import without_numbers
from preprocess.trial import Trial

#: What is said where nothing can be identified on.
NO_STRETCH = "no log to identify on has an unbroken stretch of five seconds with position and heading."
#: Logs that are named where none can be used.
MOST_SAID = 3
#: Samples that come this far apart, s, are too rare for any vessel, or their times are in another unit.
RARE = 5.0


def usable(trials: Sequence[Trial], lost: Sequence[str] = ()) -> list[Trial]:
    """The trials without the logs, or parts by role, of which nothing can be used: these say nothing of any sensor.

    ``lost`` are sentences on what was taken off before.

    Raises
    ------
    NotIdentifiable
        Where none to identify on is left.
    """
    found = {(t.name, t.role) for t in trials if t.segments}
    if not any(role == "identify" for _, role in found):
        raise NotIdentifiable(why_none([t for t in trials if t.role == "identify"], lost))
    return [t for t in trials if (t.name, t.role) in found]


def why_none(trials: Sequence[Trial], lost: Sequence[str] = ()) -> str:
    """What is said where none of these can be used: inputs that say nothing, else that all are too short."""
    silent = [f"{t.name}: {words}" for t in trials for words in without_numbers(t.inputs.values())]
    if silent:
        return f"no log to identify on can be used: {'; '.join(silent[:MOST_SAID])}."
    return " ".join([NO_STRETCH + _rarely_sampled(trials), *lost[:MOST_SAID]])


def still(trial: Trial) -> bool:
    """Whether no sensor of the motion ever shows a second value."""
    values = [trial.measurements[k].value for k in STREAMS if k in trial.measurements]
    return bool(values) and not any(len(v) and np.ptp(v, axis=0).any() for v in values)


def _rarely_sampled(trials: Sequence[Trial]) -> str:
    """What is to be said of a log whose samples come seconds apart: its times may be in another unit."""
    for trial in trials:
        for name, m in trial.measurements.items():
            step = float(np.median(np.diff(m.t))) if len(m.t) > 1 else 0.0
            if step >= RARE:
                return (
                    f" {trial.name} has a {name} every {step:.3g} s ({1.0 / step:.2g} Hz)."
                    " Where its times are in milliseconds, their column is to be called so: t_ms."
                )
    return ""
