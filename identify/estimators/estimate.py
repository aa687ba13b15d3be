"""What every estimator takes and gives back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypedDict

import numpy as np

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
CovarianceKind = Literal["auto", "hac", "cluster", "white", "iid", "none"]
KernelName = Literal["linear", "rbf", "polynomial"]


class Common(TypedDict, total=False):
    """The options that every estimator takes; see `Settings`."""

    names: Sequence[str] | None
    covariance: CovarianceKind
    lags: int | None
    tolerance: float
    max_relative_stderr: float


@dataclass(frozen=True)
class Settings:
    """How an estimate is judged, whatever the estimator.

    Attributes
    ----------
    names : sequence of str, optional
        Of the design's columns, for the reasons; "column 0" and so on where absent.
    covariance : str
        ``hac`` (Newey and West 1987, within each group), ``cluster`` (by group), ``white`` (independent, of
        unequal variance), ``iid``, ``none`` (zeros, for the inside of a search), or ``auto``: ``cluster``
        from 50 groups on, ``hac`` otherwise.
    lags : int, optional
        Of the Bartlett kernel of ``hac``; by Andrews 1991 where absent.
    tolerance : float
        Relative singular value of the scaled design below which its columns count as collinear.
    max_relative_stderr : float
        Standard error over value above which a coefficient counts as not identifiable.
    """

    names: Sequence[str] | None = None
    covariance: CovarianceKind = "auto"
    lags: int | None = None
    tolerance: float = 1e-6
    max_relative_stderr: float = 0.5


@dataclass(frozen=True)
class KernelMachine:
    """A trained LSSVM with any kernel: f(x) = Σ αᵢ k(xᵢ, x / scale) + b.

    Attributes
    ----------
    support : (l, d)
        The training rows, scaled.
    alpha : (l,)
        Their multipliers.
    scale : (d,)
        By which rows are divided before they meet the kernel.
    """

    kernel: KernelName
    parameters: Mapping[str, float]
    support: FloatArray
    alpha: FloatArray
    bias: float
    scale: FloatArray


@dataclass(frozen=True)
class Estimate:
    """What an estimator found, how sure it is, and what the data could not give.

    Attributes
    ----------
    theta : (d,)
        One coefficient per column of the design; NaN where a non-linear kernel has none.
    covariance : (d, d)
        Of theta, corrected for residuals that are correlated within a group.
    bias : float
        The intercept; 0 where the estimator has none.
    sigma : float
        Standard deviation of the residuals, robust where the estimator is.
    weights : (l,), optional
        Of the samples, where the estimator weighs them.
    identifiable : (d,) bool
        Whether the data determine the coefficient.
    reasons : tuple of str, length d
        Why not; empty where identifiable.
    stopped : str
        How the estimation ended, as a sentence.
    bias_stderr : float
        Standard error of the bias.
    hyper : mapping
        The hyper-parameters in use, chosen or given.
    machine : KernelMachine, optional
        For prediction with a non-linear kernel.
    """

    theta: FloatArray
    covariance: FloatArray
    bias: float
    sigma: float
    weights: FloatArray | None
    identifiable: BoolArray
    reasons: tuple[str, ...]
    stopped: str
    bias_stderr: float = 0.0
    hyper: Mapping[str, float] = field(default_factory=dict)
    machine: KernelMachine | None = None

    @property
    def stderr(self) -> FloatArray:
        """Standard errors of theta, (d,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


@dataclass(frozen=True)
class Estimator:
    """An estimator by name.

    Attributes
    ----------
    fit : callable
        ``fit(design (l, d), target (l,), *, groups=None (l,), **options) -> Estimate``.
    hyper : mapping of str to (float, float)
        The options that a tuner may search, with the range on a logarithmic scale.
    source : str
        Where it is published.
    bias : bool
        Whether it fits a bias unless told not to: such a one is part of the model, as its term 1.
    """

    name: str
    fit: Callable[..., Estimate]
    hyper: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    source: str = ""
    bias: bool = False
