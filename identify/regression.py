"""The regression form of a structure: regressors and targets from smoothed states."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from identify.drive import Drive, drive
from identify.flow import CHANNELS, RESULTS
from identify.flow_behind import flow_along
from identify.nondimensional import unit_size
from identify.slopes import accelerations, true_accelerations
from identify.slot import Slot
from identify.stretch import Stretch
from identify.structure import Structure
from identify.term import FACTORS, Term, factors_of, unit_of
from identify.true_motion import through_water, true_states

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Order of the largest coefficients per unit inertia in the prime system: a hull's radius of gyration is L/4.
INERTIA = {"u": 1.0, "v": 1.0, "r": 16.0}
#: A motion is hardly held where its coefficients would be of so many times that size.
ABSURD = 10.0
#: Factors of a hydrodynamic term.
_MOTION = frozenset(("u", "v", "r", "|u|", "|v|", "|r|", "U", "Δu", "/U"))


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


class Motionwise(NamedTuple):
    """What motion and air make of every term: products (n, terms) of its factors that are no inputs'.

    ``water`` (n, 6) is the motion through the water at the middle of each step.
    """

    water: FloatArray
    products: FloatArray


def regressors_along(structure: Structure, d: Drive, acting: FloatArray, states: FloatArray) -> FloatArray:
    """The same along the motion ``states`` (n + 1, 6) over ground, by what acts (n, nc)."""
    moving = motionwise(structure, d, states)
    out = moving.products.copy()
    out[:, [k for k, _ in structure.table.answering]] = answers(structure, moving, acting)
    return out * d.factor


def motionwise(structure: Structure, d: Drive, states: FloatArray) -> Motionwise:
    """What is the same of the terms along a motion ``states`` (n + 1, 6) over ground whatever the inputs do."""
    water = through_water(0.5 * (states[1:] + states[:-1]), d.current)
    values, answering = factor_values(water, d.wind, d.current, d.u0), dict(structure.table.answering)
    out = np.ones((len(water), len(structure.table.terms)))
    for k, term in enumerate(structure.table.terms):
        for factor in factors_of(term.text):
            if factor not in answering.get(k, ()):
                out[:, k] *= values[factor]
    return Motionwise(water, out)


def answers(structure: Structure, moving: Motionwise, acting: FloatArray) -> FloatArray:
    """Regressors (n, k) of the terms that answer to an input (``Table.answering``), by what acts (n, nc)."""
    values = {name: acting[:, k] for k, name in enumerate(structure.table.channels)}
    values |= flow_values(structure, moving.water, values)
    out = np.empty((len(acting), len(structure.table.answering)))
    for j, (k, names) in enumerate(structure.table.answering):
        out[:, j] = reduce(np.multiply, [values[f] for f in names], moving.products[:, k])
    return out


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
