"""A regression problem, checked once, and its compression to a small triangular one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .estimate import FloatArray, IntArray

# Ratios of the pivots of the Gram matrix's Cholesky factor:
GRAM_IS_ENOUGH = 1e-4  # above, squaring the problem costs less than 1e-8
ONE_REFINEMENT_IS_ENOUGH = 1e-6


@dataclass(frozen=True)
class Problem:
    """Checked data of a regression.

    Attributes
    ----------
    design, target, groups : (l, d), (l,), (l,)
        As given, as arrays.
    bias : bool
        Whether an intercept is estimated; False where the design holds a constant column already.
    scale : (d,)
        Root mean square of each column, 1 where it is zero.
    gram : (d, d)
        Design' design.
    """

    design: FloatArray
    target: FloatArray
    groups: IntArray | None
    bias: bool
    scale: FloatArray
    gram: FloatArray

    @property
    def columns(self) -> int:
        """How many coefficients, the intercept included."""
        return self.design.shape[1] + int(self.bias)

    @property
    def all_scales(self) -> FloatArray:
        """The scales, with 1 for the intercept."""
        return np.append(self.scale, 1.0) if self.bias else self.scale


@dataclass(frozen=True)
class Compressed:
    """The problem reduced to ``min |R β - z|²``, with columns of unit scale.

    Attributes
    ----------
    factor : (p, p)
        R, with R'R the weighted Gram matrix of the scaled columns.
    reduced : (p,)
        z.
    rest : float
        What is left of the sum of squares at the minimum.
    """

    factor: FloatArray
    reduced: FloatArray
    rest: float


def problem(
    design: ArrayLike, target: ArrayLike, groups: ArrayLike | None = None, *, bias: bool = False
) -> Problem:
    """Check the data of a regression.

    Raises
    ------
    ValueError
        Where the shapes do not fit, a value is not finite, or there are fewer rows than columns.
    """
    rows, values = np.asarray(design, dtype=float), np.asarray(target, dtype=float)
    labels = None if groups is None else np.asarray(groups, dtype=np.int64)
    _check_shapes(rows, values, labels)
    with np.errstate(over="ignore", invalid="ignore"):
        gram = rows.T @ rows
    scale = root_mean_square(rows, gram)
    if not np.isfinite(scale).all() or not np.isfinite(values).all():
        raise ValueError("design and target must be finite; drop the rows with gaps first")
    return Problem(rows, values, labels, bias and not _holds_a_constant(rows, scale), scale, gram)


def _holds_a_constant(design: FloatArray, scale: FloatArray) -> bool:
    mean = np.full(len(design), 1 / len(design)) @ design
    suspects = design[:, np.abs(mean) > (1 - 1e-6) * scale]
    return bool(np.any(np.ptp(suspects, axis=0) <= 1e-12 * np.abs(suspects[0])))


def _check_shapes(design: FloatArray, target: FloatArray, groups: IntArray | None) -> None:
    if design.ndim != 2 or target.shape != design.shape[:1]:
        raise ValueError(f"expected design (l, d) and target (l,), found {design.shape} and {target.shape}")
    if groups is not None and groups.shape != target.shape:
        raise ValueError(f"expected one group per row, found {groups.shape} for {target.shape}")
    if design.shape[1] == 0 or design.shape[0] <= design.shape[1]:
        raise ValueError(f"expected more rows than columns, found {design.shape}")


def root_mean_square(design: FloatArray, gram: FloatArray) -> FloatArray:
    """Scale of each column; 1 where the column is zero, its largest value where squares leave the floats."""
    squares = np.diag(gram)
    safe = (squares > 1e-200) & (squares < 1e200)
    scale = np.sqrt(np.where(safe, squares, 1.0) / len(design))
    for j in np.flatnonzero(~safe):
        scale[j] = np.abs(design[:, j]).max() or 1.0
    return scale


def with_ones(data: Problem) -> FloatArray:
    """Return the rows (l, p), unscaled, with a column of ones where there is an intercept."""
    return np.column_stack([data.design, np.ones(len(data.design))]) if data.bias else data.design


def compress(data: Problem, weights: FloatArray | None = None, *, exact: bool = False) -> Compressed:
    """Reduce the problem as cheaply as its condition allows, and without squaring it if ``exact``.

    By its Gram matrix alone; or by that and one refinement, which is as accurate as Householder's QR up to a
    condition of 1e7 (CholeskyQR2, Yamamoto et al. 2015) and made of matrix products; or by QR.
    """
    gram, cross, energy = _moments(data, weights)
    try:
        factor = np.asarray(np.linalg.cholesky(gram).T)
    except np.linalg.LinAlgError:
        return _by_qr(data, weights)
    pivots = np.diag(factor)
    ratio = float(pivots.min() / pivots.max())
    if ratio > GRAM_IS_ENOUGH and not exact:
        reduced = np.asarray(np.linalg.solve(factor.T, cross))
        return Compressed(factor, reduced, max(energy - float(reduced @ reduced), 0.0))
    return _refined(data, weights, factor) if ratio > ONE_REFINEMENT_IS_ENOUGH else _by_qr(data, weights)


def _weighted_rows(data: Problem, weights: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    rows, target = with_ones(data) / data.all_scales, data.target
    if weights is None:
        return rows, target
    root = np.sqrt(weights)
    return rows * root[:, None], target * root


def _by_qr(data: Problem, weights: FloatArray | None) -> Compressed:
    upper: FloatArray = np.asarray(np.linalg.qr(np.column_stack(_weighted_rows(data, weights)), mode="r"))
    p = data.columns
    return Compressed(upper[:p, :p], upper[:p, p], float(upper[p, p] ** 2) if len(upper) > p else 0.0)


def _refined(data: Problem, weights: FloatArray | None, factor: FloatArray) -> Compressed:
    rows, target = _weighted_rows(data, weights)
    nearly = rows @ np.linalg.inv(factor)
    second = np.linalg.cholesky(nearly.T @ nearly).T
    reduced = np.asarray(np.linalg.solve(second.T, nearly.T @ target))
    left = target - nearly @ np.linalg.solve(second, reduced)
    return Compressed(np.asarray(second @ factor), reduced, float(left @ left))


def _moments(data: Problem, weights: FloatArray | None) -> tuple[FloatArray, FloatArray, float]:
    """Gram matrix of the scaled columns, their products with the target, and the target's own."""
    x, y, s = data.design, data.target, data.all_scales
    gram, wy = data.gram, y if weights is None else y * weights
    if weights is not None:
        gram = (x * weights[:, None]).T @ x
    cross = x.T @ wy
    if data.bias:
        w = np.ones(len(y)) if weights is None else weights
        sums = w @ x
        gram = np.vstack([np.column_stack([gram, sums]), np.append(sums, w.sum())])
        cross = np.append(cross, wy.sum())
    return gram / np.outer(s, s), cross / s, float(wy @ y)


def column_names(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    """Name the columns; by their numbers where there are no names."""
    if names is None:
        return tuple(f"column {i}" for i in range(count))
    if len(names) != count:
        raise ValueError(f"expected {count} names, one per column, found {len(names)}")
    return tuple(names)
