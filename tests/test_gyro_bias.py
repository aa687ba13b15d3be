"""A gyro whose zero is off, told by the heading before the turning is smoothed."""

from __future__ import annotations

import numpy as np
import pytest

from preprocess.chains import Stream
from preprocess.driven import smooth_heading
from preprocess.gyro_bias import LEAST, without_bias

#: Noise of the heading, rad, and of the gyro, rad/s: a compass of a degree beside a gyro that is all but exact.
COMPASS, GYRO = 0.0166, 6.5e-4
LASTS = 260.0


def turning(t):
    """Heading, rad, and yaw rate, rad/s, of a vessel in a zigzag."""
    psi = 0.5 * np.sin(0.03 * t) + 0.15 * np.sin(0.081 * t)
    return psi, 0.015 * np.cos(0.03 * t) + 0.01215 * np.cos(0.081 * t)


def streams(bias=0.0, deviation=0.0, seed=0):
    rng = np.random.default_rng(seed)
    t, at = np.arange(0.003, LASTS, 0.04), np.arange(0.001, LASTS, 0.04)
    psi = turning(t)[0] + deviation * np.sin(turning(t)[0]) + COMPASS * rng.standard_normal(len(t))
    rate = turning(at)[1] + bias + GYRO * rng.standard_normal(len(at))
    return tuple(
        Stream(name, when, value[:, None], order, np.full(len(when), True), np.full(len(when), True))
        for order, (name, when, value) in enumerate((("heading", t, psi), ("yaw_rate", at, rate)))
    )


@pytest.mark.parametrize("bias", [-0.03, 0.01, 0.1])
def test_an_offset_is_taken_off(bias):
    gyro = without_bias(streams(bias))[1]
    assert np.mean(gyro.value[:, 0] - turning(gyro.t)[1]) == pytest.approx(0.0, abs=2e-3)


def test_what_has_none_stays_as_it_is():
    for given in (streams(), streams(deviation=0.05), streams(0.3 * LEAST), streams()[:1]):
        assert without_bias(given) is given


def test_samples_that_are_missing_tell_nothing_of_an_offset():
    heading, gyro = streams(0.03)
    few = gyro.t < 0.2 * LASTS
    lost = (heading, Stream("yaw_rate", gyro.t[few], gyro.value[few], 1, gyro.good[few], gyro.candidate[few]))
    assert without_bias(lost) is lost


@pytest.mark.parametrize("seed", range(3))
def test_a_smoothed_yaw_rate_neither_follows_the_offset_nor_jumps_back_from_it(seed):
    """Two noise levels that contradict each other had two answers: one exact gyro, a few samples of it left out."""
    wanted = np.arange(5.0, LASTS - 5.0, 0.2)
    speed = (np.array([0.0, LASTS]), np.array([2.0, 2.0]))
    whole = ((0.0, LASTS),)
    found = smooth_heading(streams(-0.03, seed=seed), speed, whole, wanted, {}, whole)
    assert np.abs(found.mean[:, 1, 0] - turning(wanted)[1]).max() < 3e-3
    assert all(s.good.mean() > 0.98 for s in found.streams)
