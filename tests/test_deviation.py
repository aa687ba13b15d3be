"""What a compass deviates by with the heading: told by the gyro, taken off where it is small, said where it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_compass import WANDERING, sailed

from preprocess.compass import turning_errors, with_heading_wander

ZIGZAGS = ("zigzag",) * 4


def deviated(trial, swing):
    """The trial with headings, and motion smoothed along them, as of a compass that deviates once and twice around."""
    psi = trial.states["psi"]
    off = swing * np.sin(psi) + 0.3 * swing * np.cos(2.0 * psi)
    along = (trial.states["u"] + 1j * trial.states["v"]) * np.exp(-1j * off)
    states = trial.states.assign(psi=psi + off, u=along.to_numpy().real, v=along.to_numpy().imag)
    m = trial.measurements["heading"]
    shown = m.value + swing * np.sin(m.value) + 0.3 * swing * np.cos(2.0 * m.value)
    return replace(
        trial, states=states, measurements={**trial.measurements, "heading": replace(m, value=shown)}
    )


def rms(x):
    return float(np.sqrt(np.nanmean(np.square(np.asarray(x, dtype=float)))))


@pytest.mark.parametrize("swing", [0.01, -0.006])
def test_a_small_deviation_is_taken_off_headings_and_motion_and_said(swing):
    trials = sailed(seconds=240.0)
    made = with_heading_wander([deviated(t, swing) for t in trials])
    assert turning_errors([deviated(t, swing) for t in trials])[1].parts == pytest.approx(
        [swing, 0.0, 0.0, 0.3 * swing], abs=0.0025
    )
    for true, shown in zip(trials, made, strict=True):
        off = shown.measurements["heading"].value - true.measurements["heading"].value
        assert rms(off - np.mean(off)) < 0.35 * rms(deviated(true, swing).states["psi"] - true.states["psi"])
        for k in ("psi", "v"):
            wrong = deviated(true, swing).states[k] - true.states[k]
            assert rms(shown.states[k] - true.states[k]) < 0.5 * rms(wrong)
        assert any("deviates" in words and "taken off" in words for words in shown.findings)


def test_a_large_deviation_is_said_and_left_to_the_diagnosis():
    trials = [deviated(t, 0.12) for t in sailed(seconds=240.0)]
    for before, after in zip(trials, with_heading_wander(trials), strict=True):
        np.testing.assert_array_equal(
            after.measurements["heading"].value, before.measurements["heading"].value
        )
        assert any("swing the compass" in words for words in after.findings)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("heading", [None, WANDERING], ids=["white", "wandering"])
def test_a_compass_that_only_errs_by_chance_does_not_deviate(seed, heading):
    trials = sailed(seed=seed) if heading is None else sailed(heading, seed=seed)
    assert turning_errors(trials)[1] is None


@pytest.mark.parametrize("seed", range(3))
def test_headings_within_some_tens_of_degrees_make_none_up(seed):
    assert turning_errors(sailed(logs=ZIGZAGS, seed=seed))[1] is None
