"""Normal equations of windows with their first states eliminated, and a damped step of what is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.kernel import NX

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


@dataclass(frozen=True)
class Reduced:
    """Normal equations with the first states eliminated.

    ``information`` (w, np, np) and ``score`` (w, np) per window; ``cost`` (w,) is the cost left per window at its best
    first state; ``state_step`` (w, 8) and ``state_slope`` (w, 8, np) give that state: step - slope @ δp.
    """

    information: FloatArray
    score: FloatArray
    cost: FloatArray
    state_step: FloatArray
    state_slope: FloatArray


def reduce(
    matrices: FloatArray,
    first: FloatArray,
    anchor: FloatArray,
    known: FloatArray,
    damping: float | FloatArray = 0.0,
) -> Reduced:
    """Eliminate every window's first state from its moment matrix (w, 8 + np + 1 square).

    ``known`` (8,) is the precision with which the ``anchor`` is known beforehand; ``damping`` is one number, or (w, 1).
    """
    a = matrices[:, :NX, :NX].copy()
    index = np.arange(NX)
    a[:, index, index] += known
    a[:, index, index] *= 1.0 + damping
    b = matrices[:, :NX, NX:-1]
    gx = matrices[:, :NX, -1] - (first - anchor) * known
    scale = 1.0 / np.sqrt(np.maximum(a[:, index, index], 1e-300))
    with np.errstate(over="ignore"):  # of a window that all but ran away: its step will be no good
        a *= scale[:, :, None] * scale[:, None, :]
    a[:, index, index] += 1e-13
    right = np.concatenate([gx[:, :, None], b], axis=2) * scale[:, :, None]
    solved = np.linalg.solve(a, right) * scale[:, :, None]
    step, slope = solved[:, :, 0], solved[:, :, 1:]
    information = matrices[:, NX:-1, NX:-1] - np.swapaxes(b, 1, 2) @ slope
    score = matrices[:, NX:-1, -1] - np.einsum("wij,wi->wj", b, step)
    cost = matrices[:, -1, -1] - np.einsum("wi,wi->w", gx, step)
    return Reduced(information, score, cost, step, slope)


def damped_step(information: FloatArray, score: FloatArray, free: BoolArray, damping: float) -> FloatArray:
    """Levenberg-Marquardt step on columns scaled to unit diagonal; held parameters stay."""
    move = np.zeros(len(score))
    if not free.any():
        return move
    part = information[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(part), 1e-30))
    scaled = part * scale * scale[:, None] + (damping + 1e-10) * np.eye(len(part))
    move[free] = scale * np.linalg.solve(scaled, scale * score[free])
    return move
