"""A rate's own samples say whether it wanders within seconds, where the vessel turns more slowly than that."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from preprocess.integrated import Sensed
from preprocess.rate_samples import may_wander, shows

EVERY, NOISE, SIZE, TIME = 0.1, 0.0015, 0.0018, 0.5


def sampled(wander, turning=90.0, seed=0):
    """A gyro on a vessel that turns to and fro in so many seconds, with white noise and a wander of this size."""
    rng = np.random.default_rng(seed)
    t = EVERY * np.arange(6000)
    kept = np.exp(-EVERY / TIME)
    drift = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], rng.standard_normal(len(t)))
    rate = 0.02 * np.sin(2.0 * np.pi * t / turning)
    return Sensed(t, rate + wander * drift + NOISE * rng.standard_normal(len(t)), NOISE)


@pytest.mark.parametrize("seed", range(3))
def test_a_wander_that_samples_do_not_have_is_none(seed):
    assert not may_wander([sampled(0.0, seed=seed)], SIZE, TIME)
    assert may_wander([sampled(SIZE, seed=seed)], SIZE, TIME)


@pytest.mark.parametrize("seed", range(3))
def test_a_wander_shows_where_samples_differ_by_it_and_by_no_more(seed):
    assert shows([sampled(SIZE, seed=seed)], SIZE, TIME)
    assert not shows([sampled(0.0, seed=seed)], SIZE, TIME)
    assert not shows([sampled(0.0, turning=3.0, seed=seed)], SIZE, TIME)  # it is the vessel that moves


def test_what_is_much_less_than_the_noise_may_be_there_and_does_not_show():
    white = [sampled(0.0)]
    assert may_wander(white, 0.3 * NOISE, 4.0)
    assert not shows(white, 0.3 * NOISE, 4.0)
    assert not may_wander(white, 1e-2 * NOISE, TIME)  # adds up to nothing
    assert not may_wander(white, 10.0 * NOISE, TIME)  # would be seen from sample to sample


def test_a_log_with_hardly_a_sample_says_nothing():
    few = [Sensed(np.arange(float(n)), np.zeros(n), NOISE) for n in range(4)]
    assert may_wander([sampled(SIZE), *few], NOISE, TIME)
    assert not shows(few, SIZE, TIME)
