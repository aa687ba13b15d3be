# ruff: noqa: ANN001, ANN202
"""What clock offsets could be known to at best: the Cramér-Rao bound of the truth's own equations.

All coefficients of the hull and all gains are free beside the offsets and the first state; once only those that the
vessel has, once every one that the truth simulator knows of (the structure unknown). The sensors are those of the
bench: position at 5 Hz with 0.02 m, heading at 10 Hz with 0.01 rad, yaw rate at 20 Hz with 0.003 rad/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from fixtures.dynamics import STEP
from fixtures.forces import HullNumbers, WorldNumbers, derivative
from fixtures.simulator import Truth
from fixtures.vessels import actuator_table

#: Rate (Hz) and white noise of the sensors.
SENSORS = {"position": (5.0, 0.02), "heading": (10.0, 0.01), "yaw_rate": (20.0, 0.003)}
#: Coefficients that are never free: inertias (only ratios show), and switches.
FIXED = ("m11", "m22", "m23", "m33", "service_speed", "full_coriolis", "rudder_law")
#: Size of a coefficient that the vessel does not have, relative to the inertia of its equation.
UNIT = 0.05


@dataclass(frozen=True)
class Bound:
    """Least standard deviation of an offset, s, by stream."""

    position: float
    yaw_rate: float
    inputs: float


@njit(cache=True)
def _sail(h, w, state, table, azimuth_of, actual, factor):
    n = actual.shape[0]
    out, s, none = np.zeros((n, 11)), state.copy(), np.zeros(3)
    k1, k2, k3, k4 = np.zeros(11), np.zeros(11), np.zeros(11), np.zeros(11)
    for k in range(n):
        out[k] = s
        a, t = actual[k], k * STEP
        derivative(h, w, t, s, table, azimuth_of, a, factor, none, none, none, k1)
        derivative(h, w, t, s + STEP / 2 * k1, table, azimuth_of, a, factor, none, none, none, k2)
        derivative(h, w, t, s + STEP / 2 * k2, table, azimuth_of, a, factor, none, none, none, k3)
        derivative(h, w, t, s + STEP * k3, table, azimuth_of, a, factor, none, none, none, k4)
        s = s + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return out


def _states(truth: Truth, h, gains, state):
    table, azimuth_of = actuator_table(truth.vessel)
    table[:, 1] *= gains
    actual = np.ascontiguousarray(truth.inputs, float)
    return _sail(h, WorldNumbers(), state, table, azimuth_of, actual, np.ones(len(table)))[:, :6]


def _seen(states, end: float):
    """What the sensors show of states, each over its noise: (k,) of all sensors in turn."""
    t, out = np.arange(len(states)) * STEP, []
    for name, columns in (("position", (0, 1)), ("heading", (2,)), ("yaw_rate", (5,))):
        rate, sigma = SENSORS[name]
        at = np.arange(0.5, end - 0.5, 1.0 / rate)
        out += [np.interp(at, t, states[:, c]) / sigma for c in columns]
    return np.concatenate(out)


def bound(truth: Truth, every: bool) -> Bound:
    """Least standard deviations of the offsets of position, yaw rate and inputs in one log.

    Parameters
    ----------
    truth : Truth
    every : bool
        Coefficients that the vessel does not have are free too.
    """
    h, end = truth.vessel.hull, float(truth.t[-1])
    state = np.zeros(11)
    state[:6] = [getattr(truth, k)[0] for k in ("x", "y", "psi", "u_w", "v_w", "r")]
    gains = np.ones(len(truth.vessel.actuators))
    columns = [*_of_coefficients(truth, h, gains, state, every), *_of_gains(truth, h, gains, state)]
    for k in range(6):
        ahead, behind = state.copy(), state.copy()
        ahead[k] += 1e-4
        behind[k] -= 1e-4
        columns.append(_difference(truth, (h, gains, ahead), (h, gains, behind), 2e-4))
    nominal = _states(truth, h, gains, state)
    columns += _of_offsets(nominal, end)
    jacobian = np.column_stack(columns)
    scale = np.linalg.norm(jacobian, axis=0)
    use = scale > 1e-9
    _, singular, vt = np.linalg.svd(jacobian[:, use] / scale[use], full_matrices=False)
    variance = ((vt / singular[:, None]) ** 2).sum(axis=0)
    position, yaw_rate, inputs = (np.sqrt(variance) / scale[use])[-3:]
    return Bound(float(position), float(yaw_rate), float(inputs))


def _difference(truth, ahead, behind, width):
    end = float(truth.t[-1])
    return (_seen(_states(truth, *ahead), end) - _seen(_states(truth, *behind), end)) / width


def _of_coefficients(truth, h: HullNumbers, gains, state, every: bool):
    for name in h._fields:
        value = getattr(h, name)
        if name in FIXED or not (value or every):
            continue
        inertia = {"X": h.m11, "Y": h.m22, "N": h.m33}[name[0]]
        step = 1e-3 * (abs(value) or UNIT * inertia)
        ahead, behind = (h._replace(**{name: value + x}) for x in (step, -step))
        yield _difference(truth, (ahead, gains, state), (behind, gains, state), 2.0 * step)


def _of_gains(truth, h, gains, state):
    for k, actuator in enumerate(truth.vessel.actuators):
        if actuator.gain:
            ahead, behind = gains.copy(), gains.copy()
            ahead[k] += 1e-3
            behind[k] -= 1e-3
            yield _difference(truth, (h, ahead, state), (h, behind, state), 2e-3)


def _of_offsets(states, end: float):
    """Sensitivities to the offsets of position, yaw rate, and inputs (all sensors the other way), per second."""
    t = np.arange(len(states)) * STEP
    rate = np.gradient(states, t, axis=0)
    only = {"position": (0, 1), "yaw_rate": (5,), "inputs": (0, 1, 2, 5)}
    for columns in only.values():
        moved = np.zeros_like(states)
        moved[:, columns] = rate[:, columns]
        yield _seen(moved, end)
