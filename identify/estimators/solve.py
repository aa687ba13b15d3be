"""Penalised and rank-revealing solutions of a compressed problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .estimate import FloatArray, IntArray
from .problem import Compressed

MATERIAL = 1e-3  # share of a combination of columns that counts as taking part in it


@dataclass(frozen=True)
class Solution:
    """Coefficients of the scaled columns, and how they answer to the data.

    Attributes
    ----------
    beta : (p,)
        Coefficients of the scaled columns.
    bread : (p, p)
        Inverse of the Gram matrix plus the penalty: a change of the normal equations' right-hand side times
        this is the change of beta.
    degrees : float
        Effective number of parameters.
    """

    beta: FloatArray
    bread: FloatArray
    degrees: float


def penalised(small: Compressed, penalty: FloatArray) -> Solution:
    """Minimise |R β - z|² + Σ penaltyⱼ βⱼ², by QR of the stacked system (no squaring)."""
    p = len(penalty)
    stacked = np.vstack([small.factor, np.diag(np.sqrt(penalty))])
    q, upper = np.linalg.qr(stacked)
    root = np.linalg.solve(upper, np.eye(p))
    beta = root @ (q[:p].T @ small.reduced)
    return Solution(beta, root @ root.T, float(np.sum(q[:p] ** 2)))


def least_squares(small: Compressed, kept: IntArray) -> Solution:
    """Minimise |R β - z|² over the columns that were kept; the others get zero."""
    p = small.factor.shape[1]
    q, upper = np.linalg.qr(small.factor[:, kept])
    root = np.linalg.solve(upper, np.eye(len(kept)))
    beta, bread = np.zeros(p), np.zeros((p, p))
    beta[kept] = root @ (q.T @ small.reduced)
    bread[np.ix_(kept, kept)] = root @ root.T
    return Solution(beta, bread, float(len(kept)))


@dataclass(frozen=True)
class Dependence:
    """A column that the data cannot tell from a combination of others.

    Attributes
    ----------
    column : int
        The one that is given up.
    others : tuple of int
        The ones it is a combination of; empty where the column is zero.
    """

    column: int
    others: tuple[int, ...]


def dependences(factor: FloatArray, tolerance: float) -> tuple[IntArray, tuple[Dependence, ...]]:
    """Which columns to keep, and what the others depend on.

    The smallest singular value of the (scaled) columns is looked at; while it is below ``tolerance`` times
    the largest, the last column that takes part in its direction is given up, so that the terms that a model
    names first stay.

    Returns
    -------
    kept : (k,) int
    dropped : tuple of Dependence
    """
    kept = [int(i) for i in np.flatnonzero(np.linalg.norm(factor, axis=0) > 0)]
    zero = [i for i in range(factor.shape[1]) if i not in kept]
    dropped: list[int] = []
    while kept and (victim := _redundant(factor[:, kept], tolerance)) is not None:
        dropped.append(kept.pop(victim))
    relations = tuple(_relation(factor, np.array(kept), j) for j in sorted(dropped))
    return np.array(kept, dtype=np.int64), (*(Dependence(j, ()) for j in zero), *relations)


def _redundant(columns: FloatArray, tolerance: float) -> int | None:
    _, singular, directions = np.linalg.svd(columns)
    if singular[-1] >= tolerance * singular[0]:
        return None
    share = np.abs(directions[-1])
    return int(np.flatnonzero(share > 0.1 * share.max())[-1])


def _relation(factor: FloatArray, kept: IntArray, column: int) -> Dependence:
    coefficients = np.linalg.lstsq(factor[:, kept], factor[:, column], rcond=None)[0]
    share = np.abs(coefficients)
    return Dependence(column, tuple(int(k) for k in kept[share > MATERIAL * share.max()]))
