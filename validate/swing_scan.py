"""Effects that swing by themselves, looked at through the accelerations: at every frequency, and for each damping.

The prediction error has a valley for every swing of a window, and the way to the right one is bent. Along the motion
that the sensors show the swing is known at once for each frequency and damping, and what it pushes with is linear in
the accelerations beside every coefficient.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.drive import drives
from identify.effect import Active
from identify.first_states import swung
from identify.regression import solve_regression
from identify.slopes import averaged
from identify.stretch import Stretch
from identify.structure import Structure
from identify.true_motion import through_water
from validate.motion_seen import FINE, Motion, Seen, Wanted

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: So many frequencies between the bounds, and shares of critical damping that are looked at.
FREQUENCIES, DAMPINGS = 32, (0.05, 0.15, 0.45)
#: So many of the valleys are begun in.
VALLEYS = 3
_EQUATIONS = {"u": 0, "v": 1, "r": 2}
_STATES = {"e1": 0, "e2": 1}


def swings(structure: Structure, index: int = -1) -> bool:
    """Whether an effect swings by itself."""
    which = range(len(structure.actives))[index] if structure.actives else -1
    return any(s.parameter.shape for s in structure.slots if s.effect == which)


def wanted_swings(
    structure: Structure, stretches: Sequence[Stretch], p: FloatArray, index: int = -1
) -> list[Wanted]:
    """What the regression's misfit falls by (log, channels added) in the valleys of an effect that swings, and there.

    The parameters (np,) are the effect's own, and the coefficients that go with them; the best valley is first.
    """
    which = range(len(structure.actives))[index]
    shape = [k for k, s in enumerate(structure.slots) if s.effect == which and s.parameter.shape]
    along = _Along.motion_of(structure, stretches, _still(structure, p, which), which)
    low, high = structure.slots[shape[0]].parameter.bounds
    found = []
    for place in [(f, d) for f in np.geomspace(low, high, FREQUENCIES) for d in DAMPINGS]:
        q = along.p.copy()
        q[shape] = place
        found.append(along.pushed(q))
    gains = np.array([gain for gain, _ in found]).reshape(FREQUENCIES, len(DAMPINGS))
    valleys = sorted((found[k] for k in _highest(gains)), key=lambda x: -x[0])
    return [(gain, along.fitted(q)) for gain, q in valleys[:VALLEYS] if gain > 0.0]


def _still(structure: Structure, p: FloatArray, which: int) -> FloatArray:
    """Parameters (np,) with which an effect pushes with nothing."""
    mine = np.array([s.effect == which and not s.parameter.shape for s in structure.slots], dtype=bool)
    return np.where(mine, 0.0, p)


def _highest(gains: FloatArray) -> list[int]:
    """Places, in the flat array, of those (frequencies, dampings) that no neighbour is above.

    At the highest frequency there is no valley: what is so quick is no swing, but the turn itself.
    """
    around = np.pad(gains, 1, constant_values=-np.inf)
    n, m = gains.shape
    beside = [around[i : i + n, j : j + m] for i in range(3) for j in range(3)]
    highest = gains >= np.max(beside, axis=0)
    highest[-1] = False
    return [int(k) for k in np.flatnonzero(highest)]


@dataclass(frozen=True)
class _Left:
    """What the regressors of an equation, ``design`` (m, k), leave of its accelerations (m,); ``inverse`` (k, m)."""

    design: FloatArray
    inverse: FloatArray
    target: FloatArray

    @classmethod
    def by(cls, design: FloatArray, target: FloatArray) -> _Left:
        """The same of a regression."""
        size = np.sqrt(np.mean(design**2, axis=0)) + 1e-12
        inverse = np.linalg.pinv(design / size, rcond=1e-6) / size[:, None]
        return cls(design, inverse, target - design @ (inverse @ target))

    def push(self, column: FloatArray) -> tuple[float, float]:
        """What one more regressor (m,) pushes with, and the mean square that is left then."""
        own = column - self.design @ (self.inverse @ column)
        weight = float(own @ own)
        size = float(own @ self.target) / weight if weight > 1e-12 * float(column @ column) else 0.0
        return size, float(np.mean((self.target - size * own) ** 2))


@dataclass(frozen=True)
class _Along:
    """A regression of the accelerations that the swing of effect ``which`` is to be added to.

    ``pushes`` are the parameters that it pushes with, each with its equation and the oscillator's state; ``water`` the
    motion (n + 1, 6) through the water, per stretch.
    """

    motion: Motion
    p: FloatArray
    which: int
    pushes: list[tuple[int, int, int]]
    water: list[FloatArray]
    design: FloatArray
    seen: Seen
    left: list[_Left]

    @classmethod
    def motion_of(
        cls, structure: Structure, stretches: Sequence[Stretch], p: FloatArray, which: int
    ) -> _Along:
        """The same with the sensors, the inputs and the water as they are in ``p`` (np,)."""
        motion, driven = Motion(structure, stretches), drives(structure, p, stretches)
        seen = motion.by(driven)
        runs, design = zip(driven, seen.states, strict=True), motion.designs(driven).fine
        equations = enumerate(structure.layout.by_equation)
        left = [_Left.by(design[:, columns], seen.fine[:, k]) for k, (_, columns) in equations]
        water = [through_water(x, d.current) for d, x in runs]
        return cls(motion, p, which, _pushes(structure, which), water, design, seen, left)

    def pushed(self, q: FloatArray) -> tuple[float, FloatArray]:
        """What the misfit falls by with the swing of ``q`` (np,), and ``q`` with what it pushes with."""
        swing, gain, out = self._swing(q), 0.0, q.copy()
        for slot, equation, state in self.pushes:
            left, floor = self.left[equation], 1e-6 * float(self.seen.size[equation])
            size, square = left.push(swing[:, state])
            gain += math.log((float(np.mean(left.target**2)) + floor) / (square + floor))
            out[slot] = np.clip(size, *self.motion.structure.slots[slot].parameter.bounds)
        return gain, out

    def fitted(self, q: FloatArray) -> FloatArray:
        """``q`` (np,) with the coefficients that go with its swing."""
        swing, target = self._swing(q), self.seen.fine.copy()
        for slot, equation, state in self.pushes:
            target[:, equation] -= q[slot] * swing[:, state]
        return solve_regression(self.motion.structure, q, self.design, target)

    def _swing(self, q: FloatArray) -> FloatArray:
        """The oscillator's states (m, 2) where the accelerations are looked at."""
        structure = self.motion.structure
        own = _fixed(structure.actives[self.which], structure.values(q, self.which))
        runs = []
        for water, stretch in zip(self.water, self.motion.stretches, strict=True):
            states = swung(own["e2", "e1"], own["e2", "e2"], water, stretch.h)
            runs.append(averaged(0.5 * (states[1:] + states[:-1]), FINE))
        return self.motion.thinned(runs)


def _fixed(active: Active, values: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """Coefficients of an effect's own terms, by equation and text."""
    terms = active.effect.fixed_terms(values) if active.effect.fixed_terms else ()
    return {(t.dof, t.text): c for t, c in terms}


def _pushes(structure: Structure, which: int) -> list[tuple[int, int, int]]:
    """Parameters that an effect pushes with: the place of each, its equation, and the state that it is a factor of."""
    active, out = structure.actives[which], []
    for k, slot in enumerate(structure.slots):
        if slot.effect == which and not slot.parameter.shape:
            alone = {s.name: s.parameter.null for s in structure.slots if s.effect == which}
            own = _fixed(active, {**alone, slot.name: 1.0})
            out += [(k, _EQUATIONS[d], _STATES[t]) for (d, t), c in own.items() if c and d in _EQUATIONS]
    return out
