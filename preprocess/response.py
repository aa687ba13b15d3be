"""A linear response of one velocity to the inputs, fitted in the weak form and integrated from rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from preprocess.chains import Segments
from preprocess.trial import FloatArray, Measurement
from preprocess.weak_form import weak_form

#: Interval of the grid on which the response is integrated, s, and its points at most.
STEP, MOST_POINTS = 0.02, 200_000
#: Half a window of the weak form, s; fewer windows than so many fit nothing, nor do points farther apart, s.
HALF_WINDOW, LEAST_WINDOWS, COARSE = 1.5, 20, 0.5
#: Products of inputs (an azimuth and its propeller) are tried for at most so many of them.
MOST_INPUTS = 6
#: Rates at which a velocity dies away, 1/s.
DECAY = (0.02, 8.0)
#: Weight of keeping coefficients small, as a share of the regressors' own.
RIDGE = 1e-4


@dataclass(frozen=True)
class Response:
    """What of a velocity, and of its derivative, the columns give: (n,) each."""

    value: FloatArray
    derivative: FloatArray


def even_grid(t: FloatArray) -> FloatArray:
    """Evenly spaced times from the first to the last, (k,) s."""
    return np.linspace(t[0], t[-1], int(np.clip((t[-1] - t[0]) / STEP, 50, MOST_POINTS)))


def moving_inputs(inputs: Mapping[str, Measurement]) -> list[Measurement]:
    """Inputs that change at all."""
    return [m for m in inputs.values() if int(m.good.sum()) > 3 and np.ptp(m.value[m.good]) > 0.0]


def forces(inputs: list[Measurement], t: FloatArray, speed: FloatArray) -> list[FloatArray]:
    """Columns that a force may be made of, (n,) each: in proportion, by the square, and by the square of the speed."""
    values = [held_at(m, t) for m in inputs]
    columns = [f for c in values for f in (c, np.abs(c) * c, c * speed**2)]
    if len(values) <= MOST_INPUTS:
        pairs = [(a, b) for x, y in combinations(values, 2) for a, b in ((x, y), (y, x))]
        columns += [np.abs(a) * a * b for a, b in pairs]
    return columns


def held_at(m: Measurement, t: FloatArray) -> FloatArray:
    """Return the logged input at any times, (n,): held, or straight between samples."""
    at, value = m.t[m.good], m.value[m.good]
    if not m.held:
        return np.interp(t, at, value)
    return np.asarray(value[np.clip(np.searchsorted(at, t, side="right") - 1, 0, len(at) - 1)], float)


def linear_response(
    t: FloatArray, y: FloatArray, columns: list[FloatArray], segments: Segments
) -> Response | None:
    """Fit ``ẏ = -decay · y + columns @ gains`` and integrate it from rest; None where there is too little to fit.

    Parameters
    ----------
    t : (n,) s
        Even.
    y : (n,)
        Smoothed velocity.
    columns : list of (n,)
        A constant is added.
    segments : tuple of (start, end)
    """
    known = np.column_stack([np.ones(len(t)), *(c / max(float(np.abs(c).max()), 1e-12) for c in columns)])
    fitted = _fit(t, y, known, segments)
    if fitted is None:
        return None
    decay, gains = fitted
    return _integrated(t, known @ gains, decay)


def _fit(
    t: FloatArray, y: FloatArray, columns: FloatArray, segments: Segments
) -> tuple[float, FloatArray] | None:
    """Decay (1/s) and gains by ridge regression in the weak form."""
    if float(t[1] - t[0]) > COARSE:
        return None
    design, target = [], []
    for low, high in segments:
        part = slice(*np.searchsorted(t, (low, high)))
        if len(t[part]) > 10 and t[part][-1] - t[part][0] > 4.0 * HALF_WINDOW:
            form = weak_form(t[part], HALF_WINDOW)
            design.append(np.asarray(form.values.dot(np.column_stack([-y[part], columns[part]]))))
            target.append(-form.derivatives.dot(y[part]))
    if not design or sum(len(b) for b in target) < LEAST_WINDOWS:
        return None
    a, b = np.vstack(design), np.concatenate(target)
    scale = np.maximum(np.sqrt(np.mean(a**2, axis=0)), 1e-12)
    a = a / scale
    x = np.linalg.solve(a.T @ a + RIDGE * len(b) * np.eye(a.shape[1]), a.T @ b) / scale
    return float(np.clip(x[0], *DECAY)), x[1:]


def _integrated(t: FloatArray, force: FloatArray, decay: float) -> Response:
    from scipy.signal import lfilter

    keep = np.exp(-decay * float(t[1] - t[0]))
    value = np.asarray(lfilter([0.0, (1.0 - keep) / decay], [1.0, -keep], force), float)
    return Response(value, force - decay * value)
