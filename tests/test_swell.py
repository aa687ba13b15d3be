"""What known waves leave open in predictions is what waves do to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import trials_of
from scipy.linalg import expm

from identify.prepare import prepare
from identify.stretch import KIND
from identify.swell import RESONANCE, Swell, shown_by
from validate.swell import in_swell

SWELL = Swell(1.7, 0.1, (0.05, 0.08, 0.03))


def stretch():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 3, ())
    return in_swell(prepare(trials, ship.model).identify, SWELL)[0]


def test_each_velocity_swings_by_as_much_as_said():
    here = stretch()
    answers = shown_by(here, 30.0)
    yaw = answers[here.samples.kind == KIND["yaw_rate"], 0]
    assert np.sum(yaw**2, axis=1) == pytest.approx(SWELL.motion[2] ** 2, rel=1e-2)


def test_a_heading_swings_by_the_yaw_rate_over_the_frequency():
    here = stretch()
    answers = shown_by(here, 30.0)
    heading = answers[here.samples.kind == KIND["heading"], 0]
    swing = (heading - heading.mean(axis=0)) ** 2
    assert np.mean(np.sum(swing, axis=1)) == pytest.approx((SWELL.motion[2] / SWELL.frequency) ** 2, rel=0.1)


def test_nothing_is_left_open_where_no_waves_are_known():
    assert shown_by(in_swell((stretch(),), None)[0], 30.0).shape[2] == 0


@given(st.floats(0.3, 6.0), st.floats(0.03, 0.2), st.floats(10.0, 120.0))
def test_swings_are_of_unit_variance_at_any_time(frequency, share, length):
    band = Swell(frequency, share * frequency, (1.0, 1.0, 1.0))
    waves = band.waves(np.linspace(0.0, length, 50), length)
    assert np.sum(waves**2, axis=1) == pytest.approx(1.0)


def test_a_skirt_pushes_slowly_and_a_bare_band_does_not():
    slow = [fft_power(replace(SWELL, skirt=share), 0.35 * SWELL.frequency) for share in (0.0, 1.0)]
    assert slow[1] > 20.0 * slow[0]


def fft_power(swell, omega):
    t = np.linspace(0.0, 30.0, 600)
    left = swell.along(t, 0, 30.0)
    wave = np.exp(-1j * omega * t) * np.hanning(len(t))
    return np.sum(np.abs(wave @ left) ** 2)


@pytest.mark.parametrize("share", [0.6, 1.6])
def test_a_whole_skirt_is_between_those_of_a_resonances_displacement_and_velocity(share):
    omega, damping, h, n = 2.0, 0.05, 0.02, 150_000
    step = expm(np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping]]) * h)
    rng, state, path = np.random.default_rng(1), np.zeros(2), np.zeros((n, 2))
    for k, push in enumerate(rng.standard_normal(n) * np.sqrt(h)):
        state = step @ state + [0.0, push]
        path[k] = state
    t = np.arange(1500) * h
    wave = np.exp(-1j * share * omega * t) * np.hanning(1500)
    each = (path / path.std(axis=0)).reshape(-1, 1500, 2)
    seen = np.sort(np.mean(np.abs(np.einsum("t,wtk->wk", wave, each)) ** 2, axis=0))
    band = Swell(omega, damping / RESONANCE, (1.0, 0.0, 0.0), skirt=1.0)
    said = np.sum(np.abs(wave @ band.waves(t, 30.0)) ** 2)
    assert 0.8 * seen[0] < said < 1.25 * seen[1]
