"""Two model ships steered by turning their thrust, Delfia-like and Tito-Neri-like.

Their sizes are those of Xie et al. 2020, table 1; the paper gives no forces, so that added masses, resistance and
thrust are plausible numbers of ours, in the form of Fossen 2011, sec. 7.3: the equations of neither are the polynomial
that is identified. The angle of the thrust is δ, positive turns to starboard.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.papers.kvlcc2 import Run
from benchmarks.papers.record import Helm, Record, run, zigzag
from identify.estimators.estimate import FloatArray


@dataclass(frozen=True)
class Azimuths:
    """Inertias with added masses (kg, kg m²), damping (N, N m per unit), thrust (N) and its arm aft of midships (m)."""

    length: float
    speed: float
    m11: float
    m22: float
    m33: float
    x_u: float
    x_uu: float
    y_v: float
    y_vv: float
    y_r: float
    n_r: float
    n_rr: float
    n_v: float
    arm: float
    aside: float
    rate: float

    @property
    def thrust(self) -> float:
        """What holds the speed on a straight course, N."""
        return (self.x_u + self.x_uu * self.speed) * self.speed

    def accelerations(
        self, u: float, v: float, r: float, delta: float, n: float
    ) -> tuple[float, float, float]:
        """Fossen 2011, eq. 6.31 with linear and quadratic damping."""
        ahead, across = self.thrust * n * math.cos(delta), self.thrust * n * math.sin(delta)
        x = ahead - (self.x_u + self.x_uu * abs(u)) * u + self.m22 * v * r
        y = -self.aside * across - (self.y_v + self.y_vv * abs(v)) * v - self.y_r * r - self.m11 * u * r
        z = (
            self.arm * across
            - (self.n_r + self.n_rr * abs(r)) * r
            - self.n_v * v
            + (self.m11 - self.m22) * u * v
        )
        return x / self.m11, y / self.m22, z / self.m33

    def run(self, helm: Helm, duration: float, step: float = 0.1) -> Record:
        """Free run from a steady straight course."""
        return run(self.accelerations, helm, duration, step=step, speed=self.speed, rates=(self.rate, 1.0))

    def zigzag(self, angle_deg: float, duration: float) -> Record:
        """Zigzag angle/angle."""
        return self.run(zigzag(angle_deg, angle_deg, 1.0), duration)


#: The fore azimuth turns against the aft one: a moment of both, no side force.
DELFIA = Azimuths(
    length=0.38, speed=0.3, m11=3.8, m22=5.2, m33=0.055, x_u=0.4, x_uu=3.0, y_v=2.5, y_vv=18.0, y_r=0.05,
    n_r=0.045, n_rr=0.06, n_v=0.05, arm=0.14, aside=0.0, rate=math.radians(120.0),
)  # fmt: skip
#: Both azimuths aft.
TITO_NERI = Azimuths(
    length=0.97, speed=0.65, m11=18.1, m22=40.0, m33=1.25, x_u=1.0, x_uu=3.2, y_v=18.0, y_vv=45.0, y_r=0.4,
    n_r=2.2, n_rr=0.9, n_v=0.15, arm=0.42, aside=1.0, rate=math.radians(60.0),
)  # fmt: skip


def as_run(record: Record) -> Run:
    """The record as the tables of this paper take it."""
    u, v, r = record.states.T
    return Run(record.t, u, v, r, record.psi, record.inputs["rudder"])


def random_steering(ship: Azimuths, duration: float, seed: int) -> Record:
    """Angles drawn anew every 4 to 10 s, up to 30 degrees, as by hand."""
    random = np.random.default_rng(seed)
    times: FloatArray = np.cumsum(random.uniform(4.0, 10.0, 200))
    angles = np.radians(random.uniform(-30.0, 30.0, 201))

    def helm(t: float, psi: float, asked: float) -> tuple[float, float]:
        return float(angles[np.searchsorted(times, t)]), 1.0

    return ship.run(helm, duration)
