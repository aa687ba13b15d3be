"""Which trials can be used, and what is said where none can."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.stretch import STREAMS
from ingest.errors import NotIdentifiable
from preprocess.findings import in_words, without_numbers
from preprocess.manoeuvres import idle_speed
from preprocess.rarely import rarely_sampled
from preprocess.trial import Trial

#: What is said where nothing can be identified on.
NO_STRETCH = "no log to identify on has an unbroken stretch of five seconds with position and heading."
#: What a stretch is made of.
NEEDED = ("position", "heading")
#: Share of the samples without which a log may have no stretch left, and what is said where most only repeat the last.
MANY_ASIDE = 0.5
REPEATED = "the vessel hardly moves, or what is logged is renewed more rarely than it is written"
#: What is said where times are in another unit, though nothing else is wrong with the logs.
CREEPING = (
    "in no log to identify on does the vessel move faster than one that lies idle, and samples are rare."
)
#: Logs that are named where none can be used.
MOST_SAID = 3


def usable(trials: Sequence[Trial], lost: Sequence[str] = ()) -> list[Trial]:
    """The trials without the logs, or parts by role, of which nothing can be used: these say nothing of any sensor.

    ``lost`` are sentences on what was taken off before.

    Raises
    ------
    NotIdentifiable
        Where none to identify on is left, or the times of all of them are in another unit.
    """
    found = {(t.name, t.role) for t in trials if t.segments}
    to_identify = [t for t in trials if t.role == "identify"]
    if not any(role == "identify" for _, role in found):
        raise NotIdentifiable(why_none(to_identify, lost))
    if all(creeping(t) for t in to_identify if t.segments) and (rarely := _rarely_sampled(to_identify)):
        raise NotIdentifiable(CREEPING + rarely)
    return [t for t in trials if (t.name, t.role) in found]


def why_none(trials: Sequence[Trial], lost: Sequence[str] = ()) -> str:
    """What is said where none of these can be used: inputs that say nothing, else that all are too short."""
    silent = [f"{t.name}: {words}" for t in trials for words in without_numbers(t.inputs.values())]
    if silent:
        return f"no log to identify on can be used: {'; '.join(silent[:MOST_SAID])}."
    aside = [words for t in trials for words in mostly_aside(t)]
    return " ".join([NO_STRETCH + _rarely_sampled(trials), *aside[:MOST_SAID], *lost[:MOST_SAID]])


def mostly_aside(trial: Trial) -> list[str]:
    """Sentences on positions and headings most of which were set aside: why, and what that may come from."""
    out = []
    for name, m in ((n, trial.measurements[n]) for n in NEEDED if n in trial.measurements):
        if len(m.good) and 1.0 - m.good.mean() > MANY_ASIDE:
            most = max(m.reasons, key=lambda r: m.reasons[r], default="")
            cure = f": {REPEATED}" if most == "repeated" else ""
            count = f"{int((~m.good).sum())} of {len(m.good)} samples of {name}"
            out.append(f"{trial.name}: {count} were set aside ({in_words(m.reasons)}){cure}.")
    return out


def creeping(trial: Trial) -> bool:
    """Whether a vessel nowhere moves faster than one that lies idle."""
    speed = np.hypot(*(trial.states[k].to_numpy(dtype=float) for k in ("u", "v")))
    speed = speed[np.isfinite(speed)]
    return len(speed) > 0 and float(np.quantile(speed, 0.95)) < idle_speed(trial.vessel.length)


def still(trial: Trial) -> bool:
    """Whether no sensor of the motion ever shows a second value."""
    values = [trial.measurements[k].value for k in STREAMS if k in trial.measurements]
    return bool(values) and not any(len(v) and np.ptp(v, axis=0).any() for v in values)


def _rarely_sampled(trials: Sequence[Trial]) -> str:
    """What is to be said of a log whose samples come seconds apart: its times may be in another unit."""
    said = (rarely_sampled(t.name, name, m.t) for t in trials for name, m in t.measurements.items())
    return next(filter(None, said), "")
