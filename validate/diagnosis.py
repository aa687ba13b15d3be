"""The fourth of the four data shapes: what the model lacks, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import pandas as pd

from identify.fit import Fit, FittedEffect
from ingest.log import Log
from preprocess.trial import Trial

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: What stays unexplained is material above this share of a channel's spread, where nothing else is asked for.
MATERIALITY = 0.1


class Verdict(Enum):
    """The four verdicts; the value is what a person reads."""

    ADEQUATE = "The model lacks nothing material that these data can show."
    EXPLAINED = "The model lacked what is named below; with it, nothing material remains."
    AMBIGUOUS = "Something is missing, but on these data two causes cannot be told apart."
    UNEXPLAINED = "Something material is missing that no known effect accounts for."


@dataclass(frozen=True)
class ResidualTest:
    """One test of the residuals of one channel; a small p-value speaks against white noise."""

    name: str
    channel: str
    statistic: float
    p_value: float


@dataclass(frozen=True)
class Candidate:
    """An effect that was tried in a round.

    ``evidence`` is the gain in -2 log likelihood less its penalty; ``p_value`` counts the candidates tried;
    ``rmse_before`` and ``rmse_after`` are per channel (u, v, r), cross-validated inside the identify logs;
    infinite where the prediction ran away. ``promise`` is what a first look promises in place of the evidence. Of a
    candidate that was not refitted nothing else is known: its evidence, p-value and errors after are not a number.
    """

    effect: str
    input: str | None
    evidence: float
    p_value: float
    rmse_before: Mapping[str, float]
    rmse_after: Mapping[str, float]
    note: str = ""
    promise: float = math.nan


@dataclass(frozen=True)
class Round:
    """One turn of the loop.

    Whether what was ``accepted`` ``stands`` at the end, and a ``remark`` on what became of it, where it does not stand
    as it was taken.
    """

    residual_tests: tuple[ResidualTest, ...]
    candidates: tuple[Candidate, ...]
    accepted: str | None
    stands: bool = True
    remark: str = ""


@dataclass(frozen=True)
class TakenEffect:
    """An effect that was taken, with its look-alikes on these data."""

    fitted: FittedEffect
    p_value: float
    look_alikes: tuple[str, ...]


@dataclass(frozen=True)
class Diagnosis:
    """What the declared model lacks; what is ``unexplained`` is material above ``materiality``."""

    verdict: Verdict
    effects: tuple[TakenEffect, ...]
    rounds: tuple[Round, ...]
    unexplained: Mapping[str, float]
    advice: str
    materiality: float = MATERIALITY


@dataclass(frozen=True)
class ChannelScore:
    """Free-running prediction of one channel against the smoothed measurement; None where not predicted."""

    mse: float | None
    rmse: float | None
    r2: float | None
    nrmse: float | None


@dataclass(frozen=True)
class LogScore:
    """Scores of one log (or part of it, by role)."""

    path: str
    role: str
    channels: Mapping[str, ChannelScore]


@dataclass(frozen=True)
class Validation:
    """Scores over all logs with role validate (pooled), and per log (every log)."""

    channels: Mapping[str, ChannelScore]
    fitness: float | None
    position_rmse: float | None
    heading_rmse: float | None
    logs: tuple[LogScore, ...]


@dataclass(frozen=True)
class Results:
    """Everything a run found out; report.json, report.html, the recording and the tables are made from it.

    Attributes
    ----------
    campaign : str
        Path of the campaign file as the user gave it.
    logs : tuple of Log
        As read (findings, counts); their tables may be empty.
    trials : tuple of Trial
        One per log, or two where the last third of each log validates (same ``name``, roles differ).
    before, after : Fit
        The declared model alone, and with the effects taken; where none was, ``after`` has no effects.
    validation_before, validation_after : Validation
        Free-running scores.
    diagnosis : Diagnosis, optional
        None with ``--no-loop``.
    predictions : mapping of log name to DataFrame
        As ``predictions/*.parquet``: ``t``, ``utc_ns``, ``role``, states, ``_measured``, inputs, ``_before``,
        ``_after``.
    actuators : mapping of log name to DataFrame
        ``t`` and each input as the identified actuator made it (with the effects taken); same rows as predictions.
    timing_s : mapping
        Seconds per stage.
    equations : tuple of str
        The fitted equations (after), one per degree of freedom, as text.
    papers : tuple of str
        References that this run rests on.
    remarks : tuple of str
        What a person should know of the logs together, as sentences.
    carried : mapping of log name to DataFrame
        ``t`` and, of every state, the standard deviation that the error of the first one makes in the prediction (with
        the effects taken); same rows as predictions.
    """

    campaign: str
    logs: tuple[Log, ...]
    trials: tuple[Trial, ...]
    before: Fit
    after: Fit
    validation_before: Validation
    validation_after: Validation
    diagnosis: Diagnosis | None
    predictions: Mapping[str, pd.DataFrame]
    actuators: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    timing_s: Mapping[str, float] = field(default_factory=dict)
    equations: tuple[str, ...] = ()
    papers: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    carried: Mapping[str, pd.DataFrame] = field(default_factory=dict)
