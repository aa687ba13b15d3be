"""The second of the four data shapes: one manoeuvre of one vessel, in the closed vocabulary of signals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


@dataclass(frozen=True)
class Measurement:
    """The samples of one sensor (or input) at its own times, in SI units.

    Attributes
    ----------
    name : str
        In the vocabulary: ``position``, ``heading``, ``yaw_rate``, ``velocity``, ``wind``, ``depth``; or an input.
    t : (n,) s
        Times since the log's first record, strictly increasing, latency already taken off where it was declared.
    value : (n,) or (n, 2)
        Raw values in SI units (heading unwrapped), outliers included.
    sigma : float
        Standard deviation of the sensor's white noise, in the value's unit (per component), as estimated from the
        data or given; 0 for an input that is a command.
    good : (n,) bool
        False where the sample was taken for an outlier, frozen or flagged by the receiver.
    source : str
        The signal in the log.
    reasons : mapping of str to int
        How many samples were set aside, by reason.
    sample_time : float
        Median interval between the samples as logged, s.
    held : bool
        For an input: True where its values are steps that hold (a command), False where it varies continuously.
    correlation_time : float
        Time constant of correlated (first-order Gauss-Markov) noise that the data show beside the white part, s;
        0 where there is none.
    wander : float
        Standard deviation of that correlated noise, per component, in the value's unit.
    smooth : bool
        Whether that noise is smooth: critically damped of second order, as a receiver's filter leaves it, not of first.
    quantum : float
        For an input: step to which its values were rounded as they were logged, in their unit; 0 where none shows or
        nobody looked (``preprocess.rounding.input_step``).
    weight : (n,), optional
        Variance of each sample's white noise as a multiple of ``sigma`` squared, where the sensor's own word on its
        accuracy is followed; None: all samples are alike.
    unsure : float
        By how much all times may be early or late together because only the order of the records tells them, s.
    sender : str, optional
        Of a position or velocity: the receiver or message that it comes from. Of one sender, both have one clock.
    """

    name: str
    t: FloatArray
    value: FloatArray
    sigma: float
    good: BoolArray
    source: str = ""
    reasons: Mapping[str, int] = field(default_factory=dict)
    sample_time: float = 0.0
    held: bool = False
    correlation_time: float = 0.0
    wander: float = 0.0
    smooth: bool = False
    quantum: float = 0.0
    weight: FloatArray | None = None
    unsure: float = 0.0
    sender: str | None = None


@dataclass(frozen=True)
class Step:
    """One entry of the history: what was done, with which arguments, as data that can be replayed."""

    action: str
    arguments: Mapping[str, object]


@dataclass(frozen=True)
class Trial:
    """One log (or slice of it) of one vessel.

    Attributes
    ----------
    name : str
        Path of the log as the campaign writes it.
    role : str
        ``"identify"`` or ``"validate"``.
    vessel, inputs_declared
        As the campaign declares them.
    measurements : mapping of str to Measurement
        The sensors, raw and cleaned, at their own times.
    inputs : mapping of str to Measurement
        The actuators' logged values, in the order of the campaign, at their own times.
    states : DataFrame
        Smoothed, one row per distinct sensor time, columns ``t x y psi u v r du dv dr`` and ``sigma_`` of each; NaN
        outside the segments.
    segments : tuple of (start, end)
        Unbroken stretches, s: within one, nothing was missing for longer than can be bridged.
    start : float
        Campaign time at t = 0, s (UTC where known, relative to the campaign's first log).
    utc_ns : int, optional
        UTC at t = 0.
    origin : (latitude, longitude) in degrees, or None where positions were logged in metres.
    manoeuvre : str, optional
        As declared or found.
    findings : tuple of str
        Sentences for the report: what is missing, clock offsets seen, and so on.
    history : tuple of Step
        What was done.
    depth : float, optional
        Depth of water declared for this log, m.
    """

    name: str
    role: str
    vessel: Vessel
    inputs_declared: tuple[Input, ...]
    measurements: Mapping[str, Measurement]
    inputs: Mapping[str, Measurement]
    states: pd.DataFrame
    segments: tuple[tuple[float, float], ...]
    start: float = 0.0
    utc_ns: int | None = None
    origin: tuple[float, float] | None = None
    manoeuvre: str | None = None
    findings: tuple[str, ...] = ()
    history: tuple[Step, ...] = ()
    depth: float | None = None
