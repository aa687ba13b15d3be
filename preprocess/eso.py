"""The third-order linear ESO (Xie et al. 2020, eqs. 16-21) at uneven times, and its filter.

Per channel ``ẋ̂ = A x̂ + L (y - x̂₁)`` with A the chain of integrators and L = (3ω, 3ω², ω³): all three
poles lie at -ω. Between samples the observer is discretised exactly with the measurement running straight
from one sample to the next, so uneven and missing samples are no matter. The second state is the
derivative of the signal seen through a low-pass; any regressor must be seen through the same low-pass
(:func:`filter_like`), or the regression is biased by the lag between its two sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from preprocess.trial import FloatArray


@dataclass(frozen=True)
class Observer:
    """A third-order linear ESO: its bandwidth, rad/s."""

    bandwidth: float


@njit(cache=True)
def _decay(w, h, e):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """exp((A - L D) h) in closed form: e^(-ωh) (I + N h + N² h²/2), N = A - L D + ω I, N³ = 0."""
    x, f = w * h, np.exp(-w * h)
    a = 0.5 * x * x
    e[0, 0], e[0, 1], e[0, 2] = f * (1.0 - 2.0 * x + a), f * (h - w * h * h / 2.0), f * 0.5 * h * h
    e[1, 0], e[1, 1], e[1, 2] = f * w * (2.0 * a - 3.0 * x), f * (1.0 + x - 2.0 * a), f * (h + w * h * h)
    e[2, 0], e[2, 1], e[2, 2] = f * w * w * (a - x), -f * w * a, f * (1.0 + x + a)


@njit(cache=True)
def _inputs(w, h, e, b0, b1):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Weights on the state of the two samples at the ends of an interval, the signal straight between.

    For a straight signal y(0) + s τ the observer's stationary answer is (y, s, 0): the state relative to
    it decays.
    """
    for i in range(3):
        ramp = (1.0 if i == 1 else 0.0) - e[i, 1]
        if i == 0:
            ramp += h
        b0[i] = (1.0 if i == 0 else 0.0) - e[i, 0] - ramp / h
        b1[i] = ramp / h


@njit(cache=True)
def _observe(t, y, w, start, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    n, m = y.shape
    e, b0, b1 = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    x = start.copy()
    out[0] = x
    last = -1.0
    for i in range(1, n):
        h = t[i] - t[i - 1]
        if h != last:
            _decay(w, h, e)
            _inputs(w, h, e, b0, b1)
            last = h
        for k in range(m):
            a0, a1, a2 = x[0, k], x[1, k], x[2, k]
            for j in range(3):
                x[j, k] = e[j, 0] * a0 + e[j, 1] * a1 + e[j, 2] * a2 + b0[j] * y[i - 1, k] + b1[j] * y[i, k]
        out[i] = x


def _as_columns(y: FloatArray) -> FloatArray:
    return np.ascontiguousarray(y if y.ndim == 2 else y[:, None], dtype=float)


def observe(observer: Observer, t: FloatArray, y: FloatArray, start: FloatArray | None = None) -> FloatArray:
    """Run the observer over a signal.

    Parameters
    ----------
    observer : Observer
    t : (n,) s
        Strictly increasing.
    y : (n,) or (n, m)
    start : (3, m), optional
        State at the first sample; default: the sample, at rest.

    Returns
    -------
    (n, 3) or (n, 3, m)
        Estimates of the signal, its derivative (the equivalent disturbance d_E of eq. 16) and its second
        derivative.
    """
    columns = _as_columns(y)
    first = np.zeros((3, columns.shape[1]))
    first[0] = columns[0]
    out = np.empty((len(t), 3, columns.shape[1]))
    _observe(np.asarray(t, float), columns, float(observer.bandwidth), first if start is None else start, out)
    return out if y.ndim == 2 else out[:, :, 0]


@njit(cache=True)
def _low_pass(t, y, w, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Three first-order lags behind each other, (ω/(s+ω))³, exactly, for signals straight between samples."""
    n, m = y.shape
    for k in range(m):
        a, b, c = y[0, k], y[0, k], y[0, k]
        out[0, k] = c
        for i in range(1, n):
            h = t[i] - t[i - 1]
            f = np.exp(-w * h)
            slope = (y[i, k] - y[i - 1, k]) / h
            # relative to the stationary answer to the ramp: lags of 1/ω, 2/ω and 3/ω
            z = y[i - 1, k]
            da, db, dc = a - (z - slope / w), b - (z - 2.0 * slope / w), c - (z - 3.0 * slope / w)
            x = w * h
            a = f * da + y[i, k] - slope / w
            b = f * (db + x * da) + y[i, k] - 2.0 * slope / w
            c = f * (dc + x * db + 0.5 * x * x * da) + y[i, k] - 3.0 * slope / w
            out[i, k] = c


def filter_like(observer: Observer, t: FloatArray, signals: FloatArray) -> FloatArray:
    """See signals through the low-pass between a true derivative and the observer's estimate.

    The observer's second state is ``3ω²s² + ω³s`` over ``(s+ω)³`` of the signal: the transfer from the true
    derivative is ``ω²(3s + ω)/(s+ω)³``. The same is applied here to every column.

    Parameters
    ----------
    observer : Observer
    t : (n,) s
    signals : (n,) or (n, m)
        Regressors, or the derivative itself for a test.

    Returns
    -------
    Same shape as ``signals``.
    """
    columns = _as_columns(signals)
    third = np.empty_like(columns)
    _low_pass(np.asarray(t, float), columns, float(observer.bandwidth), third)
    second = np.empty_like(columns)
    _second_order(np.asarray(t, float), columns, float(observer.bandwidth), second)
    out = 3.0 * second - 2.0 * third
    return out if signals.ndim == 2 else out[:, 0]


@njit(cache=True)
def _second_order(t, y, w, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """(ω/(s+ω))², exactly, for signals straight between samples."""
    n, m = y.shape
    for k in range(m):
        a, b = y[0, k], y[0, k]
        out[0, k] = b
        for i in range(1, n):
            h = t[i] - t[i - 1]
            f = np.exp(-w * h)
            slope = (y[i, k] - y[i - 1, k]) / h
            z = y[i - 1, k]
            da, db = a - (z - slope / w), b - (z - 2.0 * slope / w)
            a = f * da + y[i, k] - slope / w
            b = f * (db + w * h * da) + y[i, k] - 2.0 * slope / w
            out[i, k] = b


def prediction_error(observer: Observer, t: FloatArray, y: FloatArray) -> float:
    """Mean square of each sample less what the observer's state at the one before foretells of it."""
    state, h = observe(observer, t, y)[:-1], np.diff(t)
    foretold = state[:, 0] + h * state[:, 1] + 0.5 * h * h * state[:, 2]
    return float(np.mean((y[1:] - foretold) ** 2))


def tune(t: FloatArray, y: FloatArray, bounds: tuple[float, float] = (0.05, 50.0)) -> Observer:
    """Choose the bandwidth that foretells the next sample best: motion is followed, noise is not.

    Parameters
    ----------
    t : (n,) s
    y : (n,)
    bounds : (low, high) rad/s

    Notes
    -----
    A grid of 25 over the logarithm, then a golden section about the best of them.
    """
    from scipy.optimize import minimize_scalar

    def error(log_bandwidth: float) -> float:
        return prediction_error(Observer(float(np.exp(log_bandwidth))), t, y)

    grid = np.linspace(np.log(bounds[0]), np.log(bounds[1]), 25)
    k = int(np.clip(np.argmin([error(float(g)) for g in grid]), 1, 23))
    best = minimize_scalar(
        error, bounds=(grid[k - 1], grid[k + 1]), method="bounded", options={"xatol": 1e-2}
    )
    return Observer(float(np.exp(best.x)))
