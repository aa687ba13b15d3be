"""Offsets between the clocks of a log, from the motion itself: reported, never removed.

An offset is stamp less true time. Between heading and yaw rate it is found by the likelihood of the
heading chain with the yaw rate's stamps moved. Position and heading share no kinematic equation, and
neither do inputs and motion: there the offset is found beside a linear model of the response (sway to
yaw; yaw to the inputs) in the weak form, and cannot be told from an actuator's delay or from what that
model lacks. Whether it is a fault of the log is for the diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from preprocess.chains import Segments
from preprocess.gyro_clock import yaw_rate_offset
from preprocess.offsets import LONGEST, WORST, ClockOffset, search
from preprocess.smoother import ChainResult
from preprocess.trial import FloatArray, Measurement
from preprocess.weak_form import weak_form

#: A stretch must turn this much in all, rad, to tell an offset.
LEAST_TURN = 1.5
#: What the simple models of the response leave out, as a share of the response time.
MODEL_SHARE = 0.015


@dataclass(frozen=True)
class _Grid:
    """One stretch of the smoothed states on an even grid, with columns ready to be shifted."""

    t: FloatArray
    columns: Mapping[str, FloatArray]
    half: float


def _grids(states: pd.DataFrame, segments: Segments, half: float) -> list[_Grid]:
    out = []
    for low, high in segments:
        part = states[(states["t"] >= low) & (states["t"] <= high)].dropna()
        if high - low > 6.0 * half and len(part) > 20 and np.abs(np.diff(part["psi"])).sum() > LEAST_TURN:
            t = np.arange(low, high, half / 15.0)
            keep = ("psi", "u", "v", "r")
            out.append(_Grid(t, {k: np.interp(t, part["t"], part[k]) for k in keep}, half))
    return out


def _profile(
    grids: list[_Grid], build: Callable[[_Grid, float], tuple[FloatArray, FloatArray]]
) -> ClockOffset | None:
    """Offset that leaves least of a linear equation in the weak form, and its standard error."""
    forms = [weak_form(g.t, g.half) for g in grids]
    windows = sum(len(f.centres) for f in forms)
    if windows < 30:
        return None

    def left(tau: float) -> float:
        target, design = [], []
        for g, f in zip(grids, forms, strict=True):
            y, x = build(g, tau)
            target.append(-f.derivatives.dot(y))
            design.append(np.asarray(f.values.dot(x)))  # noqa: PD011
        a, b = np.vstack(design), np.concatenate(target)
        scale = np.maximum(np.abs(a).max(axis=0), 1e-12)
        solution = np.linalg.lstsq(a / scale, b, rcond=1e-9)[0]
        return float(((b - a / scale @ solution) ** 2).sum())

    offset, curvature = search(left)
    # neighbouring windows overlap by three quarters: a quarter of them count
    variance = 2.0 * left(offset) / max(windows / 4.0 - 8.0, 1.0) / max(curvature, 1e-300)
    stderr = float(np.hypot(np.sqrt(variance), MODEL_SHARE * grids[0].half))
    unsure = curvature <= 0.0 or stderr > WORST or abs(offset) > 0.9 * LONGEST
    return None if unsure else ClockOffset("", "", offset, stderr, left(0.0) / max(left(offset), 1e-300))


def response_time(states: pd.DataFrame) -> float:
    """Half a window that holds the turns of this vessel: from the power of ṙ against that of r, s."""
    r, dr = states["r"].dropna().to_numpy(), states["dr"].dropna().to_numpy()
    speed = float(np.std(dr) / max(np.std(r), 1e-12)) if len(r) else 1.0
    return float(np.clip(1.5 / max(speed, 1e-3), 1.0, 20.0))


def position_offset(
    states: pd.DataFrame, segments: Segments, inputs: Mapping[str, Measurement]
) -> ClockOffset | None:
    """Offset of the position's stamps against the heading's, beside a model of the sway."""
    moving = _moving(inputs)
    grids = _grids(states, segments, response_time(states))

    def build(g: _Grid, tau: float) -> tuple[FloatArray, FloatArray]:
        # velocities stamped t are those of t - tau: turn them by the heading of that time
        psi = g.columns["psi"]
        c, s = np.cos(psi), np.sin(psi)
        north, east = g.columns["u"] * c - g.columns["v"] * s, g.columns["u"] * s + g.columns["v"] * c
        moved = [np.interp(g.t + tau, g.t, k) for k in (north, east)]
        u, v = moved[0] * c + moved[1] * s, -moved[0] * s + moved[1] * c
        r = g.columns["r"]
        logged = [_at(m, g.t) for m in moving]
        terms = [v, r, u * r, u * v, np.abs(v) * v, np.abs(r) * r, np.ones_like(r)]
        return v, np.column_stack([*terms, *_forces(logged, u)])

    found = _profile(grids, build) if grids else None
    return None if found is None else replace(found, stream="position", against="heading")


def inputs_offset(
    states: pd.DataFrame, segments: Segments, inputs: Mapping[str, Measurement]
) -> ClockOffset | None:
    """Offset of the inputs' stamps against the motion's, beside a linear response of yaw to them.

    Motion that follows the inputs late (a delay or a lag of an actuator) makes it negative.
    """
    grids = _grids(states, segments, response_time(states))
    moving = _moving(inputs)

    def build(g: _Grid, tau: float) -> tuple[FloatArray, FloatArray]:
        u, v, r = (g.columns[k] for k in ("u", "v", "r"))
        logged = [_at(m, g.t + tau) for m in moving]
        terms = [v, r, u * r, u * v, np.abs(r) * r, np.ones_like(r)]
        return r, np.column_stack(
            [*terms, *logged, *(np.abs(c) * c for c in logged), *(c * u * u for c in logged)]
        )

    found = _profile(grids, build) if grids and moving else None
    return None if found is None else _less_holding(found, moving)


def _less_holding(found: ClockOffset, moving: list[Measurement]) -> ClockOffset:
    """Take off that a step is logged half an interval late on average, where the inputs are steps."""
    interval = max((m.sample_time for m in moving if m.held), default=0.0)
    stderr = float(np.hypot(found.stderr, interval / np.sqrt(12.0)))
    return replace(
        found, stream="the inputs", against="the motion", offset=found.offset - 0.5 * interval, stderr=stderr
    )


def _moving(inputs: Mapping[str, Measurement]) -> list[Measurement]:
    return [m for m in inputs.values() if len(m.t) > 3 and np.ptp(m.value) > 0.0]


def _forces(logged: list[FloatArray], u: FloatArray) -> list[FloatArray]:
    """Terms of the inputs' forces: in proportion, by the square, and by the square of the speed."""
    return [f for c in logged for f in (c, np.abs(c) * c, c * u * u)]


def _at(m: Measurement, t: FloatArray) -> FloatArray:
    """Return the logged input at any times: held, or straight between samples."""
    if not m.held:
        return np.interp(t, m.t, m.value)
    return np.asarray(m.value[np.clip(np.searchsorted(m.t, t, side="right") - 1, 0, len(m.t) - 1)], float)


def clock_offsets(
    heading: ChainResult,
    states: pd.DataFrame,
    segments: Segments,
    inputs: Mapping[str, Measurement] | None,
) -> tuple[ClockOffset, ...]:
    """Tell all offsets that the motion of one trial can tell; see the module.

    ``inputs`` is None where their forces turn with an azimuth, which the simple models of the response cannot
    follow: then only the kinematics speak.
    """
    found = [yaw_rate_offset(heading, segments)]
    if inputs is not None:
        found += [position_offset(states, segments, inputs), inputs_offset(states, segments, inputs)]
    return tuple(f for f in found if f is not None and np.isfinite(f.stderr))
