"""Recursive least squares as a stream."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.estimators import ESTIMATORS
from identify.estimators.recursive import current, start, update

THETA = np.array([1.0, -2000.0, 0.03, -0.5])
UNITS = np.array([1.0, 1e-3, 100.0, 3.0])


def data(rows=600, noise=0.05, seed=0, bias=0.0):
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((rows, 4)) * UNITS
    return design, design @ THETA + bias + noise * rng.standard_normal(rows)


def coloured(rng, rho, shape):
    drawn = lfilter(
        [np.sqrt(1 - rho**2)], [1, -rho], rng.standard_normal((shape[0] + 200, *shape[1:])), axis=0
    )
    return drawn[200:]


@pytest.mark.parametrize("forgetting", [1.0, 0.99])
@pytest.mark.parametrize("bias", [False, True])
def test_stream_equals_weighted_least_squares_however_it_is_cut(forgetting, bias):
    design, target = data(200, bias=0.5)
    state = start(4, forgetting=forgetting, bias=bias)
    for cut in [*np.split(np.arange(200), [1, 2, 50, 51, 120])]:
        state = update(state, design[cut], target[cut])
    weights = forgetting ** np.arange(199.0, -1, -1)
    batch = ESTIMATORS["recursive_ls"].fit(design, target, forgetting=forgetting, bias=bias)
    plain = ESTIMATORS["ls"].fit(design, target, weights=weights, bias=bias)
    assert np.allclose(current(state).theta, plain.theta, rtol=1e-9)
    assert np.allclose(batch.theta, plain.theta, rtol=1e-9)
    assert current(state).bias == pytest.approx(plain.bias, rel=1e-9)


def test_stream_follows_a_change_that_it_may_forget():
    design, target = data(3000)
    later = np.concatenate([target[:1500], design[1500:] @ (2 * THETA)])
    remembering, forgetting = (
        current(update(start(4, forgetting=f), design, later)).theta for f in (1.0, 0.99)
    )
    assert np.allclose(forgetting, 2 * THETA, rtol=1e-3)
    assert not np.allclose(remembering, 2 * THETA, rtol=0.2)


def test_stream_can_be_saved_and_its_old_state_is_untouched():
    design, target = data(100)
    state = update(start(4), design[:50], target[:50])
    saved = pickle.dumps(state)
    on = update(pickle.loads(saved), design[50:], target[50:])
    assert pickle.dumps(state) == saved
    assert np.allclose(on.theta, ESTIMATORS["ls"].fit(design, target).theta)


def test_stream_knows_how_sure_it_is():
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(100):
        design = coloured(rng, 0.8, (1000, 2))
        state = start(2)
        target = design @ [1.0, -2.0] + coloured(rng, 0.8, (1000,))
        for k in range(0, 1000, 100):
            state = update(state, design[k : k + 100], target[k : k + 100])
        found = current(state)
        inside.append(np.abs(found.theta - [1.0, -2.0]) < 1.96 * found.stderr)
    assert np.mean(inside) > 0.9


def test_stream_refuses_what_it_cannot_use():
    with pytest.raises(ValueError, match="forgetting"):
        start(2, forgetting=0.0)
    with pytest.raises(ValueError, match="samples"):
        current(update(start(4), np.ones((2, 4)), np.ones(2)))
    with pytest.raises(ValueError, match="finite"):
        update(start(1), [[np.nan]], [1.0])
