"""Offsets of position and inputs against the heading's clock, from how the vessel responds.

Position and heading share no kinematic equation, nor do inputs and motion. What ties them is that a vessel responds
smoothly: its sway to its turning, its turning to its inputs, each with a time constant of its own
(``preprocess.free_response``). The vessel's own lag is then no delay; what the actuators add to it is: a delay, a lag
of theirs and an offset of clocks cannot be told apart here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd

from preprocess.chains import Segments, Stream, inside
from preprocess.free_fit import Fitted, fit, least_squares
from preprocess.free_response import Driven, Pose, Posed, Stretch, middle
from preprocess.hull_clock import told_by_hull
from preprocess.hull_data import seen
from preprocess.offsets import LONGEST, WORST, ClockOffset
from preprocess.response import moving_inputs
from preprocess.trial import FloatArray, Measurement
from preprocess.weak_form import bump, weak_form

#: A stretch must turn this much in all, rad, to tell an offset.
LEAST_TURN = 1.5
#: Points of the grid per response time, and at most in all; of longer logs, so many even pieces.
POINTS, MOST_POINTS, PIECES = 15.0, 4_000, 4
#: … of the run of a whole hull per response time.
HULL_POINTS = 30.0
#: Half a window, as a share of the response time; windows that count, as neighbours overlap by three quarters.
HALF, COUNTED, POWER = 0.5, 0.25, 4
#: Windows that are needed beyond the unknowns, and blocks of windows whose errors go together.
SPARE, BLOCKS = 12.0, 16
#: What the models leave out, as a share of the response time.
MODEL_SHARE = 0.004


def response_time(states: pd.DataFrame) -> float:
    """Time in which this vessel turns: from the power of ṙ against that of r, s."""
    r, dr = states["r"].dropna().to_numpy(), states["dr"].dropna().to_numpy()
    speed = float(np.std(dr) / max(np.std(r), 1e-12)) if len(r) else 1.0
    return float(np.clip(1.5 / max(speed, 1e-3), 1.0, 20.0))


@dataclass(frozen=True)
class Fixes:
    """What smoothing left of the positions: stamps (n,) s, what each stands for (n,) s, north and east (n, 2) m."""

    t: FloatArray
    width: FloatArray
    error: FloatArray


def fixes_of(position: Stream, states: pd.DataFrame, segments: Segments) -> Fixes:
    """Positions in use, less the smoothed track, by its origin."""
    known = states.dropna(subset=["x", "y"])
    use = position.good & (inside(position.t, segments) >= 0)
    t, value = position.t[use], position.value[use]
    track = np.column_stack([np.interp(t, known["t"], known[k]) for k in ("x", "y")])
    width = np.gradient(t) if len(t) > 1 else np.ones(len(t))
    return Fixes(t, np.minimum(width, 2.0 * np.median(width)) if len(t) else width, value - track)


def sway_left(s: Stretch, fixes: Fixes, off: float) -> FloatArray:
    """What smoothing took from the sway, averaged over the windows, (k,): by parts, so without a derivative.

    A smoother rounds off a velocity before a change as well as after it: beside a response, which begins only with its
    cause, that looks like stamps that are early.
    """
    t = fixes.t - off
    here = (t > s.t[0]) & (t < s.t[-1])
    t, error = t[here], fixes.error[here] * fixes.width[here, None]
    psi, r = (np.interp(t, s.t, s.columns[k]) for k in ("psi", "r"))
    c, d = np.cos(psi), np.sin(psi)
    across, turned = error[:, 1] * c - error[:, 0] * d, -r * (error[:, 0] * c + error[:, 1] * d)
    low, high = (np.searchsorted(t, s.centres + x * s.half) for x in (-1.0, 1.0))
    window = np.repeat(np.arange(len(low)), high - low)
    at = np.arange(len(window)) - np.repeat(np.cumsum(high - low) - high, high - low)
    value, slope = bump((t[at] - s.centres[window]) / s.half, POWER)
    left = np.bincount(window, slope * across[at] / s.half + value * turned[at], len(s.centres))
    return np.asarray(-left, float)


def stretches(states: pd.DataFrame, segments: Segments, time: float) -> list[Stretch]:
    """The stretches that turn enough, on a grid that the response time asks for."""
    step = time / POINTS
    out = []
    for low, high in excerpts(segments, step * MOST_POINTS, 6.0 * time):
        part = states[(states["t"] >= low) & (states["t"] <= high)].dropna()
        if high - low > 6.0 * time and len(part) > 20 and np.abs(np.diff(part["psi"])).sum() > LEAST_TURN:
            t = np.arange(low, high, step)
            columns = {k: np.interp(t, part["t"], part[k]) for k in ("psi", "u", "v", "r")}
            form = weak_form(t, HALF * time, power=POWER)
            out.append(Stretch(t, columns, form.values, form.centres, form.half))
    return out


def excerpts(segments: Segments, most: float, least: float) -> Segments:
    """The segments; where they last longer than ``most`` in all, even pieces of them of ``least`` or more, s."""
    total = sum(b - a for a, b in segments)
    if total <= most:
        return segments
    size = max(most / PIECES, 1.01 * least)
    out: list[tuple[float, float]] = []
    for a, b in segments:
        count = max(round(PIECES * (b - a) / total), 1)
        out += [(float(x), float(min(x + size, b))) for x in np.linspace(a, max(b - size, a), count)]
    return tuple(out)


@dataclass(frozen=True)
class Integrals:
    """Integrals of an input and of its square with sign, at knots: exact averages over any interval."""

    t: FloatArray
    plain: FloatArray
    square: FloatArray

    def means(self, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Averages of c and |c|c between edges (n,), (n - 1,) each."""
        width = np.diff(edges)
        plain, square = (np.diff(np.interp(edges, self.t, c)) / width for c in (self.plain, self.square))
        return plain, square


def integrals(m: Measurement) -> Integrals:
    """Integrals of an input: held, or straight between samples; its first and last values hold on."""
    at, value = m.t[m.good], m.value[m.good]
    at = np.r_[at[0] - 100.0, at, at[-1] + 100.0]
    value = np.r_[value[0], value, value[-1]]
    level, width = value[:-1] if m.held else 0.5 * (value[1:] + value[:-1]), np.diff(at)
    return Integrals(at, *(np.r_[0.0, np.cumsum(x * width)] for x in (level, np.abs(level) * level)))


def forces(inputs: Sequence[Integrals], edges: FloatArray, speed2: FloatArray) -> list[FloatArray]:
    """Averages of what forces are made of: in proportion, by the square, and by the square of the speed."""
    return [f for i in inputs for c, square in (i.means(edges),) for f in (c, square, c * speed2)]


def manoeuvring(inputs: Sequence[Integrals], fixes: Fixes | None) -> Pose:
    """Sway and yaw through the water, beside inputs and position whose stamps are moved back by their offsets.

    What a current does to the forces of a rudder, by the speed, would else be made up for by an offset.
    """

    def pose(s: Stretch, known: FloatArray) -> Posed:
        to_north, to_east, late, off = known.tolist()
        psi, r = s.columns["psi"], s.columns["r"]
        c, d = np.cos(psi), np.sin(psi)
        along, across = s.columns["u"], s.columns["v"]
        north, east = (np.interp(s.t + off, s.t, x) for x in (along * c - across * d, along * d + across * c))
        north, east = north - to_north, east - to_east
        u, v = north * c + east * d, -north * d + east * c
        speed = middle(u)
        acting = forces(inputs, s.t + late, middle(u * u + v * v))
        one, turn, slower = np.ones(len(speed)), middle(r), speed - speed.mean()
        sideways = np.column_stack([turn, speed * turn, np.abs(turn) * turn, one, *acting])
        rest = None if fixes is None else partial(sway_left, s, fixes, off)
        sway = Driven(v, sideways, np.column_stack([slower, np.abs(turn)]), rest)
        return Posed(sway, Driven(r, np.column_stack([one, *acting]), slower[:, None]), speed)

    return pose


def told(
    states: pd.DataFrame,
    segments: Segments,
    inputs: Sequence[Measurement],
    position: Stream | None,
    sensors: Sequence[Stream] = (),
) -> list[ClockOffset | None]:
    """Offsets of inputs and position that leave least of the responses, with their errors; None where not told.

    Where the samples of ``sensors`` know more beside a whole hull, what they say.
    """
    time = response_time(states)
    parts = stretches(states, segments, time)
    fixes = fixes_of(position, states, segments) if parts and position is not None else None
    responses = manoeuvring([integrals(m) for m in inputs], fixes)
    both = fit(parts, responses, time, LONGEST) if parts else None
    if both is None or COUNTED * len(both[0].error) - both[0].design.shape[1] < SPARE:
        return [None, None]
    found, without, current = both
    pairs = [
        (x, float(np.hypot(max(standard_error(found, k), doubt(found, without[k], k)), MODEL_SHARE * time)))
        for k, x in enumerate(found.offsets.tolist())
    ]
    bounds = tuple((float(s.t[0]), float(s.t[-1])) for s in parts)
    better, clean = by_hull(states, bounds, inputs, sensors, time, pairs, current)
    out: list[ClockOffset | None] = []
    for k, (offset, stderr) in enumerate(better):
        unsure = abs(offset) > 0.9 * LONGEST or not stderr <= WORST
        gain = float("inf") if clean else gained(found, without[k], k)
        out.append(None if unsure else ClockOffset("", "", offset, stderr, gain))
    return out


def by_hull(
    states: pd.DataFrame,
    bounds: Segments,
    inputs: Sequence[Measurement],
    sensors: Sequence[Stream],
    time: float,
    pairs: Sequence[tuple[float, float]],
    current: FloatArray,
) -> tuple[Sequence[tuple[float, float]], bool]:
    """Offsets and standard errors beside a whole hull where it can follow, else as they are; whether it leaves noise.

    The hull has more terms than the responses: what it needs no offset for is none, however sure they are.
    """
    if not {"position", "heading"} <= {s.name for s in sensors}:
        return pairs, False
    step = time / HULL_POINTS
    start = [x if abs(x) < 0.9 * LONGEST and error < WORST else 0.0 for x, error in pairs]
    parts = excerpts(bounds, step * MOST_POINTS, 6.0 * time)
    samples = [seen(s, states.dropna(), parts, step) for s in sensors]
    hull = told_by_hull(states, parts, inputs, samples, time, step, (start[0], start[1]), current)
    return (pairs, False) if hull is None else ([hull.late, hull.off], hull.clean)


def gained(found: Fitted, without: Fitted, which: int) -> float:
    """How many times less is left with the offsets: of the yaw for the inputs', of the sway for the position's."""
    with_, alone = (
        (np.split(f.error, 2)[1 - which] ** 2).sum() * f.units[1 - which] ** 2 for f in (found, without)
    )
    return float(alone / max(with_, 1e-300))


def doubt(found: Fitted, without: Fitted, which: int) -> float:
    """Standard error that an offset has at least where responses without it leave as little, s."""
    free = COUNTED * len(found.error) - found.design.shape[1]
    gain = 0.5 * free * (without.deviance - found.deviance)
    return float(abs(found.offsets[which]) / np.sqrt(max(gain, 1e-12)))


def standard_error(found: Fitted, which: int) -> float:
    """Standard error of an offset: errors of neighbouring windows go together (a sandwich over blocks), s."""
    column = found.design.shape[1] - 2 + which
    others, last = np.delete(found.design, column, axis=1), found.design[:, column]
    apart = last - others @ least_squares(others, last)
    count = len(apart)
    bread = 1.0 / max(float(apart @ apart), 1e-100)
    spread = COUNTED * count / max(COUNTED * count - found.design.shape[1], 1.0)
    sway, yaw = np.split(apart * found.error, 2)
    scores = np.add.reduceat(sway + yaw, np.arange(0, len(sway), max(len(sway) // BLOCKS, 4)))
    robust = bread**2 * float(scores @ scores) * spread
    plain = bread * found.square / (COUNTED * count) * spread
    return float(np.sqrt(max(robust, plain)))


def response_offsets(
    states: pd.DataFrame,
    segments: Segments,
    inputs: Mapping[str, Measurement],
    position: Stream | None = None,
    sensors: Sequence[Stream] = (),
) -> list[ClockOffset]:
    """Offsets of the position's stamps against the heading's, and of the inputs' against the motion's.

    ``sensors`` are position, heading and, where there is one, yaw rate, with their noise: without them the smoothed
    motion alone is looked at.
    Motion that follows the inputs late (a delay or a lag of an actuator) makes the inputs' negative. Where no input
    moves, what turned the vessel, and with it pushed it sideways, is not known: then nothing is told.
    """
    moving = moving_inputs(inputs)
    if not moving:
        return []
    late, off = told(states, segments, moving, position, sensors)
    out = [] if off is None else [replace(off, stream="position", against="heading")]
    return [*out, *([] if late is None else [less_holding(late, moving)])]


def less_holding(found: ClockOffset, moving: Sequence[Measurement]) -> ClockOffset:
    """Take off that a step is logged half an interval late on average, where the inputs are steps.

    A logger that samples at its own times shows a step up to one interval late; one that writes every order at once
    does not. Which it is, no log says: the whole interval goes into the standard error.
    """
    interval = max((m.sample_time for m in moving if m.held), default=0.0)
    stderr = float(np.hypot(found.stderr, interval / np.sqrt(12.0)))
    return replace(
        found, stream="the inputs", against="the motion", offset=found.offset - 0.5 * interval, stderr=stderr
    )
