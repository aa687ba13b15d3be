"""What causes promise together to first order: the normal equations of all, reduced to what they add."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from identify.effect import Active
from identify.fitted import Fitted
from identify.structure import Structure, null_parameters
from validate.candidates import extended, normal, reduced_to

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Places = np.ndarray[tuple[int, ...], np.dtype[np.intp]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: Directions of scaled parameters that differ less from all others' promise nothing.
TOLD_APART = 1e-4


class FirstOrder(NamedTuple):
    """Normal equations of what causes add, what the fit would follow taken off; and how far each may move.

    ``matrix`` (k, k) and ``score`` (k,) in units of each parameter's own information; ``up`` and ``down`` (k,): whether
    it can move that way from where it does nothing; ``loss``: what the fit would lose before any of them moves.
    """

    matrix: FloatArray
    score: FloatArray
    up: BoolArray
    down: BoolArray
    loss: float

    def gain(self, mine: Places) -> float:
        """What parameters gain together, but for those that would leave their bounds."""
        values, vectors = np.linalg.eigh(self.matrix[np.ix_(mine, mine)])
        good = values > TOLD_APART
        along = vectors[:, good].T @ self.score[mine]
        step = vectors[:, good] @ (along / values[good])
        stays = np.where(step > 0.0, self.up[mine], self.down[mine])
        if stays.all():
            return float(np.sum(along**2 / values[good]))
        return self.gain(mine[stays]) if stays.any() else 0.0


def first_order(
    base: Fitted, actives: Sequence[Active], without: int | None = None
) -> tuple[FirstOrder, dict[int, Places]]:
    """The normal equations of causes beside a fit, or in place of an effect of it that is left out.

    With them, for each cause that does not overflow on the fit's own path, where in them its parameters are.
    """
    wide, start, places = extended(base.solution.structure, base.solution.p, actives)
    information, score, _ = normal(base, wide, start)
    left_out = np.array([k for k, s in enumerate(wide.slots) if s.effect == without], dtype=np.intp)
    own = np.setdiff1d(np.arange(len(start)), np.concatenate([left_out, *places]))
    told = [k for k, x in enumerate(places) if np.isfinite(information[np.ix_(x, np.r_[own, x])]).all()]
    mine = np.concatenate([np.zeros(0, dtype=np.intp), *(places[k] for k in told)])
    away = (null_parameters(wide) - start)[left_out]
    loss = float(away @ information[np.ix_(left_out, left_out)] @ away - 2.0 * score[left_out] @ away)
    matrix, rest, followed = reduced_to(information, score - information[:, left_out] @ away, own, mine)
    ends = np.cumsum([len(places[k]) for k in told]).astype(int)
    where = dict(zip(told, np.split(np.arange(len(mine)), ends)[: len(told)], strict=True))
    return FirstOrder(matrix, rest, *_free(wide, mine, start), loss - followed), where


def _free(structure: Structure, mine: Places, at: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Whether parameters ``mine`` may become larger, and smaller, than ``at`` (np,)."""
    low, high = (np.array([structure.slots[k].parameter.bounds[j] for k in mine]) for j in (0, 1))
    return at[mine] < high, at[mine] > low
