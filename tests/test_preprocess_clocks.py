"""Offsets between clocks: found where the motion tells, not claimed where it cannot."""

from dataclasses import replace

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled, truth_of

from preprocess.chains import Stream
from preprocess.gyro_clock import excerpts, well_inside, yaw_rate_offset
from preprocess.run_of_log import LoggedRun
from preprocess.smoother import smooth_chain
from preprocess.trials import make_trials

DURATION = 90.0


def trial_of(vessel, manoeuvre, seed, delay):
    made = sampled(
        truth_of(vessel, manoeuvre, DURATION, seed),
        seed,
        position=Imperfect(5.0, 0.02),
        heading=Imperfect(10.0, 0.01),
        yaw_rate=Imperfect(20.0, 0.003, delay=delay),
    )
    return make_trials([LoggedRun("a", made.log, "identify")], made.vessel, made.inputs, made.sensors)[0]


def offset_of(trial):
    (step,) = [s for s in trial.history if s.action == "clock_offsets"]
    return step.arguments.get("yaw_rate", (None, 0.0, np.inf, None))[1:3]


@pytest.mark.parametrize("delay", [0.0, 0.3])
@pytest.mark.parametrize("vessel", ["usv", "tanker", "catamaran"])
@pytest.mark.parametrize("manoeuvre", ["circle", "zigzag"])
def test_a_late_yaw_rate_is_found_and_only_that(vessel, manoeuvre, delay):
    trial = trial_of(vessel, manoeuvre, 1, delay)
    found, stderr = offset_of(trial)
    assert abs(found - delay) < max(4.0 * stderr, 0.02)
    assert any("stamps of yaw_rate" in f for f in trial.findings) == (delay > 0.0)


@pytest.mark.parametrize("times", [-1.0, 57.3, 0.0175])
def test_a_wrong_sign_or_unit_is_not_called_a_clock(times):
    made = sampled(
        truth_of("usv", "zigzag", DURATION, 1),
        1,
        position=Imperfect(5.0, 0.02),
        heading=Imperfect(10.0, 0.01),
        yaw_rate=Imperfect(20.0, 0.003),
    )
    tables = {**made.log.tables, "yaw_rate": times * made.log.tables["yaw_rate"]}
    log = replace(made.log, tables=tables)
    (trial,) = make_trials([LoggedRun("a", log, "identify")], made.vessel, made.inputs, made.sensors)
    assert any(f.startswith("The yaw rate is") for f in trial.findings)
    assert not any("stamps of yaw_rate" in f for f in trial.findings)
    assert offset_of(trial) == (0.0, np.inf)


def turn(rate_of, longer=0.0):
    """Compass and gyro of a turn, the gyro logged longer at both ends."""
    rng = np.random.default_rng(3)
    t, g = np.arange(0.0, 60.0, 0.2), np.arange(-longer, 60.0 + longer, 0.05)
    psi = np.cumsum(rate_of(np.arange(0.0, 60.0, 0.2))) * 0.2
    every = np.ones(len(t), bool), np.ones(len(g), bool)
    compass = Stream("heading", t, (psi + rng.normal(0.0, 0.01, len(t)))[:, None], 0, every[0], every[0])
    values = (rate_of(g) + rng.normal(0.0, 0.003, len(g)))[:, None]
    return compass, Stream("yaw_rate", g, values, 1, every[1], every[1])


@pytest.mark.parametrize("longer", [0.0, 5.0])
def test_an_even_turn_says_nothing_of_clocks(longer):
    streams = turn(lambda t: np.full(len(t), 0.2), longer)
    segments = ((0.0, 59.8),)
    found = yaw_rate_offset(smooth_chain(streams, segments, streams[0].t), segments)
    assert found is None or not found.seen


def test_moving_stamps_changes_no_number_of_samples():
    _, gyro = turn(np.sin, 5.0)
    kept = well_inside(gyro, ((0.0, 59.8),))
    times = gyro.t[kept.good]
    assert times.min() >= 1.5
    assert times.max() <= 58.3
    assert kept.good.sum() > 1000


def test_long_logs_are_sampled_in_even_parts():
    t = np.arange(0.0, 4000.0, 0.05)
    every = np.ones(len(t), bool)
    stream = Stream("yaw_rate", t, t[:, None], 1, every, every)
    parts = excerpts((stream,), ((0.0, 2500.0), (2600.0, 4000.0)))
    low, high = np.array(parts).T
    assert (low[1:] > high[:-1]).all()
    assert low[0] == 0.0
    assert high[-1] == 4000.0
    assert (high - low).sum() * 20.0 == pytest.approx(12_000, rel=0.3)
    short = replace(stream, t=t[:100], value=t[:100, None], good=every[:100], candidate=every[:100])
    assert excerpts((short,), ((0.0, 5.0),)) == ((0.0, 5.0),)


def test_a_gyro_that_is_noisy_beside_the_compass_is_as_noisy_as_it_shows_by_itself():
    """Its scale is off: what contradicts the compass is no noise, and must not blur its clock."""
    compass, gyro = turn(lambda t: 0.3 * np.sin(0.5 * t))
    late = replace(gyro, t=gyro.t + 0.05, value=0.93 * gyro.value)
    segments = ((0.0, 59.8),)
    chain = smooth_chain((compass, late), segments, compass.t)
    given = tuple(
        replace(s, sigma=max(float(x), 0.02)) for s, x in zip(chain.streams, chain.levels.sigma, strict=True)
    )
    plain, told = (yaw_rate_offset(c, segments) for c in (chain, replace(chain, streams=given)))
    assert plain.offset == pytest.approx(0.15, abs=0.015)  # the sums of `turn` run ahead by half a step
    assert told.offset == pytest.approx(plain.offset, abs=1e-6)


def test_neither_of_two_sensors_that_contradict_each_other_is_followed_exactly():
    """The scale of the gyro is off, and both are smooth: the compass is not called noisy for it, nor the gyro exact."""
    t = np.arange(0.0, 80.0, 0.1)
    rate = 0.3 * np.sin(0.4 * t) * np.sin(0.05 * t)
    every, rng = np.ones(len(t), bool), np.random.default_rng(1)
    psi = np.cumsum(rate) * 0.1 + rng.normal(0.0, 2e-4, len(t))
    compass = Stream("heading", t, psi[:, None], 0, every, every)
    gyro = Stream("yaw_rate", t, 0.94 * rate[:, None] + rng.normal(0.0, 1e-5, (len(t), 1)), 1, every, every)
    chain = smooth_chain((compass, gyro), ((0.0, 79.9),), t)
    assert chain.levels.sigma[0] < 1e-3
    assert chain.levels.sigma[1] > 2e-3
