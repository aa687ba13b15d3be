"""Samples within a step, or half of one, taken together: what they say stays, and there are fewer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import trials_of
from scipy.interpolate import CubicSpline

from identify.kernel import HEADING, YAW_RATE
from identify.merged import merged
from identify.prepare import with_pooled_noise
from identify.stretch import Samples, stretches_of


def fast(kind, rate, noise=0.0, sigma=0.01):
    """A stretch whose only sensor says at ``rate``, Hz, what the smoothed motion is, and noise."""
    _, trials = trials_of("catamaran", ("zigzag",), 40.0, 1, ())
    stretch = stretches_of(with_pooled_noise(trials)[0], 0.2)[0]
    t = stretch.start + np.arange(0.0, stretch.steps * stretch.h, 1.0 / rate)
    column = {HEADING: 2, YAW_RATE: 5}[kind]
    true = CubicSpline(stretch.grid, stretch.states[:, column])
    value = np.zeros((len(t), 2))
    value[:, 0] = true(t) + noise * np.random.default_rng(0).standard_normal(len(t))
    samples = Samples(t, np.full(len(t), kind), value, np.full(len(t), sigma))
    return replace(stretch, samples=samples), true


@pytest.mark.parametrize("kind", [HEADING, YAW_RATE])
def test_means_of_a_bent_path_lie_on_it(kind):
    stretch, true = fast(kind, 100.0)
    samples = merged(stretch).samples
    assert len(samples.t) < 0.06 * len(stretch.samples.t)
    assert samples.value[:, 0] == pytest.approx(true(samples.t), abs=1e-9)


def test_noise_falls_as_that_of_a_mean():
    stretch, true = fast(YAW_RATE, 100.0, noise=0.01)
    samples = merged(stretch).samples
    inside = samples.sigma < 1.2 * samples.sigma.min()
    error = (samples.value[:, 0] - true(samples.t))[inside]
    assert samples.sigma[inside].mean() == pytest.approx(0.01 / np.sqrt(100.0 * 0.2), rel=0.06)
    assert error.std() == pytest.approx(samples.sigma[inside].mean(), rel=0.15)


@pytest.mark.parametrize(("rate", "interval"), [(12.0, 0.2), (7.0, 1.0 / 7.0)], ids=["faster", "slower"])
def test_a_sensor_that_is_faster_than_half_a_step_says_one_thing_in_each(rate, interval):
    """A step is 0.2 s: of seven samples a second those alone go together that came within half of one."""
    stretch, _ = fast(HEADING, rate)
    assert np.mean(np.diff(merged(stretch).samples.t)) == pytest.approx(interval, rel=0.02)


def test_what_comes_seldom_stays_as_it_is():
    stretch, _ = fast(HEADING, 5.0)
    assert merged(stretch) is stretch
