"""Which manoeuvre a stretch is, from its motion and its inputs; and the manoeuvres of a long log."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from preprocess.trial import FloatArray, Measurement, Trial
from preprocess.vessel import Input
from preprocess.zigzag import zigzag_angles

#: Kinds of input whose values are angles.
ANGLES = ("rudder", "azimuth")
#: Below this Froude number a vessel is idle.
IDLE_FROUDE = 0.02
GRAVITY = 9.81
#: Share of its speed below which a vessel has stopped; below which it has, however much it turned meanwhile.
STOPPED, DEAD = 0.35, 0.15
#: It began at speed where it did so at this share of its top speed.
AT_SPEED = 0.7
#: Share of the steering's half range within which it is about in the middle.
NEUTRAL = 0.4
#: A turn whose radius is less than this many lengths is one on the spot.
ON_THE_SPOT = 0.5
#: Circles to both sides are this share of all turning.
MOST_TURNING = 0.7


@dataclass(frozen=True)
class Found:
    """A manoeuvre: what, from when to when (s), and in words what is particular of it."""

    kind: str
    start: float
    end: float
    detail: str = ""


@dataclass(frozen=True)
class Motion:
    """Motion on an even grid with the input that steers: (n,) each; ``steer`` is None where nothing does.

    ``length`` is that of the vessel, m; ``every`` the longest time between the samples of an input, s.
    """

    t: FloatArray
    speed: FloatArray
    psi: FloatArray
    r: FloatArray
    steer: FloatArray | None
    angle: bool
    throttle: FloatArray | None
    length: float = 0.0
    every: float = 0.0


def find_manoeuvres(trial: Trial) -> tuple[Found, ...]:
    """Classify the stretches of a trial, cut where it lies idle."""
    out: list[Found] = []
    for low, high in trial.segments:
        part = trial.states[(trial.states["t"] >= low) & (trial.states["t"] <= high)]
        out += classify_stretch(part, trial.inputs, trial.vessel.length, angles_in(trial.inputs_declared))
    return tuple(out)


def angles_in(declared: Sequence[Input]) -> frozenset[str]:
    """Names of the inputs that are angles."""
    return frozenset(i.name for i in declared if i.kind in ANGLES)


def classify_stretch(
    states: pd.DataFrame,
    inputs: Mapping[str, Measurement],
    length: float,
    angles: frozenset[str] = frozenset(),
    declared: str | None = None,
) -> list[Found]:
    """Return the manoeuvres of one stretch: idle parts of 10 s or more, and what lies between.

    ``angles`` are the names of the inputs whose values are angles. What a campaign calls a log is believed of what
    is under way, unless it calls that idle.
    """
    s = gridded(states, inputs, angles=angles)
    if s is None:
        return []
    s = replace(s, length=length)
    idle = s.speed + 0.5 * length * np.abs(s.r) < idle_speed(length)
    edges = np.flatnonzero(np.diff(idle.astype(int))) + 1
    bounds = np.concatenate([[0], edges, [len(s.t)]])
    pieces = [(int(a), int(b)) for a, b in itertools.pairwise(bounds)]
    step = float(s.t[1] - s.t[0])
    declared = None if declared == "idle" else declared
    return [_named(_cut(s, a, b), rests, declared) for a, b, rests in _merged(pieces, idle, 10.0 / step)]


def _merged(pieces: list[tuple[int, int]], idle: np.ndarray, least: float) -> list[tuple[int, int, bool]]:
    """Pieces, and whether each is idle: short ones joined to the one before, the first to the one after it."""
    out: list[tuple[int, int, bool]] = []
    for a, b in pieces:
        rests = bool(idle[a])
        if out and (b - a < least or out[-1][2] == rests):
            out[-1] = (out[-1][0], b, out[-1][2])
        elif len(out) == 1 and out[0][1] - out[0][0] < least:
            out[0] = (out[0][0], b, rests)
        else:
            out.append((a, b, rests))
    return out


def idle_speed(length: float) -> float:
    """Speed below which a vessel of this length is idle, m/s."""
    return float(IDLE_FROUDE * np.sqrt(GRAVITY * length))


def gridded(
    states: pd.DataFrame,
    inputs: Mapping[str, Measurement],
    step: float | None = None,
    angles: frozenset[str] = frozenset(),
) -> Motion | None:
    """Motion on an even grid of ``step`` seconds (of 2000 points where not given); None where there is too little."""
    part = states.dropna(subset=["u", "r"])
    if len(part) < 10 or part["t"].iloc[-1] - part["t"].iloc[0] < 2.0:
        return None
    span = float(part["t"].iloc[-1] - part["t"].iloc[0])
    count = min(len(part), 2000) if step is None else max(int(span / step), 2) + 1
    t = np.linspace(part["t"].iloc[0], part["t"].iloc[-1], count)
    u, v, psi, r = (np.interp(t, part["t"], part[k]) for k in ("u", "v", "psi", "r"))
    values = {k: _acting(m, t) for k, m in inputs.items() if m.good.sum() > 1}
    steer, angle = _steering(values, angles, r)
    moving = [x for x in values.values() if np.ptp(x) > 0.0]
    throttle = np.mean(np.abs(moving), axis=0) if moving else None
    every = max((m.sample_time for k, m in inputs.items() if k in values), default=0.0)
    return Motion(t, np.hypot(u, v), psi, r, steer, angle, throttle, every=every)


def _acting(m: Measurement, t: FloatArray) -> FloatArray:
    """Value of an input at some times, (n,), by its good samples: a command holds until the next."""
    at, value = m.t[m.good], m.value[m.good]
    if not m.held:
        return np.interp(t, at, value)
    return np.asarray(value[np.maximum(np.searchsorted(at, t, side="right") - 1, 0)], dtype=float)


def _steering(
    values: Mapping[str, FloatArray], angles: frozenset[str], r: FloatArray
) -> tuple[FloatArray | None, bool]:
    """Return the combination of inputs that goes with the yaw rate, and whether it is one angle."""
    moving = {k: x for k, x in values.items() if np.ptp(x) > 0.0}
    if not moving:
        return None, False
    design = np.column_stack([x - x.mean() for x in moving.values()])
    weight = np.linalg.lstsq(design, r - r.mean(), rcond=1e-6)[0]
    best = int(np.argmax(np.abs(weight) * design.std(axis=0)))
    name = list(moving)[best]
    angle = name in angles
    return (list(moving.values())[best], True) if angle else (design @ weight, False)


def _cut(s: Motion, a: int, b: int) -> Motion:
    def part(x: FloatArray | None) -> FloatArray | None:
        return None if x is None else x[a:b]

    motion = (s.t[a:b], s.speed[a:b], s.psi[a:b], s.r[a:b])
    return Motion(*motion, part(s.steer), s.angle, part(s.throttle), s.length, s.every)


def _named(s: Motion, idle: bool, declared: str | None) -> Found:
    kind, detail = ("idle", "") if idle else classify(s, declared)
    return Found(kind, float(s.t[0]), float(s.t[-1]), detail)


def classify(s: Motion, declared: str | None = None) -> tuple[str, str]:
    """Kind and particulars of one piece; the kind is the one ``declared`` where there is one."""
    kind = declared or _kind(s)
    return kind, _particulars(kind, s)


def _kind(s: Motion) -> str:
    turn, net = _turn(s)
    levels = plateaus(s.steer) if s.steer is not None else np.empty(0)
    if turn < np.radians(25.0):
        return _straight(s)
    left = _speed_left(s)
    if left < DEAD or (left < STOPPED and abs(net) < np.radians(270.0)):
        return _straight(s)
    if len(levels) >= 5 and _one_way(levels) and turn > np.radians(180.0):
        return "spiral"
    if abs(net) > np.radians(270.0) and _round_one_way(s):
        return "circle"
    swings = reversals(s.psi, np.radians(4.0))
    if _large_turns(s.psi, swings):
        return "circle"
    return "zigzag" if len(swings) >= 2 and _alternates(levels) else "random"


def _particulars(kind: str, s: Motion) -> str:
    """What is particular of a piece of a kind, in words."""
    if kind == "zigzag":
        return zigzag_angles(s.t, s.psi, s.steer, s.every) if s.steer is not None and s.angle else ""
    if kind == "circle":
        return (
            f"{np.degrees(_turn(s)[1]):+.0f}° of heading{_on_the_spot(s)}"
            if _round_one_way(s)
            else "to both sides"
        )
    if kind == "spiral" and s.steer is not None:
        return f"{len(plateaus(s.steer))} levels of the steering"
    if kind == "stopping":
        return f"from {s.speed[0]:.2f} to {s.speed[-1]:.2f} m/s"
    return f"up to {s.speed.max():.2f} m/s" if kind == "speed" else ""


def _turn(s: Motion) -> tuple[float, float]:
    """How far it turned, either way and in all, rad."""
    return float(np.abs(np.diff(s.psi)).sum()), float(s.psi[-1] - s.psi[0])


def _round_one_way(s: Motion) -> bool:
    turn, net = _turn(s)
    return abs(net) > 0.9 * turn


def _on_the_spot(s: Motion) -> str:
    """In words, where it turned without going anywhere."""
    turning = np.abs(s.r) > 0.5 * np.abs(s.r).max()
    radius = float(np.median(s.speed[turning] / np.abs(s.r[turning])))
    return ", on the spot" if radius < ON_THE_SPOT * s.length else ""


def _speed_left(s: Motion) -> float:
    """Speed at the end as a share of that at the start; 1 where it did not begin near its full speed."""
    first = float(np.median(s.speed[: max(3, len(s.speed) // 30)]))
    if first < AT_SPEED * float(np.percentile(s.speed, 95.0)):
        return 1.0
    return float(np.median(s.speed[-len(s.speed) // 8 - 1 :]) / max(first, 1e-6))


def _straight(s: Motion) -> str:
    if _speed_left(s) < STOPPED:
        return "stopping"
    return "speed" if s.speed.std() > 0.12 * max(s.speed.mean(), 1e-6) else "straight"


def plateaus(steer: FloatArray, share: float = 0.04) -> FloatArray:
    """Levels at which the steering stays, in order; a level holds for 3 % of the stretch at least."""
    least, tolerance = max(3, len(steer) * 3 // 100), share * max(float(np.ptp(steer)), 1e-12)
    breaks = np.flatnonzero(np.abs(np.diff(steer)) > 0.5 * tolerance) + 1
    pieces = np.split(steer, breaks)
    levels = [float(np.median(p)) for p in pieces if len(p) >= least]
    out: list[float] = []
    for level in levels:
        if not out or abs(level - out[-1]) > tolerance:
            out.append(level)
    return np.array(out)


def _one_way(levels: FloatArray) -> bool:
    """Levels that go through the range step by step, one way or there and back."""
    steps = np.sign(np.diff(levels))
    return len(np.unique(np.round(levels, 3))) >= 5 and int((np.diff(steps) != 0).sum()) <= 2


def _alternates(levels: FloatArray) -> bool:
    """Levels of about two sizes that change sides each time; feedback may have too few to tell.

    What lies near the middle at both ends is how the log begins and ends.
    """
    if len(levels) < 3:
        return True
    away = levels - 0.5 * (levels.max() + levels.min())
    over = np.flatnonzero(np.abs(away) > NEUTRAL * np.abs(away).max())
    sides = np.sign(away[over[0] : over[-1] + 1])
    return len(sides) < 2 or bool(np.mean(np.diff(sides) != 0) > 0.7)


def reversals(psi: FloatArray, least: float) -> FloatArray:
    """Headings at which the vessel turned back by more than ``least``, in order; (k,) rad."""
    out, low, high, rising = [], psi[0], psi[0], 0
    for x in psi:
        low, high = min(low, x), max(high, x)
        if rising >= 0 and high - x > least:
            out += [high] * rising
            rising, low, high = -1, x, x
        elif rising <= 0 and x - low > least:
            out += [low] * -rising
            rising, low, high = 1, x, x
    return np.array(out)


def _large_turns(psi: FloatArray, swings: FloatArray) -> bool:
    """Whether most of its turning was by more than 270 degrees between two reversals, the ends counted as such."""
    turns = np.abs(np.diff(np.concatenate([psi[:1], swings, psi[-1:]])))
    return bool(turns[turns > 1.5 * np.pi].sum() > MOST_TURNING * turns.sum())
