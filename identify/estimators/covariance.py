"""Covariance of estimates whose residuals are correlated in time: White, Newey-West, clusters."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .estimate import CovarianceKind, FloatArray, IntArray

MANY_GROUPS = 50
LARGEST_CORRELATION = 0.97  # Andrews and Monahan 1992, and in the choice of lags


def meat(scores: FloatArray, groups: IntArray | None, kind: CovarianceKind, lags: int | None) -> FloatArray:
    """Covariance of the sum of the scores, (p, p).

    Parameters
    ----------
    scores : (l, p)
        Each sample's contribution to the estimating equation, x·w·e, in time order within each group.
    groups : (l,) int, optional
        Unbroken stretch that each sample belongs to.
    """
    if kind == "auto":
        kind = "cluster" if groups is not None and len(np.unique(groups)) >= MANY_GROUPS else "hac"
    if kind == "white":
        return scores.T @ scores
    if kind == "cluster":
        return clustered(scores, groups)
    return newey_west(scores, groups, lags)


def clustered(scores: FloatArray, groups: IntArray | None) -> FloatArray:
    """Liang and Zeger 1986: any correlation within a group, none between groups."""
    if groups is None:
        raise ValueError("cluster-robust covariance needs groups")
    labels, index = np.unique(groups, return_inverse=True)
    sums = np.zeros((len(labels), scores.shape[1]))
    np.add.at(sums, index, scores)
    return sums.T @ sums * (len(labels) / max(len(labels) - 1, 1))


def newey_west(scores: FloatArray, groups: IntArray | None, lags: int | None = None) -> FloatArray:
    """Newey and West 1987, eq. 5 (Bartlett kernel), summed over the groups.

    Without ``lags`` the scores are first whitened, each column by its own first-order autoregression, the
    lags of what is left follow from the data, and the result is coloured again (Andrews and Monahan 1992):
    the kernel alone underestimates a strong correlation.

    The weighted sum of autocovariances up to ``lags`` is the mean square of the running sums over lags + 1
    samples, so that its cost does not grow with the lags.
    """
    stretches = list(_stretches(scores, groups))
    if lags is not None:
        return _bartlett(stretches, lags)
    rho = np.clip(_autocorrelation(stretches), -LARGEST_CORRELATION, LARGEST_CORRELATION)
    white = [s[1:] - rho * s[:-1] for s in stretches if len(s) > 1]
    if not white:
        return scores.T @ scores
    lost = len(scores) / sum(len(s) for s in white)
    return lost * _bartlett(white, andrews_lags(white)) / np.outer(1 - rho, 1 - rho)


def _bartlett(stretches: list[FloatArray], lags: int) -> FloatArray:
    width = lags + 1
    total = np.zeros((stretches[0].shape[1], stretches[0].shape[1]))
    for stretch in stretches:
        for sums in _running_sums(stretch, width):
            total += sums.T @ sums
    return total / width


def _stretches(scores: FloatArray, groups: IntArray | None) -> Iterator[FloatArray]:
    if groups is None:
        yield scores
        return
    order = np.argsort(groups, kind="stable")
    edges = np.flatnonzero(np.diff(groups[order])) + 1
    yield from np.split(scores[order], edges)


def _running_sums(stretch: FloatArray, width: int) -> Iterator[FloatArray]:
    """All sums over ``width`` neighbours, those that reach over the ends included, in any order."""
    n = len(stretch)
    if width == 1:
        yield stretch
        return
    sums = np.zeros((n + 1, stretch.shape[1]))
    np.cumsum(stretch, axis=0, out=sums[1:])
    inner = min(width, n)
    yield sums[1:inner]
    yield sums[n] - sums[n - inner + 1 : n]
    if width <= n:
        yield sums[width:] - sums[: n + 1 - width]
    else:
        yield np.repeat(sums[n:], width - n + 1, axis=0)


def andrews_lags(stretches: list[FloatArray]) -> int:
    """Lags of the Bartlett kernel by Andrews 1991, eq. 6.2 and 6.4 (first-order autoregressive plug-in)."""
    count = sum(len(s) for s in stretches)
    rho = np.clip(_autocorrelation(stretches), -LARGEST_CORRELATION, LARGEST_CORRELATION)
    alpha = float(np.mean(4 * rho**2 / ((1 - rho) * (1 + rho)) ** 2))
    longest = max(len(s) for s in stretches)
    return int(min(np.ceil(1.1447 * (alpha * count) ** (1 / 3)), max(longest - 1, 0)))


def _autocorrelation(stretches: list[FloatArray]) -> FloatArray:
    energy = np.sum([np.diag(s.T @ s) for s in stretches], axis=0)
    neighbours = np.sum([np.ones(len(s) - 1) @ (s[1:] * s[:-1]) for s in stretches], axis=0)
    return np.asarray(neighbours / np.where(energy > 0, energy, 1.0))
