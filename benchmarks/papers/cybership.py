"""CyberShip II (Skjetne et al. 2004, with their coefficients) and the runs of Zhao and Li 2021.

Units as published: revolutions per second, whatever the paper calls them; positive rudder turns to port.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.papers.library import Sensed
from benchmarks.papers.record import Record, run, steps, zigzag
from identify.estimators.estimate import FloatArray
from preprocess.vessel import Vessel

STEP = 0.1  # s; rows a of the paper's table 2 are the published coefficients at this step
VESSEL = Vessel("CyberShip II", length=1.255, beam=0.29)
RATES = (np.radians(60.0), 50.0)

MASS, INERTIA, X_G = 23.8, 1.76, 0.046
M11, M22, M23, M33 = MASS + 2.0, MASS + 10.0, MASS * X_G, INERTIA + 1.0
DETERMINANT = M22 * M33 - M23**2
X_U, X_UU, X_UUU = -0.72253, -1.32742, -5.86643
SWAY: Mapping[str, float] = {
    "v": -0.88965, "|v|v": -36.47287, "|r|v": -0.805, "r": -7.25, "|v|r": -0.845, "|r|r": -3.45,
}  # fmt: skip
YAW: Mapping[str, float] = {
    "v": 0.03130, "|v|v": 3.95645, "|r|v": 0.13, "r": -1.9, "|v|r": 0.08, "|r|r": -0.75,
}  # fmt: skip
THRUST, THRUST_LOSS = 3.65034e-3, 1.52468e-4
LIFT, LIFT_LOSS, ARM = 6.43306, 5.83594, 0.499


def force_terms() -> dict[str, tuple[float, float]]:
    """Force and moment of every term of sway and yaw: hull, Coriolis (C follows from M), rudders."""
    terms = {k: (SWAY[k], YAW[k]) for k in SWAY}
    terms["ur"] = (-M11, -M23)
    terms["uv"] = (0.0, M11 - M22)
    terms["|u|uδ"] = (2 * LIFT, -2 * ARM * LIFT)
    terms["|u|u|δ|δ"] = (-2 * LIFT_LOSS, 2 * ARM * LIFT_LOSS)
    return terms


def coefficients() -> dict[tuple[str, str], float]:
    """Accelerations per term, by equation and the term's name in the library."""
    found = {
        ("u", "u"): X_U / M11, ("u", "|u|u"): X_UU / M11, ("u", "u³"): X_UUU / M11,
        ("u", "vr"): M22 / M11, ("u", "r²"): M23 / M11,
        ("u", "|n|n"): 2 * THRUST / M11, ("u", "|n|u"): -2 * THRUST_LOSS / M11,
    }  # fmt: skip
    for name, (force, moment) in force_terms().items():
        found["v", name] = (M33 * force - M23 * moment) / DETERMINANT
        found["r", name] = (M22 * moment - M23 * force) / DETERMINANT
    return found


def accelerations(u: float, v: float, r: float, delta: float, n: float) -> tuple[float, float, float]:
    """Rates of u, v, r."""
    av, ar, flow = abs(v), abs(r), abs(u) * u
    x = (X_U + X_UU * abs(u) + X_UUU * u * u) * u + M22 * v * r + M23 * r * r
    x += 2 * (THRUST * abs(n) * n - THRUST_LOSS * abs(n) * u)
    lift = 2 * (LIFT * delta - LIFT_LOSS * abs(delta) * delta) * flow
    y = (SWAY["v"] + SWAY["|v|v"] * av + SWAY["|r|v"] * ar) * v - M11 * u * r + lift
    y += (SWAY["r"] + SWAY["|v|r"] * av + SWAY["|r|r"] * ar) * r
    z = (YAW["v"] + YAW["|v|v"] * av + YAW["|r|v"] * ar) * v - ARM * lift
    z += (YAW["r"] + YAW["|v|r"] * av + YAW["|r|r"] * ar) * r - M23 * u * r + (M11 - M22) * u * v
    return x / M11, (M33 * y - M23 * z) / DETERMINANT, (M22 * z - M23 * y) / DETERMINANT


def sensed(noise: float) -> Sensed:
    """All channels with the same white noise, m/s and rad/s."""
    return Sensed(VESSEL, noise, noise, noise, smoothing=0.5 if noise else 0.0)


def _steps(duration: float, lasting: float, rudders: FloatArray, turns: FloatArray, speed: float) -> Record:
    times = np.arange(0.0, duration, lasting)
    helm = steps(times, rudders[: len(times)], turns[: len(times)])
    return run(accelerations, helm, duration, step=STEP, speed=speed, rates=RATES)


def surge_training(duration: float = 300.0) -> Record:
    """Revolutions that vary at random between 5 and 25 per second (figure 2), steered by compass.

    With the published coefficients the ship does not run straight by itself: a helm keeps it within some degrees.
    """
    random, compass = np.random.default_rng(2), np.random.default_rng(5)
    turns = random.uniform(5.0, 25.0, round(duration / 10.0) + 1)
    before = [0.0]

    def helm(t: float, psi: float, asked: float) -> tuple[float, float]:
        seen = psi + 0.001 * compass.standard_normal()
        rate, before[0] = (seen - before[0]) / STEP, seen
        return float(np.clip(0.5 * seen + 3.0 * rate, -0.6, 0.6)), float(turns[int(t / 10.0 + 1e-9)])

    return run(accelerations, helm, duration, step=STEP, speed=0.2, rates=RATES, yaw=0.02)


def surge_prbs(duration: float = 300.0) -> Record:
    """Revolutions as a binary sequence that reaches beyond 0.9 m/s (figure 4)."""
    random = np.random.default_rng(4)
    count = round(duration / 10.0)
    return _steps(duration, 10.0, np.zeros(count), random.choice([10.0, 33.0], count), 0.36)


def surge_levels() -> Record:
    """5, 10 and 20 per second, each for 100 s (figure 5)."""
    return _steps(300.0, 100.0, np.zeros(3), np.array([5.0, 10.0, 20.0]), 0.05)


def zigzag_training(duration: float = 300.0) -> Record:
    """Zigzag 20/20 at 20 per second (figure 6)."""
    return run(accelerations, zigzag(20.0, 20.0, 20.0), duration, step=STEP, speed=0.67, rates=RATES)


def rudder_prbs(duration: float = 300.0) -> Record:
    """10, 20 and 30 per second with a rudder of random amplitude (figure 8)."""
    random = np.random.default_rng(8)
    count = round(duration / 5.0)
    rudders = np.radians(random.choice([5.0, 10.0, 15.0, 20.0], count)) * np.tile([1.0, -1.0], count)[:count]
    return _steps(duration, 5.0, rudders, np.repeat([10.0, 20.0, 30.0], count // 3), 0.36)


def rudder_levels() -> Record:
    """10, 20 and 30 per second with the rudder at 5, -15 and 25 degrees, each for 100 s (figure 9)."""
    return _steps(300.0, 100.0, np.radians([5.0, -15.0, 25.0]), np.array([10.0, 20.0, 30.0]), 0.36)
