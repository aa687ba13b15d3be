"""What gusts of a wind that nothing measured may have done, as shapes of the air's velocity over time.

A wind that is identified is a steady one; the real one comes and goes by a tenth of its speed and more, and turns. Its
speed and its direction are taken as independent first-order Gauss-Markov processes of one intensity.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from identify.bridges import Shapes
from identify.directions import AIR
from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Time constant of gusts, s; their speed is given at times so far apart, s, at so many in a window at most.
TIME, APART, MOST = 10.0, 2.5, 24
#: Standard deviation of the gustiest wind, as a share of its speed, and of its direction, rad.
GUSTIEST = 0.3


def gusts_of(
    structure: Structure, p: FloatArray, stretch: Stretch, windows: Sequence[tuple[int, int]]
) -> Shapes:
    """Shapes of the gustiest wind in windows of a stretch, each (first step, steps): of its speed and direction."""
    along = _gustiest(structure, p)
    each = [_nodes(steps, stretch.h) for _, steps in windows]
    mean = np.zeros((stretch.steps, 2 * max((e.shape[1] for e in each), default=0), 2))
    for (first, steps), waves in zip(windows, each, strict=True):
        mean[first : first + steps, : 2 * waves.shape[1]] = np.einsum("nk,dc->nkdc", waves, along).reshape(
            steps, -1, 2
        )
    return Shapes(mean, np.zeros_like(mean), AIR)


def blown(
    structure: Structure, p: FloatArray, stretch: Stretch, share: float, rng: np.random.Generator
) -> FloatArray:
    """Gusts over a stretch, drawn: added to the air's velocity (steps, 2), a share of the largest variance."""
    keep = float(np.exp(-stretch.h / TIME))
    fresh = rng.standard_normal((stretch.steps, 2)) * np.sqrt(1.0 - keep**2)
    fresh[:1] = rng.standard_normal((1, 2))
    swing = lfilter([1.0], [1.0, -keep], fresh, axis=0)
    return np.asarray(np.sqrt(share) * swing @ _gustiest(structure, p), dtype=float)


def _gustiest(structure: Structure, p: FloatArray) -> FloatArray:
    """A standard deviation (2, 2) of the gustiest wind: of its speed, and of its direction; each north and east.

    Where no wind is in the structure (any more) it has no gusts.
    """
    winds = [a.effect.air(structure.values(p, e)) for e, a in enumerate(structure.actives) if a.effect.air]
    north, east = np.sum([(0.0, 0.0), *winds], axis=0)
    return GUSTIEST * np.array([[north, east], [-east, north]])


def _nodes(steps: int, h: float) -> FloatArray:
    """Independent shapes (steps, k) of variance one together: straight lines between correlated values."""
    at, length = h * (np.arange(steps) + 0.5), h * steps
    nodes = np.linspace(0.0, length, int(np.clip(round(length / APART), 2, MOST)))
    root = np.linalg.cholesky(np.exp(-np.abs(np.subtract.outer(nodes, nodes)) / TIME))
    lines = np.array([np.interp(at, nodes, unit) for unit in np.eye(len(nodes))])
    return np.asarray(lines.T @ root, dtype=float)
