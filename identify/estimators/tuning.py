"""Choice of hyper-parameters by blocked cross-validation, with any optimiser.

Neighbouring samples of a record are nearly the same: folds of single samples would let an estimator see what
it is tested on. The blocks are whole groups, or unbroken stretches of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..optimisers import Minimum, Optimiser, minimise
from .estimate import BoolArray, Estimate, Estimator, FloatArray, IntArray
from .kernels import predict

Data = tuple[FloatArray, FloatArray, IntArray | None]
Build = Callable[[Mapping[str, float]], Data]


@dataclass(frozen=True)
class Hyper:
    """One hyper-parameter to be chosen.

    Attributes
    ----------
    name : str
        An option of the estimator (``C``, ``C_b``, ``penalty``, ``forgetting``), or one that only the data
        depend on (``omega_u``), if ``of_data``.
    low, high : float
        Range.
    logarithmic : bool
        Whether it is searched by its logarithm.
    of_data : bool
        Whether it goes to ``build`` alone and not to the estimator.
    """

    name: str
    low: float
    high: float
    logarithmic: bool = True
    of_data: bool = False


@dataclass(frozen=True)
class Tuned:
    """What was chosen, and the estimate from all data with it.

    Attributes
    ----------
    score : float
        Mean squared error over the blocks that each fit had not seen, or what ``score`` gave.
    minimum : Minimum
        The search.
    """

    hyper: Mapping[str, float]
    estimate: Estimate
    score: float
    minimum: Minimum


def tune(
    estimator: Estimator,
    optimiser: Optimiser[Any],
    build: Build,
    space: Sequence[Hyper],
    *,
    budget: int = 60,
    seed: int = 0,
    folds: int = 5,
    gap: int = 0,
    reference: Data | None = None,
    score: Callable[[Mapping[str, float], Estimate], float] | None = None,
    optimiser_options: Mapping[str, Any] | None = None,
    **options: Any,
) -> Tuned:
    """Choose hyper-parameters by the error on blocks that were held out.

    Parameters
    ----------
    build : callable
        Design (l, d), target (l,) and groups (l,) or None for given hyper-parameters.
    space : sequence of Hyper
    budget, seed, optimiser_options
        Of the search; one evaluation is ``folds`` fits.
    folds : int
        Blocks.
    gap : int
        Samples next to a held-out block that are not used for the fit either.
    reference : tuple, optional
        Design, target and groups, row by row those of ``build``, on which the held-out rows are scored. It is
        needed where the target itself depends on a hyper-parameter, as with an observer's bandwidth: the
        target that is easiest to predict is the one that is smoothed to nothing.
    score : callable, optional
        ``score(hyper, estimate from all data)`` in place of cross-validation: a free-running error, as in
        Xie et al. 2020, eq. 29.
    **options
        Of the estimator, fixed.
    """
    if not space:
        raise ValueError("expected at least one hyper-parameter to choose")

    def value(unknown: FloatArray) -> float:
        hyper = _decode(space, unknown)
        data, fixed = build(hyper), {**options, **_of_estimator(space, hyper)}
        if score is None:
            return cross_validate(estimator, data, folds=folds, gap=gap, reference=reference, **fixed)
        return score(hyper, _fit(estimator, data, {**fixed, "covariance": "none"}))

    def objective(population: FloatArray) -> FloatArray:
        return np.array([value(unknown) for unknown in population])

    bounds = np.array([_encode(h) for h in space])
    found = minimise(optimiser, objective, bounds, budget, seed, **dict(optimiser_options or {}))
    if not np.isfinite(found.value):
        raise ValueError("no hyper-parameters within the ranges gave a finite error")
    hyper = _decode(space, found.x)
    fitted = _fit(estimator, build(hyper), {**options, **_of_estimator(space, hyper)})
    return Tuned(hyper, fitted, found.value, found)


def _fit(estimator: Estimator, data: Data, options: Mapping[str, Any]) -> Estimate:
    design, target, groups = data
    return estimator.fit(design, target, groups=groups, **options)


def _encode(hyper: Hyper) -> tuple[float, float]:
    if hyper.logarithmic and hyper.low <= 0:
        raise ValueError(f"{hyper.name}: a range on a logarithmic scale must be positive")
    ends = (hyper.low, hyper.high)
    return (float(np.log(ends[0])), float(np.log(ends[1]))) if hyper.logarithmic else ends


def _decode(space: Sequence[Hyper], unknown: FloatArray) -> dict[str, float]:
    return {
        h.name: float(np.clip(np.exp(x) if h.logarithmic else x, h.low, h.high))
        for h, x in zip(space, unknown, strict=True)
    }


def _of_estimator(space: Sequence[Hyper], hyper: Mapping[str, float]) -> dict[str, float]:
    return {h.name: hyper[h.name] for h in space if not h.of_data}


def cross_validate(
    estimator: Estimator,
    data: Data,
    *,
    folds: int = 5,
    gap: int = 0,
    reference: Data | None = None,
    **options: Any,
) -> float:
    """Mean squared error of prediction over blocks that each fit had not seen; see `tune`."""
    design, target, groups = data
    held_design, held_target = (design, target) if reference is None else reference[:2]
    if len(held_target) != len(target):
        raise ValueError(f"expected a reference of {len(target)} rows, found {len(held_target)}")
    total = 0.0
    for held, used in splits(len(target), groups, folds, gap):
        part = None if groups is None else groups[used]
        fitted = estimator.fit(design[used], target[used], groups=part, **{**options, "covariance": "none"})
        total += float(np.sum((held_target[held] - predict(fitted, held_design[held])) ** 2))
    return total / len(target)


def splits(rows: int, groups: IntArray | None, folds: int, gap: int = 0) -> list[tuple[BoolArray, BoolArray]]:
    """Pairs of masks (held out, used for the fit), (l,) each.

    With at least as many groups as folds a block is made of whole groups, so that the blocks are about
    equally long; with fewer, each group is cut into ``folds`` stretches, and a block takes one from each.
    """
    labels = np.zeros(rows, dtype=np.int64) if groups is None else groups
    block = _blocks(labels, folds)
    pairs = []
    for k in range(folds):
        held = block == k
        near = _near(held, labels, gap)
        if held.any() and (~near).any():
            pairs.append((held, ~near))
    if len(pairs) < 2:
        raise ValueError(f"{rows} rows are too few for {folds} folds with a gap of {gap}")
    return pairs


def _blocks(labels: IntArray, folds: int) -> IntArray:
    """Assign a block to each row, (l,)."""
    names, index, counts = np.unique(labels, return_inverse=True, return_counts=True)
    if len(names) >= folds:
        block, load = np.zeros(len(names), dtype=np.int64), np.zeros(folds)
        for j in np.argsort(-counts, kind="stable"):
            block[j] = np.argmin(load)
            load[block[j]] += counts[j]
        return np.asarray(block[index])
    order = np.argsort(index, kind="stable")
    position = np.empty(len(labels), dtype=np.int64)
    position[order] = np.arange(len(labels)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(position * folds // counts[index])


def _near(held: BoolArray, labels: IntArray, gap: int) -> BoolArray:
    """Rows that are held out, or within ``gap`` rows of one in the same group."""
    near = held.copy()
    for _ in range(gap):
        same = labels[1:] == labels[:-1]
        grown = near.copy()
        grown[1:] |= near[:-1] & same
        grown[:-1] |= near[1:] & same
        near = grown
    return near
