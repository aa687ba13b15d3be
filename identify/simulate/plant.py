"""The identified vessel as something that can be steered: commands in, track out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from identify.drive import Drive, drive
from identify.predict import run
from identify.regression import factor_values, flow_values
from identify.simulate.helm import Helm
from identify.simulate.rebuild import Rebuilt
from identify.stretch import Samples, Stretch
from identify.term import factors_of
from preprocess.trial import Measurement

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A change of helm or throttle: time s, helm rad (positive to starboard), throttle (1 ahead, -1 astern).
Command = tuple[float, float, float]

#: A run has run away that is more than so many times as fast as its approach, and faster than Froude number 1: a
#: polynomial may stay finite, and sail at the speed of a train.
FASTEST = 3.0
#: Of the earth, m/s².
GRAVITY = 9.81

_NO_SAMPLES = Samples(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 2)), np.zeros(0))


@dataclass(frozen=True)
class Plant:
    """A vessel that can be steered.

    Attributes
    ----------
    rebuilt : Rebuilt
        Structure and parameters.
    helm : Helm
        How it is steered.
    speed : float
        Speed at which every run begins, m/s.
    h : float
        Step, s.
    log : str
        Log whose loading and depth hold.
    helm_rate : float, optional
        Greatest rate of the helm, rad/s.
    """

    rebuilt: Rebuilt
    helm: Helm
    speed: float
    h: float
    log: str = ""
    helm_rate: float | None = None

    def with_parameters(self, p: FloatArray) -> Plant:
        """The same with other parameters."""
        return replace(self, rebuilt=replace(self.rebuilt, p=p))


@dataclass(frozen=True)
class Track:
    """What a vessel did: ``t`` (n,) s from the first order; x, y, psi, u, v, r (n, 6); inputs (n,) as ordered."""

    t: FloatArray
    states: FloatArray
    inputs: dict[str, FloatArray]

    @property
    def finite(self) -> bool:
        """False where the run ran away."""
        return bool(np.isfinite(self.states).all())

    @property
    def path(self) -> FloatArray:
        """Distance (n,) along the track, m."""
        steps = np.hypot(np.diff(self.states[:, 0]), np.diff(self.states[:, 1]))
        return np.concatenate([[0.0], np.cumsum(steps)])


def sail(plant: Plant, commands: Sequence[Command], duration: float) -> Track:
    """Run from a straight course at the approach speed; the first order is given after one step.

    NaN from where it has run away.
    """
    steps = max(4, int(np.ceil(duration / plant.h)) + 1)
    stretch = _stretch(plant, commands, steps)
    structure = plant.rebuilt.structure
    d = drive(structure, plant.rebuilt.p, stretch)
    first = np.zeros(8)
    first[3] = plant.speed
    states = run(structure, d, stretch, first)[:, :6]
    states = _over_ground(_no_faster(plant, states), d)
    t = stretch.grid
    ordered = {
        n: m.value[np.searchsorted(m.t, t + 1e-9, side="right") - 1] for n, m in stretch.inputs.items()
    }
    return Track(t[1:], states[1:] - _origin(states[1]), {n: v[1:] for n, v in ordered.items()})


def _no_faster(plant: Plant, states: FloatArray) -> FloatArray:
    """States (n, 6) through the water, NaN from where they are faster than any vessel of this length is."""
    most = max(FASTEST * plant.speed, math.sqrt(GRAVITY * plant.rebuilt.structure.vessel.length))
    out = states.copy()
    out[np.logical_or.accumulate(np.hypot(*states[:, 3:5].T) > most)] = np.nan
    return out


def _origin(state: FloatArray) -> FloatArray:
    return np.array([state[0], state[1], 0.0, 0.0, 0.0, 0.0])


def _over_ground(states: FloatArray, d: Drive) -> FloatArray:
    out = states.copy()
    c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
    out[:, 3] += d.current[0] * c + d.current[1] * s
    out[:, 4] += -d.current[0] * s + d.current[1] * c
    return out


def _stretch(plant: Plant, commands: Sequence[Command], steps: int) -> Stretch:
    """A stretch that begins one step before the first order, with the commands as steps that hold, or as ramps."""
    t, helm, throttle = corners(commands, plant.helm_rate)
    values = plant.helm.commands(helm, throttle)
    held = plant.helm_rate is None
    inputs = {
        n: Measurement(n, t, v, 0.0, np.ones(len(t), dtype=bool), sample_time=1.0, held=held)
        for n, v in values.items()
    }
    h = plant.h
    nothing = np.zeros((steps, 2))
    states, sigmas = np.zeros((steps + 1, 6)), np.zeros((steps + 1, 3))
    return Stretch(plant.log, "", -h, 0.0, h, steps, inputs, states, sigmas, nothing, _NO_SAMPLES)


def corners(commands: Sequence[Command], rate: float | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, helm and throttle at which the commands change; ramps where the helm has a rate."""
    points: list[Command] = (
        [(-100.0, 0.0, 1.0), *_ramped(commands, rate)] if rate else [(-100.0, 0.0, 1.0), *commands]
    )
    t, helm, throttle = (np.array(c, dtype=float) for c in zip(*points, strict=True))
    return t, helm, throttle


def _ramped(commands: Sequence[Command], rate: float | None) -> list[Command]:
    """Begin and end of every ramp; one that is overtaken by the next order ends where it is."""
    points: list[Command] = []
    helm, throttle = 0.0, 1.0
    for k, (t, wanted, ahead) in enumerate(commands):
        end = commands[k + 1][0] if k + 1 < len(commands) else np.inf
        needed = abs(wanted - helm) / (rate or np.inf)
        points.append((t, helm, throttle))
        share = min(1.0, (end - t - 2e-6) / needed) if needed > 0 else 1.0
        helm, throttle = helm + share * (wanted - helm), ahead
        points.append((t + max(share * needed, 1e-6), helm, throttle))
    return points


def straight_drive(plant: Plant, throttle: float) -> Drive:
    """The drive of a steady straight course."""
    steady = replace(plant, helm_rate=None)
    return drive(plant.rebuilt.structure, plant.rebuilt.p, _stretch(steady, [(-90.0, 0.0, throttle)], 4))


def straight_acceleration(plant: Plant, throttle: float, speeds: FloatArray) -> FloatArray:
    """Surge acceleration (n,) on a straight course at speeds (n,)."""
    structure, d = plant.rebuilt.structure, straight_drive(plant, throttle)
    states = np.zeros((len(speeds), 6))
    states[:, 3] = speeds
    n = len(speeds)
    values = factor_values(states, np.zeros((n, 2)), np.zeros(2), structure.u0)
    values |= {name: np.full(n, d.channels[-1, k]) for k, name in enumerate(structure.table.channels)}
    values |= flow_values(structure, states, values)
    total = np.zeros(n)
    for term, coefficient in zip(structure.table.terms, d.coefficients, strict=True):
        if term.dof == "u":
            total += coefficient * np.prod([values[f] for f in factors_of(term.text)], axis=0)
    return total


def balanced_speed(plant: Plant, highest: float) -> float | None:
    """Speed that thrust ahead holds against resistance: the first at which the balance turns; None without one."""
    grid = np.linspace(1e-3 * highest, highest, 400)
    a = straight_acceleration(plant, 1.0, grid)
    turns = np.nonzero((a[:-1] > 0) & (a[1:] <= 0))[0]
    if len(turns) == 0:
        return None
    low, high = grid[turns[0]], grid[turns[0] + 1]
    return float(brentq(lambda u: straight_acceleration(plant, 1.0, np.array([u]))[0], low, high))


def throttle_for(plant: Plant, speed: float) -> float | None:
    """Factor on the commands that holds a speed; None where no thrust does."""
    at = np.array([speed])
    factors = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 200)])
    a = np.array([straight_acceleration(plant, float(f), at)[0] for f in factors])
    turns = np.nonzero((a[:-1] < 0) & (a[1:] >= 0))[0]
    if len(turns) == 0:
        return None
    k = int(turns[0])
    return float(brentq(lambda f: straight_acceleration(plant, f, at)[0], factors[k], factors[k + 1]))
