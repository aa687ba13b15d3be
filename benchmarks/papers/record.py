"""What a simulated trial gives: time, body velocities, heading and inputs; and a plant of any equations run by it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from identify.estimators.estimate import FloatArray

#: Accelerations of u, v, r from u, v, r, rudder and revolutions.
Plant = Callable[[float, float, float, float, float], tuple[float, float, float]]
#: Rudder and revolutions asked for, from time, heading and the rudder asked for before.
Helm = Callable[[float, float, float], tuple[float, float]]


@dataclass(frozen=True)
class Record:
    """A run: ``t`` (l,) s, ``states`` (l, 3) of u, v, r, ``psi`` (l,), inputs (l,) each by name."""

    t: FloatArray
    states: FloatArray
    psi: FloatArray
    inputs: Mapping[str, FloatArray]

    def noisy(self, sigma: tuple[float, float, float], seed: int) -> Record:
        """The same with white noise on u, v, r, and on the heading as on the yaw rate."""
        random = np.random.default_rng(seed)
        states = self.states + np.array(sigma) * random.standard_normal(self.states.shape)
        return replace(self, states=states, psi=self.psi + sigma[2] * random.standard_normal(len(self.psi)))


def run(
    plant: Plant, helm: Helm, duration: float, *, step: float, speed: float, rates: tuple[float, float],
    within: int = 4, yaw: float = 0.0,
) -> Record:  # fmt: skip
    """Free run by Runge-Kutta, the inputs straight between samples.

    Parameters
    ----------
    plant, helm
        What moves, and who steers; the helm is asked at every sample.
    step, within
        Seconds between samples, and steps of the integration in each.
    speed : float
        At the start, m/s.
    rates : (rudder, revolutions)
        How fast the actuators follow, per second.
    yaw : float
        Yaw rate at the start, rad/s.
    """
    count = round(duration / step) + 1
    rows = np.zeros((count, 6))
    x, psi, h = (speed, 0.0, yaw), 0.0, step / within
    asked, n = helm(0.0, 0.0, 0.0)
    delta = 0.0
    for k in range(count):
        rows[k] = (*x, psi, delta, n)
        asked, wanted = helm(k * step, psi, asked)
        d1 = delta + min(max(asked - delta, -rates[0] * step), rates[0] * step)
        n1 = n + min(max(wanted - n, -rates[1] * step), rates[1] * step)
        for j in range(within):
            ends = [
                (delta + (d1 - delta) * f, n + (n1 - n) * f)
                for f in (j / within, (j + 0.5) / within, (j + 1) / within)
            ]
            x, psi = _advance(plant, x, psi, ends, h)
        delta, n = d1, n1
    return Record(np.arange(count) * step, rows[:, :3], rows[:, 3], {"rudder": rows[:, 4], "n": rows[:, 5]})


def _advance(
    plant: Plant,
    x: tuple[float, float, float],
    psi: float,
    inputs: list[tuple[float, float]],
    h: float,
) -> tuple[tuple[float, float, float], float]:
    """One step of the classical Runge-Kutta method."""
    (u, v, r), (begin, middle, end) = x, inputs
    a = plant(u, v, r, *begin)
    b = plant(u + h / 2 * a[0], v + h / 2 * a[1], r + h / 2 * a[2], *middle)
    c = plant(u + h / 2 * b[0], v + h / 2 * b[1], r + h / 2 * b[2], *middle)
    d = plant(u + h * c[0], v + h * c[1], r + h * c[2], *end)
    moved = tuple(z + h / 6 * (p + 2 * q + 2 * s + w) for z, p, q, s, w in zip(x, a, b, c, d, strict=True))
    return (moved[0], moved[1], moved[2]), psi + h * (r + h / 6 * (a[2] + b[2] + c[2]))


def zigzag(angle_deg: float, switch_deg: float, n: float, begin: float = 0.0) -> Helm:
    """Helm of a zigzag: the rudder goes over whenever the heading has passed the switch on the rudder's side.

    Which side the rudder turns to is found from the first answer of the heading.
    """
    angle, switch = np.radians([angle_deg, switch_deg])
    turns: list[float] = []

    def helm(t: float, psi: float, asked: float) -> tuple[float, float]:
        if t < begin:
            return 0.0, n
        if asked == 0.0:
            return float(angle), n
        if abs(psi) > switch:
            if not turns:
                turns.append(float(np.sign(psi) * np.sign(asked)))
            if np.sign(psi) == turns[0] * np.sign(asked):
                return -asked, n
        return asked, n

    return helm


def steps(times: FloatArray, rudder: FloatArray, n: FloatArray) -> Helm:
    """Helm of orders that hold from each of the times on."""

    def helm(t: float, psi: float, asked: float) -> tuple[float, float]:
        k = int(np.searchsorted(times, t + 1e-9, side="right")) - 1
        return float(rudder[max(k, 0)]), float(n[max(k, 0)])

    return helm
