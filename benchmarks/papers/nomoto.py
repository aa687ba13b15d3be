"""The cargo and the patrol vessel of Zhu et al. 2022 (table 3) on the second-order Nomoto model, steered by compass.

Corrected as they must be: the gear follows its order (eq. 3 as printed runs away), eq. 4 and 6 with a1 and a2 in their
places, T1 the larger root, and for the patrol vessel, whose K is negative, a negative gain of the helm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from identify.estimators.estimate import FloatArray

STEP = 0.02  # s
GAINS = (180.0, 12150.0, 100.0, 364500.0, 4100625.0)  # l1..l5 of table 3: (s + 45)^4, l3 free


@dataclass(frozen=True)
class Ship:
    """T1, T2, T3 in s, K in 1/s; time constant of the gear, gain of the helm; periods of the orders, s."""

    name: str
    T1: float
    T2: float
    T3: float
    K: float
    gear: float
    helm: float
    duration: float
    periods: tuple[float, ...]
    length: float

    @property
    def theta(self) -> FloatArray:
        """Coefficients of eq. 29: of ψ'', ψ', δ', δ."""
        product = self.T1 * self.T2
        return np.array(
            [-1 / self.T1 - 1 / self.T2, -1 / product, self.T3 * self.K / product, self.K / product]
        )


CARGO = Ship("cargo", 45.0, 6.0, 10.0, 0.09, 5.0, 0.12, 6000.0, (600.0, 150.0, 40.0), 140.0)
PATROL = Ship("patrol", 2.0875, 0.3179, 0.1830, -0.1724, 1.0, -0.7, 900.0, (60.0, 12.0, 3.0), 5.0)
SHIPS = (CARGO, PATROL)
AMPLITUDE = np.radians(10.0)


@dataclass(frozen=True)
class Voyage:
    """Every state at every sample: time, order of heading, heading and its three rates, rudder and its rate, (l,)."""

    t: FloatArray
    order: FloatArray
    psi: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    delta: FloatArray
    delta_rate: FloatArray

    def part(self, begin: float, end: float) -> Voyage:
        """The samples between two shares of the time."""
        keep = slice(round(begin * len(self.t)), round(end * len(self.t)))
        return Voyage(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))


@njit(cache=True)
def recur(a, b0, b1, u, x):  # noqa: ANN001, ANN201
    """States (l, n) of x(k + 1) = a x(k) + b0 u(k) + b1 u(k + 1)."""
    out = np.empty((len(u), len(x)))
    for i in range(len(u)):
        out[i] = x
        if i + 1 < len(u):
            x = a @ x + b0 @ u[i] + b1 @ u[i + 1]
    return out


def recursion(a: FloatArray, b: FloatArray, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Matrices of `recur` that x' = a x + b u gives, exactly, for inputs that are straight between samples."""
    n, m = b.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m] = a, b
    block[n : n + m, n + m :] = np.eye(m) / step
    whole = expm(block * step)
    ramp = whole[:n, n + m :]
    return whole[:n, :n], whole[:n, n : n + m] - ramp, ramp


def linear(a: FloatArray, b: FloatArray, inputs: FloatArray, step: float, first: FloatArray) -> FloatArray:
    """States (l, n) of x' = a x + b u for inputs (l, m) that are straight between samples."""
    return advance(*recursion(a, b, step), inputs, first)


def advance(
    a: FloatArray, begin: FloatArray, end: FloatArray, inputs: FloatArray, first: FloatArray
) -> FloatArray:
    """States (l, n) of a discrete system whose inputs (l, m) act at both ends of a step."""
    parts = (np.ascontiguousarray(x, dtype=float) for x in (a, begin, end, inputs, first))
    return np.asarray(recur(*parts))


def orders(ship: Ship, t: FloatArray, *, single: bool) -> FloatArray:
    """Headings asked for: one sine as in the paper, or three."""
    periods = ship.periods[1:2] if single else ship.periods
    return np.asarray(sum(AMPLITUDE * np.sin(2 * np.pi * t / p) for p in periods), dtype=float)


def plant(ship: Ship) -> tuple[FloatArray, FloatArray]:
    """Matrices of ψ, ψ', ψ'', δ with the order of heading as the input (eq. 6, corrected)."""
    c = ship.theta
    a = np.zeros((4, 4))
    a[0, 1] = a[1, 2] = 1.0
    a[3, 0], a[3, 3] = -ship.helm / ship.gear, -1.0 / ship.gear
    a[2] = [c[2] * a[3, 0], c[1], c[0], c[3] + c[2] * a[3, 3]]
    b = np.array([[0.0], [0.0], [c[2] * ship.helm / ship.gear], [ship.helm / ship.gear]])
    return a, b


def voyage(ship: Ship, *, single: bool = False, duration: float | None = None) -> Voyage:
    """From rest."""
    t = np.arange(round((duration or ship.duration) / STEP)) * STEP
    asked = orders(ship, t, single=single)
    psi, rate, acceleration, delta = linear(*plant(ship), asked[:, None], STEP, np.zeros(4)).T
    delta_rate = (ship.helm * (asked - psi) - delta) / ship.gear
    jerk = np.column_stack([acceleration, rate, delta_rate, delta]) @ ship.theta
    return Voyage(t, asked, psi, rate, acceleration, jerk, delta, delta_rate)


def observer_as_printed(ship: Ship, t: FloatArray, psi: FloatArray, order: FloatArray) -> FloatArray:
    """Eq. 8: columns z1..z5 (ψ, ψ', δ, ψ'', what is left of ψ''' - order)."""
    l1, l2, l3, l4, l5 = GAINS
    gear = ship.helm / ship.gear
    a = np.array([
        [-l1, 1, 0, 0, 0], [-l2, 0, 0, 1, 0], [-gear - l3, 0, -1 / ship.gear, 0, 0], [-l4, 0, 0, 0, 1],
        [-l5, 0, 0, 0, 0],
    ])  # fmt: skip
    b = np.array([[l1, 0], [l2, 0], [l3, gear], [l4, 1], [l5, 0]], dtype=float)
    first = np.array([psi[0], 0.0, 0.0, 0.0, 0.0])
    step = float(t[1] - t[0])
    return _sampled(a, b, np.column_stack([psi, order]), step, first, GAINS[0] / 4)


def _sampled(
    a: FloatArray, b: FloatArray, inputs: FloatArray, step: float, first: FloatArray, fastest: float
) -> FloatArray:
    """As `linear`, the signals smooth between samples instead of straight where the poles are quick."""
    parts = int(np.ceil(fastest * step / 0.1))
    if parts == 1:
        return linear(a, b, inputs, step, first)
    places = np.arange((len(inputs) - 1) * parts + 1) / parts
    fine = CubicSpline(np.arange(len(inputs)), inputs)(places)
    return linear(a, b, fine, step / parts, first)[::parts]


def low_passed(signal: FloatArray, bandwidth: float, step: float) -> FloatArray:
    """The signal through (ω / (s + ω))⁴ and its first three derivatives, (l, 4)."""
    a = np.diag(np.ones(3), 1)
    a[3] = [-(bandwidth**4), -4 * bandwidth**3, -6 * bandwidth**2, -4 * bandwidth]
    b = np.array([[0.0], [0.0], [0.0], [bandwidth**4]])
    return _sampled(a, b, signal[:, None], step, np.array([signal[0], 0.0, 0.0, 0.0]), bandwidth)


def constants_of(theta: FloatArray) -> FloatArray:
    """T1 >= T2, T3 and K from the coefficients of eq. 29 (eq. 31 with its roots in order), NaN where complex."""
    product = -1.0 / theta[1]
    with np.errstate(invalid="ignore"):
        total = -theta[0] * product
        root = np.sqrt(total**2 - 4 * product)
        return np.array([(total + root) / 2, (total - root) / 2, theta[2] / theta[3], -theta[3] / theta[1]])
