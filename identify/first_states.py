"""First states of windows: what the smoothed motion gives, how well they are known beside it, and what follows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import expm

from identify import kernel
from identify.drive import Drive
from identify.stretch import Stretch
from identify.structure import Structure
from identify.true_motion import through_water

if TYPE_CHECKING:
    from identify.windows import Problem

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Weak knowledge of a window's first state beside its own measurements, 1σ: x, y, psi, u, v, r, e1, e2.
STATE_PRIOR = np.array([20.0, 20.0, 1.0, 3.0, 3.0, 1.0, 0.5, 0.5])

#: An effect's own states follow from the smoothed motion, within this share of their root mean square: it is not exact,
#: and what hardly damps remembers what came before a log.
_FOLLOWS = 0.1


def first_states(problem: Problem, current: FloatArray | None = None) -> FloatArray:
    """First state (windows, 8) of every window from the smoothed states, velocities through the water.

    Of an effect's own states it has how far they are from where the smoothed motion has brought them: nothing.
    """
    out = np.zeros((len(problem.windows), kernel.NX))
    for k, w in enumerate(problem.windows):
        state = problem.stretches[w.stretch].states[w.first : w.first + 1]
        out[k, :6] = state[0] if current is None else through_water(state, current)[0]
    return out


def state_precision(structure: Structure) -> FloatArray:
    """Precision (8,) with which a window's first state is known beforehand."""
    sd = STATE_PRIOR.copy()
    if structure.has_following_states:
        sd[6:] = _FOLLOWS
    return np.asarray(1.0 / sd**2, dtype=float)


def following_states(structure: Structure, d: Drive, stretch: Stretch) -> FloatArray:
    """States (steps + 1, 2) of an effect's own oscillator, driven by the smoothed motion; NaN where it runs away."""
    own = {(t.dof, t.text): c for t, c in zip(structure.table.terms, d.coefficients, strict=True)}
    states = swung(own["e2", "e1"], own["e2", "e2"], through_water(stretch.states, d.current), stretch.h)
    return np.where(np.abs(states) < kernel.FAR, states, np.nan)


def swung(stiffness: float, damping: float, motion: FloatArray, h: float) -> FloatArray:
    """States (n, 2) of an oscillator ``ë = stiffness·e + damping·ė + ur`` along a motion (n, 6) through the water.

    It begins where the turn holds it that the log begins in: few logs begin just as a turn does.
    """
    block = np.zeros((3, 3))
    block[:2, :2], block[1, 2] = np.array([[0.0, 1.0], [stiffness, damping]]), 1.0
    force = motion[:, 3] * motion[:, 5]
    more = kernel.oscillator(np.ascontiguousarray(expm(block * h)), 0.5 * (force[1:] + force[:-1]) - force[0])
    return np.asarray(more + np.array([-force[0] / stiffness, 0.0]), dtype=float)


def begun(
    problem: Problem, structure: Structure, drives: Sequence[Drive], first: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """First states (w, 8) with those of an effect's own oscillator about where the smoothed motion has brought them.

    The second (8,) is what a unit of ``first`` is of them: of the oscillator's, their root mean square over the logs.
    """
    unit = np.ones(kernel.NX)
    if not structure.has_following_states:
        return first, unit
    follow = [following_states(structure, d, s) for d, s in zip(drives, problem.stretches, strict=True)]
    unit[6:] = np.sqrt(np.mean(np.vstack(follow) ** 2, axis=0)) + 1e-12
    first = first * unit
    first[:, 6:] += [follow[w.stretch][w.first] for w in problem.windows]
    return first, unit
