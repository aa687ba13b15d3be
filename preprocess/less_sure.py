"""Measurements whose errors wander, and smoothed states that have followed that: both are less sure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from preprocess.integrated import EXACT, sensed
from preprocess.told_wanders import Wander
from preprocess.trial import FloatArray, Measurement, Trial

#: What a finding calls a stream, its unit, what that is in SI, and what of the motion is less sure.
WORDS = {
    "heading": ("heading", "°", np.radians(1.0), "sway"), "yaw_rate": ("yaw rate", " °/s", np.radians(1.0), "it"),
    "velocity": ("velocity", " m/s", 1.0, "it"),
}  # fmt: skip


def with_wanders(trial: Trial, found: Mapping[str, Wander | None]) -> Trial:
    """The trial with the errors of some measurements known to wander, and what follows from these less sure."""
    for name, wander in found.items():
        if wander is not None and name in trial.measurements:
            trial = _with_one(trial, name, wander)
    return trial


def _with_one(trial: Trial, name: str, wander: Wander) -> Trial:
    measured = trial.measurements[name]
    sigma = measured.sigma if wander.white is None else min(measured.sigma, wander.white)
    known = replace(
        measured, wander=wander.size, correlation_time=wander.time, smooth=wander.smooth, sigma=sigma
    )
    what, unit, si, less = WORDS[name]
    lasting = f"{wander.time:.{0 if wander.time >= 10.0 else 1}f} s"
    said = f"The errors of the {what} wander ({wander.size / si:.2g}{unit}, over {lasting}): {less} is less sure."
    return replace(
        trial,
        states=_less_sure(trial.states, name, measured, wander),
        measurements={**trial.measurements, name: known},
        findings=(*trial.findings, said),
    )


def _less_sure(states: pd.DataFrame, name: str, measured: Measurement, wander: Wander) -> pd.DataFrame:
    """The states with what the smoother followed of a wander: a heading's turns what moves along into sway."""
    states = states.copy()
    white = max(measured.sigma, EXACT) ** 2 * sensed(measured).every
    times = (4.0 if wander.smooth else 2.0) * wander.size**2 * wander.time / white
    along = np.hypot(states["u"], states["v"])
    first, more = {"heading": ("psi", ("psi",)), "yaw_rate": ("r", ("r",)), "velocity": ("u", ("u", "v"))}[
        name
    ]
    followed = _followed(states[f"sigma_{first}"].to_numpy(dtype=float), times, wander.size)
    for k in more:
        states[f"sigma_{k}"] = np.hypot(states[f"sigma_{k}"], followed)
    if name == "heading":
        states["sigma_v"] = np.hypot(states["sigma_v"], along * followed)
    return states


def _followed(sigma: FloatArray, times: float, size: float) -> FloatArray:
    """Standard deviation (n,) by which a smoothed state follows a wander.

    All of it, or what so many times the noise makes of what was taken for white: a smoother averages what is quick.
    """
    return np.asarray(np.minimum(size, np.sqrt(times) * sigma), dtype=float)
