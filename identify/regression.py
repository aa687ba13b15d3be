"""The regression form of a structure: regressors and targets from smoothed states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce

import numpy as np
from scipy.ndimage import convolve1d
from scipy.optimize import lsq_linear

from identify.drive import Drive, drive
from identify.flow import CHANNELS, RESULTS
from identify.flow_behind import flow_along
from identify.nondimensional import unit_size
from identify.slot import Slot
from identify.steady import current_of, sensor_of
from identify.stretch import Stretch, slopes_of
from identify.structure import Structure
from identify.term import FACTORS, Term, factors_of, unit_of
from identify.true_motion import true_states

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Order of the largest coefficients per unit inertia in the prime system: a hull's radius of gyration is L/4.
INERTIA = {"u": 1.0, "v": 1.0, "r": 16.0}
#: A motion is hardly held where its coefficients would be of so many times that size.
ABSURD = 10.0
#: Factors of a hydrodynamic term.
_MOTION = frozenset(("u", "v", "r", "|u|", "|v|", "|r|", "U", "Δu", "/U"))
#: Steps either way over which an acceleration is the slope.
SLOPE_STEPS = 5


def through_water(states: FloatArray, current: FloatArray) -> FloatArray:
    """States (n, 6) over ground to states with u, v through the water."""
    out = states.copy()
    c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
    out[:, 3] -= current[0] * c + current[1] * s
    out[:, 4] -= -current[0] * s + current[1] * c
    return out


def over_ground(states: FloatArray, current: FloatArray) -> FloatArray:
    """States with u, v through the water to states (n, 6) over ground."""
    return through_water(states, -current)


def factor_values(
    states: FloatArray, wind: FloatArray, current: FloatArray, u0: float
) -> dict[str, FloatArray]:
    """Value (n,) of every factor of the library along states (n, 6) through the water."""
    psi, u, v, r = states[:, 2], states[:, 3], states[:, 4], states[:, 5]
    speed = np.hypot(u, v)
    c, s = np.cos(psi), np.sin(psi)
    wn, we = wind[:, 0] - current[0], wind[:, 1] - current[1]
    wx, wy = wn * c + we * s - u, -wn * s + we * c - v
    air = np.hypot(wx, wy)
    zero = np.zeros_like(u)
    values = (
        np.ones_like(u), u, v, r, np.abs(u), np.abs(v), np.abs(r), speed, u - u0, 1.0 / np.maximum(speed, 1e-3),
        zero, zero, air * wx, air * wy, zero, zero, zero,
    )  # fmt: skip
    return dict(zip(FACTORS, values, strict=True))


def flow_values(
    structure: Structure, states: FloatArray, channels: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Thrust and rudder force by the flow behind the hull along states (n, 6), where they are used."""
    constants = structure.table.flow
    if not len(constants):
        return {}
    found = flow_along(states, np.column_stack([channels[c] for c in CHANNELS]), constants)
    return dict(zip(RESULTS, found.T, strict=True))


def regressors(
    structure: Structure,
    p: FloatArray,
    stretch: Stretch,
    seen: Callable[[FloatArray], FloatArray] | None = None,
) -> FloatArray:
    """Regressor (n, terms) of every term at the middle of each step of a stretch; its inputs as ``seen`` has them.

    What a log's load makes of a coefficient is in its regressor. The motion is the one behind what the sensors show.
    """
    d = drive(structure, p, stretch)
    acting = d.channels if seen is None else seen(d.channels)
    return regressors_along(structure, d, acting, true_states(structure, d.sensor, stretch))


def regressors_along(structure: Structure, d: Drive, acting: FloatArray, states: FloatArray) -> FloatArray:
    """The same along the motion ``states`` (n + 1, 6) over ground, by what acts (n, nc)."""
    middle_water = through_water(0.5 * (states[1:] + states[:-1]), d.current)
    values = factor_values(middle_water, d.wind, d.current, d.u0)
    values |= {name: acting[:, k] for k, name in enumerate(structure.table.channels)}
    values |= flow_values(structure, middle_water, values)
    out = np.empty((len(middle_water), len(structure.table.terms)))
    for k, term in enumerate(structure.table.terms):
        out[:, k] = reduce(np.multiply, [values[f] for f in factors_of(term.text)])
    return out * d.factor


def accelerations(
    stretch: Stretch,
    window: int = SLOPE_STEPS,
    states: FloatArray | None = None,
    current: FloatArray | None = None,
) -> FloatArray:
    """Rates (n, 3) of u, v, r at the middle of each step, over ``window`` steps either way (a least-squares slope).

    They are those of the smoothed states, or of ``states`` (n + 1, 6) in their place. Where a ``current`` (2,) flows
    they are those through the water, as the forces on the hull make them: over ground a vessel that turns in a current
    changes its velocity along its own axes without any force.
    """
    seen = stretch.states if states is None else states
    if current is not None and current.any():
        return slopes_of(through_water(seen, current), stretch.h, window)
    return stretch.slopes(window) if seen is stretch.states else slopes_of(seen, stretch.h, window)


def steps_of_slope(stretch: Stretch) -> int:
    """Steps either way over which an acceleration is the slope."""
    return max(1, min(SLOPE_STEPS, stretch.steps // 8))


def true_accelerations(
    structure: Structure, p: FloatArray, stretch: Stretch, window: int = SLOPE_STEPS
) -> FloatArray:
    """Rates (n, 3) of u, v, r through the water of the motion behind what the sensors show."""
    states = true_states(structure, sensor_of(structure, p), stretch)
    return accelerations(stretch, window, states, current_of(structure, p))


def averaged(rates: FloatArray, m: int) -> FloatArray:
    """Rates (n, k) of each step as ``accelerations`` over ``m`` steps either way see them: nothing beyond the ends.

    A slope by least squares is an average of the rates in between; without the same average on the other side of the
    equation, whatever is quick would seem weaker than it is.
    """
    return np.asarray(convolve1d(rates, slope_weights(m), axis=0, mode="constant"), dtype=float)


def slope_weights(m: int) -> FloatArray:
    """Weights (2 m + 1,) of the rates at the middles of steps in the mean of two neighbouring slopes over ± m steps."""
    k = np.arange(-m, m + 1)
    one = np.cumsum(k[::-1])[:-1] / np.sum(k * k)  # of the 2 m steps under one slope
    return np.asarray(0.5 * (np.append(one, 0.0) + np.append(0.0, one)), dtype=float)


def coefficient_scales(structure: Structure, p: FloatArray, stretches: Sequence[Stretch]) -> FloatArray:
    """Natural size of each coefficient, (terms,): rms acceleration of its equation over rms of its regressor.

    A motion that the logs hardly hold says nothing of its coefficients' size: a hydrodynamic one is then of the order
    of one in the prime system, as the hull's inertia makes it (``INERTIA``).
    """
    square, target, speed, n = np.zeros(len(structure.table.terms)), np.zeros(3), 0.0, 0
    for stretch in stretches:
        square += np.sum(regressors(structure, p, stretch) ** 2, axis=0)
        target += np.sum(accelerations(stretch) ** 2, axis=0)
        speed += float(np.sum(stretch.states[:, 3:5] ** 2))
        n += stretch.steps
    rms = np.sqrt(np.append(target, [n, n]) / max(n, 1))
    natural = rms[structure.table.equation_of] / np.sqrt(square / max(n, 1) + 1e-24)
    prime = prime_sizes(structure, float(np.sqrt(speed / max(n, 1))))
    return np.where(natural > ABSURD * prime, prime, natural)


def prime_sizes(structure: Structure, speed: float) -> FloatArray:
    """Order of the largest coefficients, (terms,), at a speed, m/s; inf of what is no answer of the hull alone."""
    sizes = [
        INERTIA[t.dof] * unit_size(unit_of(t.text, t.dof), structure.vessel.length, max(speed, 1e-3))
        if hydrodynamic(t)
        else np.inf
        for t in structure.table.terms
    ]
    return np.array(sizes, dtype=float)


def start_by_regression(
    structure: Structure,
    p: FloatArray,
    stretches: Sequence[Stretch],
    ridge: float = 1e-4,
    apart: bool = False,
) -> FloatArray:
    """Coefficients by ridge regression of the smoothed accelerations, effects held at the values in ``p``.

    With ``apart`` the axes answer to their own motion alone (``couples``). A vessel drifts as it turns, so that sway
    and yaw rate look alike: a regression of noisy motion may have each damped by the other, and a search that begins
    there stays there. What is quick is not ``averaged`` as the slopes are: it seems weaker than it is, and a model that
    is begun too weak runs away less.
    """
    design = np.vstack([regressors(structure, p, s) for s in stretches])
    target = np.vstack([true_accelerations(structure, p, s) for s in stretches])
    if apart:
        design[:, [k for k, term in enumerate(structure.table.terms) if couples(term)]] = 0.0
    return answering_twice(structure, solve_regression(structure, p, design, target, ridge))


#: A model with two times begins with a second of this share of their sum: begun with none, its zero may stay on the
#: pole that it lacks, and no small step parts them.
SECOND = 0.15
#: The coefficients of such a model: of yaw rate and rudder, in its own equation and in that of the state behind.
_TWICE = (("r", "r"), ("r", "δ"), ("e1", "r"), ("e1", "δ"))


def answering_twice(structure: Structure, p: FloatArray) -> FloatArray:
    """Parameters (np,) that answer a rudder as ``p`` does, of a second-order Nomoto model by both of its times."""
    at = {(s.term.dof, s.term.text): k for k, s in enumerate(structure.slots) if s.effect < 0 and s.term}
    if not all(key in at for key in _TWICE):
        return p
    yaw, rudder, yaw_behind, rudder_behind = (at[key] for key in _TWICE)
    if p[yaw] >= 0.0 or p[yaw_behind] != 0.0:
        return p
    whole, gain = -1.0 / p[yaw], -p[rudder] / p[yaw]
    first, second = (1.0 - SECOND) * whole, SECOND * whole
    out = p.copy()
    out[yaw], out[rudder] = -1.0 / first - 1.0 / second, 0.0
    out[yaw_behind], out[rudder_behind] = -1.0 / (first * second), gain / (first * second)
    return out


#: Motion that is another axis's, by equation; a turn with headway is the centripetal part of the sway itself.
_OTHERS = {"u": {"v", "|v|", "r", "|r|"}, "v": {"r", "|r|"}, "r": {"v", "|v|"}}


def hydrodynamic(term: Term) -> bool:
    """Whether a term is the hull's own answer to its motion alone."""
    return term.dof in INERTIA and set(factors_of(term.text)) <= _MOTION


def couples(term: Term) -> bool:
    """Whether a term is what the motion along another axis does to its own."""
    factors = set(factors_of(term.text))
    turning_with_headway = term.dof == "v" and "u" in factors
    return bool(factors & _OTHERS.get(term.dof, set())) and not turning_with_headway


def solve_regression(
    structure: Structure, p: FloatArray, design: FloatArray, target: FloatArray, ridge: float = 1e-4
) -> FloatArray:
    """Parameters with the coefficients that fit ``target`` (n, 3) by ``design`` (n, terms), within their bounds."""
    out = p.copy()
    for equation, (mine, columns) in enumerate(structure.layout.by_equation):
        if len(mine):
            bounds = [_for_a_start(structure.slots[k]) for k in mine]
            out[mine] = _bounded_ridge(design[:, columns], target[:, equation], bounds, ridge)
    return out


#: Own damping of each equation: a search must not begin with a vessel that drives itself.
_DAMPING = {
    "u": ("u", "u|u|", "|u|u", "u³", "Δu"),
    "v": ("v", "v|v|", "|v|v"),
    "r": ("r", "r|r|", "|r|r", "r³"),
}


def _for_a_start(slot: Slot) -> tuple[float, float]:
    """Bounds of a coefficient in a regression that a search begins from."""
    low, high = slot.parameter.bounds
    damping = slot.term is not None and slot.term.text in _DAMPING.get(slot.term.dof, ())
    return (low, min(high, 0.0)) if damping else (low, high)


def predicted(structure: Structure, p: FloatArray, design: FloatArray) -> FloatArray:
    """Accelerations (n, 3) from the regressors (n, terms)."""
    out = np.zeros((len(design), 3))
    for equation, (mine, columns) in enumerate(structure.layout.by_equation):
        out[:, equation] = design[:, columns] @ p[mine]
    return out


def _bounded_ridge(
    design: FloatArray, target: FloatArray, bounds: list[tuple[float, float]], ridge: float
) -> FloatArray:
    """Ridge on scaled columns, within bounds: the least there is, not what is left when offenders are dropped."""
    scale = np.sqrt(np.mean(design**2, axis=0)) + 1e-12
    x = design / scale
    gram = x.T @ x + ridge * len(x) * np.eye(x.shape[1])
    moment = x.T @ target
    theta = np.linalg.solve(gram, moment)
    low, high = np.transpose(bounds) * scale
    if ((theta < low) | (theta > high)).any():
        root = np.linalg.cholesky(gram)
        theta = lsq_linear(root.T, np.linalg.solve(root, moment), (low, high), method="bvls").x
    return np.asarray(theta / scale, dtype=float)
