"""Offsets of inputs and position from how a vessel responds: its own lag is no delay."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from preprocess_samples import truth_of

from preprocess.chains import Stream
from preprocess.response_clock import excerpts, fixes_of, integrals, response_offsets, stretches, sway_left
from preprocess.trial import Measurement

DURATION = 100.0


def motion(vessel, manoeuvre, seed=0, late=0.0, off=0.0, every=10, first=0, lag=0.0):
    """Exact states every 0.05 s, positions ``off`` late, inputs ``late``; logged every so many hundredths."""
    truth = truth_of(vessel, manoeuvre, DURATION, seed)
    t = np.arange(2.0, DURATION - 2.0, 0.05)

    def at(x, when=t):
        return np.interp(when, truth.t, x)

    c, s = np.cos(truth.psi), np.sin(truth.psi)
    north, east = at(truth.u * c - truth.v * s, t - off), at(truth.u * s + truth.v * c, t - off)
    psi = at(truth.psi)
    states = pd.DataFrame(
        {
            "t": t,
            "x": at(truth.x, t - off),
            "y": at(truth.y, t - off),
            "psi": psi,
            "u": north * np.cos(psi) + east * np.sin(psi),
            "v": -north * np.sin(psi) + east * np.cos(psi),
            "r": at(truth.r),
            "dr": at(np.gradient(truth.r, truth.t)),
        }
    )
    stamps = truth.t[first::every] + late
    inputs = {
        f"a{k}": Measurement(
            f"a{k}", stamps, x, 0.0, np.ones(len(stamps), bool), sample_time=0.01 * every, held=True
        )
        for k, x in enumerate(truth.inputs[first::every].T)
    }
    return states, ((float(t[0]), float(t[-1])),), inputs


def told(*case):
    return {o.stream: o for o in response_offsets(*case)}


@pytest.mark.parametrize(("vessel", "manoeuvre"), [("usv", "zigzag"), ("catamaran", "random")])
@pytest.mark.parametrize("late", [-0.2, 0.3])
def test_inputs_that_are_late_are_told_beside_the_vessels_own_lag(vessel, manoeuvre, late):
    found = told(*motion(vessel, manoeuvre, late=late, every=2))["the inputs"]
    assert found.offset + 0.01 == pytest.approx(
        late, abs=0.01
    )  # orders were logged at once: nothing held them up
    assert abs(found.offset - late) < 3.0 * found.stderr
    assert found.seen


@pytest.mark.parametrize("first", [0, 5, 9])
def test_steps_that_a_slow_logger_held_back_are_within_the_stated_error(first):
    found = told(*motion("usv", "zigzag", first=first))["the inputs"]
    assert abs(found.offset - (0.01 * first - 0.05)) < 0.012
    assert abs(found.offset) < 2.2 * found.stderr
    assert not found.seen


@pytest.mark.parametrize("off", [0.0, 0.15])
def test_positions_that_are_late_are_told_beside_the_sway(off):
    found = told(*motion("catamaran", "random", off=off))["position"]
    assert found.offset == pytest.approx(off, abs=0.012)


def test_what_smoothing_took_from_the_sway_is_put_back():
    """Too smooth a track with its residuals shows the sway of the track as it was."""
    states, segments, _ = motion("usv", "zigzag")
    width = 40
    kernel = np.hanning(2 * width + 1) / np.hanning(2 * width + 1).sum()
    value = states[["x", "y"]].to_numpy()
    smooth = value.copy()
    smooth[width:-width] = np.column_stack([np.convolve(c, kernel, "valid") for c in value.T])
    rate = np.gradient(smooth, states["t"], axis=0)
    c, s = np.cos(states["psi"]), np.sin(states["psi"])
    poor = states.assign(
        x=smooth[:, 0], y=smooth[:, 1], u=rate[:, 0] * c + rate[:, 1] * s, v=-rate[:, 0] * s + rate[:, 1] * c
    )
    t = states["t"].to_numpy()
    good = np.ones(len(t), bool)
    (part,) = stretches(poor, segments, 2.0)
    (whole,) = stretches(states, segments, 2.0)
    left = sway_left(part, fixes_of(Stream("position", t, value, 0, good, good), poor, segments), 0.0)
    true = whole.windows.dot(whole.columns["v"])
    inside = slice(8, -8)
    lost = np.std((part.windows.dot(part.columns["v"]) - true)[inside])
    rest = np.std((part.windows.dot(part.columns["v"]) + left - true)[inside])
    assert rest < 0.1 * lost


def test_averages_of_held_inputs_are_exact_at_any_offset():
    m = Measurement(
        "a", np.array([0.0, 1.0, 3.0]), np.array([1.0, -2.0, 0.5]), 0.0, np.ones(3, bool), held=True
    )
    plain, square = integrals(m).means(np.array([-5.0, 0.5, 2.0, 10.0]))
    np.testing.assert_allclose(plain, [1.0, (0.5 - 2.0) / 1.5, (-2.0 + 0.5 * 7.0) / 8.0])
    np.testing.assert_allclose(square, [1.0, (0.5 - 4.0) / 1.5, (-4.0 + 0.25 * 7.0) / 8.0])


def test_long_logs_give_even_pieces():
    parts = excerpts(((0.0, 900.0), (1000.0, 1300.0)), 200.0, 30.0)
    assert parts[0] == (0.0, 50.0)
    assert parts[-1] == (1000.0, 1050.0)
    assert len(parts) == 4
    assert excerpts(((0.0, 100.0),), 200.0, 30.0) == ((0.0, 100.0),)


def test_motion_beside_inputs_that_never_move_tells_no_offset():
    states, segments, inputs = motion("usv", "zigzag", off=0.15)
    still = {k: replace(m, value=np.full(len(m.t), m.value[0])) for k, m in inputs.items()}
    assert told(states, segments, still) == {}
