"""One part of one log: judge the samples, find the unbroken stretches, smooth, and say what was done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from preprocess import frames
from preprocess.chains import Segments, Stream, inside
from preprocess.clocks import beyond_order, clock_offsets
from preprocess.commands import feedback_noise, judge_input
from preprocess.doubts import turns_apart
from preprocess.driven import smooth_heading
from preprocess.findings import longest_kind, manoeuvres_of, said, without_numbers
from preprocess.gaps import find_segments, narrowed, widened
from preprocess.gusts import without_noise
from preprocess.inertial import with_accelerations
from preprocess.judge import Judged, judge
from preprocess.manoeuvres import ANGLES
from preprocess.raw import Raw, kept
from preprocess.smoother import ChainResult, at_origin, states, to_earth
from preprocess.smoothing import motion
from preprocess.stated import all_heard
from preprocess.trial import FloatArray, Measurement, Step
from preprocess.turning import smooth_track
from preprocess.turns import with_turns
from preprocess.vessel import Smoothing, Vessel

if TYPE_CHECKING:
    from preprocess.trials import Gathered


@dataclass(frozen=True)
class Made:
    """What a trial is made of."""

    measurements: Mapping[str, Measurement]
    inputs: Mapping[str, Measurement]
    states: pd.DataFrame
    segments: Segments
    manoeuvre: str | None
    findings: tuple[str, ...]
    history: tuple[Step, ...]


def process(
    g: Gathered,
    vessel: Vessel,
    bounds: tuple[float, float],
    smoothing: Smoothing | None = None,
    *,
    by_response: bool = True,
) -> Made:
    """Make one part of a log into the pieces of a trial.

    Parameters
    ----------
    g : Gathered
    vessel : Vessel
    bounds : (start, end) s
    smoothing : Smoothing, optional
        How the motion is made; samples, levels and clocks are judged by the default smoother in any case.
    by_response : bool
        Tell clocks by a model of the response too.
    """
    judged = with_turns({k: judge(cut(raw, bounds)) for k, raw in g.sensors.items()})
    inputs = {k: judge_input(cut(raw, from_the_last(raw.t, bounds))) for k, raw in g.inputs.items()}
    silent = without_numbers(inputs.values())
    segments = () if silent else find_segments(judged, vessel)
    wanted = sensor_times(judged)
    beside = widened(segments, judged)
    speed = rough_speed(judged["position"])
    stated = {k: j.raw.stated for k, j in judged.items()}
    turning_sensors, words = all_heard(heading_streams(judged), stated, segments)
    heading = smooth_heading(turning_sensors, speed, segments, wanted, inputs, beside)
    track_sensors, more_words = all_heard(track_streams(judged, heading, vessel), stated, segments)
    words |= more_words
    track = smooth_track(track_sensors, heading, segments, wanted, inputs, beside)
    track, worth = with_accelerations(track, heading, g.accelerations, vessel.imu, segments, inputs)
    judged = {k: with_outliers(j, (heading, track)) for k, j in judged.items()}
    segments = narrowed(segments, judged, vessel)
    table = only_within(states(track, heading), segments)
    sigma = _named(heading) | _named(track)
    weight = {s.name: s.weight for chain in (heading, track) for s in chain.streams}
    measurements = {
        k: measurement(j, sigma.get(k) or white_noise(j), weight.get(k)) for k, j in judged.items()
    }
    if track.wander is not None:
        measurements["position"] = replace(
            measurements["position"], wander=track.wander.sigma, correlation_time=track.wander.time
        )
    if "velocity" in judged and judged["velocity"].raw.body:
        measurements["velocity"] = over_ground(measurements["velocity"], heading, vessel)
    if "wind" in judged:
        measurements["wind"] = air(judged["wind"], measurements["wind"], table)
    turning = any(raw.source.quantity == "azimuth" for raw in g.inputs.values())
    driven = inputs if by_response and not turning else None
    apart = turns_apart(measurements) is not None
    offsets = clock_offsets(heading, track, table, segments, driven, apart=apart)
    offsets = tuple(beyond_order(o, measurements, inputs) for o in offsets)
    angles = frozenset(k for k, raw in g.inputs.items() if raw.source.quantity in ANGLES)
    found = manoeuvres_of(table, segments, inputs, vessel.length, angles, g.run.manoeuvre)
    part = "log" if g.run.role else "part of the log"
    findings = tuple(said(judged, segments, offsets, found, track.wander, words, worth, silent, part))
    rudders = {k: inputs[k] for k, raw in g.inputs.items() if raw.source.quantity == "rudder"}
    made, observed = motion(smoothing or Smoothing(), track, heading, segments, rudders)
    history = (
        *(Step("set_aside", {"quantity": k, **j.reasons}) for k, j in judged.items() if j.reasons),
        *(Step("set_aside", {"input": k, **m.reasons}) for k, m in inputs.items() if m.reasons),
        *(Step("stated_accuracy", {"quantity": k, **asdict(w)}) for k, w in words.items()),
        Step("segments", {"segments": [list(s) for s in segments]}),
        *(Step("accelerations", asdict(w)) for w in [worth] if w is not None),
        Step("smooth", {"chain": "heading", "q": heading.levels.q, "sigma": _named(heading)}),
        Step("smooth", {"chain": "track", "q": track.levels.q, "sigma": _named(track), **_wander(track)}),
        Step(
            "clock_offsets",
            {
                o.stream: [o.against, o.offset, o.stderr, o.gain if np.isfinite(o.gain) else None]
                for o in offsets
            },
        ),
        *observed,
    )
    made = only_within(made, segments)
    return Made(measurements, inputs, made, segments, longest_kind(found), findings, history)


def _named(chain: ChainResult) -> dict[str, float]:
    return {s.name: float(x) for s, x in zip(chain.streams, chain.levels.sigma, strict=True)}


def _wander(chain: ChainResult) -> dict[str, object]:
    w = chain.wander
    return {} if w is None else {"wander": w.sigma, "correlation_time": w.time}


def with_outliers(j: Judged, chains: tuple[ChainResult, ...]) -> Judged:
    """Take over what the chains set aside."""
    good = j.good.copy()
    for stream in (s for c in chains for s in c.streams if s.name == j.raw.quantity):
        good &= stream.good
    outliers = int(j.good.sum() - good.sum())
    return replace(j, good=good, reasons={**j.reasons, **({"outlier": outliers} if outliers else {})})


def only_within(table: pd.DataFrame, segments: Segments) -> pd.DataFrame:
    """States with nothing known outside the segments."""
    outside = inside(table["t"].to_numpy(dtype=float), segments) < 0
    known = table.columns.drop("t")
    return table.assign(**{k: table[k].mask(outside) for k in known}) if outside.any() else table


def white_noise(j: Judged) -> float:
    """Noise of a sensor that no chain smooths, per component: the largest of its columns'."""
    if not j.good.any():
        return 0.0
    columns = np.reshape(j.raw.value[j.good], (int(j.good.sum()), -1)).T
    return max((feedback_noise(c) for c in columns), default=0.0)


def cut(raw: Raw, bounds: tuple[float, float]) -> Raw:
    """Return the samples between the bounds."""
    keep = (raw.t >= bounds[0]) & (raw.t <= bounds[1])
    return kept(raw, keep)


def from_the_last(t: FloatArray, bounds: tuple[float, float]) -> tuple[float, float]:
    """Bounds from the last of an input's times (n,) s before them: that value still acts."""
    before = t[t < bounds[0]]
    return float(before[-1]) if len(before) else bounds[0], bounds[1]


def sensor_times(judged: Mapping[str, Judged]) -> FloatArray:
    """Distinct times of the sensors that the smoother uses, s."""
    used = [judged[k].raw.t for k in ("position", "heading", "yaw_rate", "velocity") if k in judged]
    return np.unique(np.concatenate(used))


def rough_speed(position: Judged) -> tuple[FloatArray, FloatArray]:
    """Speed over some ten samples of the position, robustly: times (n,) s and values (n,) m/s."""
    from scipy.ndimage import median_filter

    t, value = position.raw.t[position.good], position.raw.value[position.good]
    span = min(5, (len(t) - 1) // 2)
    if span < 1:
        return np.zeros(1), np.zeros(1)
    speed = np.hypot(*(value[2 * span :] - value[: -2 * span]).T) / (t[2 * span :] - t[: -2 * span])
    return t[span:-span], median_filter(speed, size=11, mode="nearest")


def _stream(j: Judged, order: int) -> Stream:
    value = j.raw.value if j.raw.value.ndim == 2 else j.raw.value[:, None]
    return Stream(j.raw.quantity, j.raw.t, value, order, j.good, j.good, floor=j.floor)


def heading_streams(judged: Mapping[str, Judged]) -> tuple[Stream, ...]:
    """Heading and, where there is one, yaw rate."""
    out = (_stream(judged["heading"], 0),)
    return (*out, _stream(judged["yaw_rate"], 1)) if "yaw_rate" in judged else out


def track_streams(judged: Mapping[str, Judged], heading: ChainResult, vessel: Vessel) -> tuple[Stream, ...]:
    """Position and, where there is one, velocity, both of the campaign's origin."""
    out = (at_origin(_stream(judged["position"], 0), heading, vessel.antenna),)
    if "velocity" not in judged:
        return out
    velocity, arm = _stream(judged["velocity"], 1), vessel.antenna
    if judged["velocity"].raw.body:
        velocity, arm = to_earth(velocity, heading), vessel.imu
    return (*out, at_origin(velocity, heading, arm))


def measurement(j: Judged, sigma: float, weight: FloatArray | None = None) -> Measurement:
    """Return the samples as the trial keeps them."""
    t = j.raw.t
    step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    name, source = j.raw.quantity, j.raw.source.name
    return Measurement(
        name, t, j.raw.value, sigma, j.good, source, j.reasons, step, weight=weight, unsure=j.raw.unsure,
        sender=j.raw.sender,
    )  # fmt: skip


def over_ground(made: Measurement, heading: ChainResult, vessel: Vessel) -> Measurement:
    """Velocity along the body's axes, turned to north and east and moved from its sensor to the antenna."""
    known = np.isfinite(heading.mean[:, 0, 0])
    if not known.any():
        return replace(made, good=np.zeros(len(made.t), dtype=bool))
    t = heading.t[known]
    psi, r = (np.interp(made.t, t, heading.mean[known, k, 0], left=np.nan, right=np.nan) for k in range(2))
    arm = (vessel.antenna[0] - vessel.imu[0], vessel.antenna[1] - vessel.imu[1])
    value = frames.body_to_earth(made.value, psi) + frames.lever_velocity(arm, psi, r)
    return replace(made, value=value, good=made.good & np.isfinite(value).all(axis=1))


def air(j: Judged, made: Measurement, table: pd.DataFrame) -> Measurement:
    """Wind as the velocity of the air over ground, north and east; relative wind by the smoothed motion."""
    speed, direction = j.raw.value.T
    if not j.raw.relative:
        return _air(made, frames.wind_to_air_velocity(speed, direction))
    known = table.dropna(subset=["psi", "u"])
    if known.empty:
        return replace(made, good=np.zeros(len(made.t), dtype=bool))
    psi, u, v = (
        np.interp(j.raw.t, known["t"], known[k], left=np.nan, right=np.nan) for k in ("psi", "u", "v")
    )
    relative = frames.wind_to_air_velocity(speed, direction)
    value = frames.body_to_earth(relative + np.column_stack([u, v]), psi)
    return _air(made, value)


def _air(made: Measurement, value: FloatArray) -> Measurement:
    good = made.good & np.isfinite(value).all(axis=1)
    smoothed = value.copy()
    smoothed[good], sigma = without_noise(made.t[good], value[good])
    return replace(made, value=smoothed, good=good, sigma=sigma)
