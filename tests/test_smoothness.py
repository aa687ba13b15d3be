"""A receiver's wander is told from the smooth error that a missing force makes, however strong the noise on top is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify.kernel import POSITION
from identify.noise import smoothness

WINDOWS, RATE, LENGTH = 8, 5.0, 30.0


def seen(rng, slow):
    """Smoothness of white noise in windows of a log's positions, with ``slow`` (n, 2) of each added to it."""
    n = int(RATE * LENGTH)
    t = np.arange(n) / RATE
    stretch = SimpleNamespace(samples=SimpleNamespace(kind=np.full(n, POSITION), t=t), h=0.1)
    windows = [SimpleNamespace(stretch=k, samples=slice(0, n)) for k in range(WINDOWS)]
    errors = [rng.standard_normal((n, 2)) + slow(t) for _ in windows]
    problem = SimpleNamespace(windows=windows, stretches=[stretch] * WINDOWS)
    return smoothness(problem, SimpleNamespace(residuals=errors), POSITION)


def wander(rng, size, time):
    """Gauss-Markov noise less the straight line that a window's first state takes."""

    def one(t):
        keep, x = np.exp(-(t[1] - t[0]) / time), rng.standard_normal(2) * size
        out = np.empty((len(t), 2))
        for k in range(len(t)):
            out[k] = x = keep * x + size * np.sqrt(1 - keep**2) * rng.standard_normal(2)
        return out - np.column_stack([np.polyval(np.polyfit(t, c, 1), t) for c in out.T])

    return one


@pytest.mark.parametrize(("size", "time"), [(0.0, 60.0), (1.0, 60.0), (5.0, 40.0)])
def test_a_wander_is_not_smooth_however_weak(size, time):
    rng = np.random.default_rng(7)
    found = np.array([seen(rng, wander(rng, size, time)) for _ in range(150)])
    assert np.mean(found > 0.1) <= 0.02


@pytest.mark.parametrize("size", [3.0, 30.0])
def test_what_a_missing_force_leaves_is_smooth(size):
    rng = np.random.default_rng(8)
    found = [
        seen(rng, lambda t: size * np.sin(np.outer(t, [0.4, 0.3]) + rng.uniform(0, 6))) for _ in range(20)
    ]
    assert np.median(found) > 0.7
