"""The weak form: integrals of signals against smooth test functions, which need no derivative at all.

For a test function φ that vanishes at both ends of its window, ``∫ φ ẏ dt = -∫ φ̇ y dt``: an equation of
motion becomes one linear equation per window, with no differentiated noise (Messenger and Bortz 2021).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from preprocess.trial import FloatArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True)
class WeakForm:
    """Test functions on windows of one stretch, with quadrature weights folded in.

    Attributes
    ----------
    centres : (k,) s
    half : float
        Half the length of a window, s.
    values, derivatives : (k, n) sparse
        ``values @ f`` is ∫ φ f dt, ``-(derivatives @ f)`` is ∫ φ ḟ dt, for samples ``f`` (n,).
    """

    centres: FloatArray
    half: float
    values: csr_matrix
    derivatives: csr_matrix


def quadrature_weights(t: FloatArray, rule: str = "simpson") -> FloatArray:
    """Weights of a quadrature over all samples, spaced as they come.

    Parameters
    ----------
    t : (n,) s
    rule : str
        ``"trapezoid"``, or ``"simpson"``: parabolas through three neighbours, the two that cover an interval
        averaged, so that no sample is favoured.

    Returns
    -------
    (n,)
    """
    h = np.diff(t)
    weights = np.zeros(len(t))
    weights[:-1] += 0.5 * h
    weights[1:] += 0.5 * h
    if rule == "trapezoid" or len(t) < 3:
        return weights
    a, b = h[:-1], h[1:]
    # the correction of the trapezoid on each interval by the second difference there: -h³/12 f''
    for share, size in ((np.r_[1.0, np.full(len(a) - 1, 0.5)], a), (np.r_[np.full(len(b) - 1, 0.5), 1.0], b)):
        c = share * size**3 / 6.0
        np.subtract.at(weights, np.arange(len(a)), c / (a * (a + b)))
        np.add.at(weights, np.arange(len(a)) + 1, c / (a * b))
        np.subtract.at(weights, np.arange(len(a)) + 2, c / (b * (a + b)))
    return weights


def bump(s: FloatArray, power: int) -> tuple[FloatArray, FloatArray]:
    """``(1 - s²)^p`` for |s| < 1 and its derivative in s; (…,) each."""
    base = np.clip(1.0 - s * s, 0.0, None)
    return base**power, -2.0 * power * s * base ** (power - 1)


def weak_form(
    t: FloatArray, half: float, step: float | None = None, power: int = 4, rule: str = "simpson"
) -> WeakForm:
    """Lay windows over an unbroken stretch.

    Parameters
    ----------
    t : (n,) s
        Sample times, strictly increasing, spaced as they come.
    half : float
        Half the length of a window, s; the test function is a low-pass of about that time.
    step : float, optional
        Between the centres of neighbouring windows; default: half of ``half``.
    power : int
        Of the bump ``(1 - s²)^p``.
    rule : str
        See :func:`quadrature_weights`.

    Raises
    ------
    ValueError
        If the stretch is shorter than one window.
    """
    from scipy.sparse import csr_matrix

    if len(t) < 3 or t[-1] - t[0] < 2.0 * half:
        raise ValueError(
            f"the stretch of {t[-1] - t[0]:.3g} s is shorter than one window of {2.0 * half:.3g} s"
        )
    centres = np.arange(t[0] + half, t[-1] - half + 1e-9 * half, step or 0.5 * half)
    low, high = np.searchsorted(t, centres - half), np.searchsorted(t, centres + half, side="right")
    count = high - low
    start = np.concatenate([[0], np.cumsum(count)])
    column = np.arange(start[-1]) - np.repeat(start[:-1] - low, count)
    s = (t[column] - np.repeat(centres, count)) / half
    weights = quadrature_weights(t, rule)[column]
    phi, slope = bump(s, power)
    shape = (len(centres), len(t))
    values = csr_matrix((phi * weights, column, start), shape=shape)
    return WeakForm(centres, half, values, csr_matrix((slope / half * weights, column, start), shape=shape))
