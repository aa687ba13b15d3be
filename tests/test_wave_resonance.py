"""The frequency of waves is that of the resonance which makes them, however few of them a window holds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from validate.error_spectra import _transform
from validate.peaks import core_of
from validate.wave_resonance import resonance_of

WINDOW, WINDOWS, STEP = 30.0, 24, 0.02


def swinging(frequency, damping, rng):
    """Accelerations of a resonance's velocity, that white noise drives."""
    count, settled = round(WINDOW * WINDOWS / STEP) + 1, round(300.0 / STEP)
    matrix = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * damping * frequency]])
    kept = cont2discrete((matrix, np.array([[0.0], [1.0]]), np.eye(2), np.zeros((2, 1))), STEP)[0]
    poles = [1.0, -np.trace(kept), np.linalg.det(kept)]
    return lfilter([0.0, 1.0, -1.0], poles, rng.standard_normal(count + settled))[-count:]


def spectra(seen):
    """Frequencies, and densities (w, f, c) of what (n, c) sensors show in each window."""
    omega = np.pi / WINDOW * np.arange(3, 40)
    t, each = STEP * np.arange(len(seen)), []
    for begin in WINDOW * np.arange(WINDOWS):
        inside = np.nonzero((t >= begin) & (t < begin + WINDOW))[0][::10]
        shown = _transform(t[inside], seen[inside], begin, begin + WINDOW, omega)
        each.append(np.mean(np.abs(shown) ** 2, axis=0))
    return omega, np.array(each)


class Line:
    """What ``core_of`` reads of spectra."""

    def __init__(self, omega):
        self.omega, self.spacing = omega, omega[1] - omega[0]


def measured(accelerations, times, seed=0):
    """What a band shows of accelerations (n, c), integrated so many ``times``, beside a little noise."""
    shown = accelerations
    for _ in range(times):
        shown = lfilter([STEP], [1.0, STEP * 0.05 - 1.0], shown, axis=0)
    noise = np.random.default_rng(seed).standard_normal(shown.shape)
    omega, power = spectra(shown + 0.05 * shown.std(axis=0) * noise)
    order = np.full(shown.shape[1], 2.0 * times)
    peak = np.argmax(power.mean(axis=0)[:, 0] * omega ** order[0])
    core = core_of(Line(omega), omega[peak])
    level = np.tile(power.mean(axis=0).min(axis=0), (core.sum(), 1))
    windows = np.arange(WINDOWS)
    return resonance_of(omega[core], power[:, core], level, order, [windows, windows // 6])


@pytest.mark.parametrize("frequency", [0.75, 2.0])
@pytest.mark.parametrize("times", [1, 2], ids=["velocities", "positions"])
def test_a_resonance_is_told_with_its_damping_and_doubt(frequency, times):
    """Also where a window holds three or four waves, and the band that they show is not even about their frequency."""
    rng = np.random.default_rng(7)
    found = [
        measured(np.column_stack([swinging(frequency, 0.04, rng) for _ in range(2)]), times) for _ in range(8)
    ]
    away = np.array([f.frequency / frequency - 1.0 for f in found])
    doubt = np.array([max(f.stderrs) for f in found]) / frequency
    assert abs(away.mean()) < 0.006
    assert np.sqrt(np.mean((away / doubt) ** 2)) < 1.8
    assert np.median([f.damping for f in found]) == pytest.approx(0.04, rel=0.3)


def test_a_line_is_told_to_a_small_part_of_a_spectrums_interval():
    t = STEP * np.arange(round(WINDOW * WINDOWS / STEP) + 1)
    found = measured(np.sin(1.93 * t)[:, None], 1)
    assert found.frequency == pytest.approx(1.93, rel=0.003)
    assert np.pi / WINDOW / 1.93 > 0.05


def test_one_group_says_nothing_of_its_own_doubt():
    found = swinging(2.0, 0.04, np.random.default_rng(3))[:, None]
    omega, power = spectra(lfilter([STEP], [1.0, STEP - 1.0], found, axis=0))
    core = core_of(Line(omega), 2.0)
    level = np.full((core.sum(), 1), power.min())
    alike = np.zeros(WINDOWS)
    assert resonance_of(omega[core], power[:, core], level, np.array([2.0]), [alike]).stderrs == (0.0,)
