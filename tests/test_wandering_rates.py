"""A gyro, or a receiver's velocity, whose errors wander is told by what its integral should be."""

from __future__ import annotations

from dataclasses import replace

import pytest
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.kernel import VELOCITY, YAW_RATE
from identify.prepare import prepare
from preprocess.compass import turning_errors, with_heading_wander
from preprocess.receiver import moving_wanders, with_velocity_wander

LOGS = ("zigzag", "random", "circle", "zigzag")
#: Variance that is added up in a second by a gyro whose zero moves, and by a velocity that is filtered.
GYRO = Sensor(20.0, 0.003, wander=0.005, wander_time=5.0)
FILTERED = Sensor(5.0, 0.03, wander=0.03, wander_time=1.0)
#: A position as a receiver's filter leaves it, m.
SMOOTH = Sensor(5.0, 0.05, wander=0.8, wander_time=40.0, smooth=True)
CALM, FIX, QUIET = Sensor(5.0, 0.03), Suite().position, Suite().yaw_rate


def sailed(gyro=QUIET, velocity=None, position=FIX, seed=1):
    suite = replace(Suite(), yaw_rate=gyro, velocity=velocity, position=position)
    return trials_of("usv", LOGS, 90.0, seed, validate=0, suite=suite)[1]


def added(size, time):
    """What a wander's integral varies by in a second, at length."""
    return 2.0 * size**2 * time


@pytest.mark.parametrize("seed", range(3))
def test_a_gyro_that_wanders_is_told_from_a_compass_that_does(seed):
    found = turning_errors(sailed(GYRO, seed=seed))[0]
    assert found.own is None
    assert added(found.rate.size, found.rate.time) / added(0.005, 5.0) == pytest.approx(1.0, abs=0.7)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("rate", "noise"), [(10.0, 0.0015), (5.0, 0.0008)])
def test_a_compass_that_wanders_is_not_held_for_a_gyro_that_does_nor_for_what_that_misses(rate, noise, seed):
    """A gyro's noise adds up faster than its samples say by no more than they bend."""
    compass = Sensor(10.0, 0.006, wander=0.006, wander_time=35.0)
    suite = replace(Suite(), heading=compass, yaw_rate=Sensor(rate, noise), shared_attitude=False)
    found = turning_errors(trials_of("patrol", LOGS, 240.0, seed, validate=0, suite=suite)[1])[0]
    assert found.rate is None
    assert found.own.size == pytest.approx(0.006, rel=0.6)


@pytest.mark.parametrize("seed", range(3))
def test_a_velocity_that_is_filtered_is_told_by_the_positions(seed):
    found = moving_wanders(sailed(velocity=FILTERED, seed=seed))
    assert found.own is None
    assert added(found.rate.size, found.rate.time) / added(0.03, 1.0) == pytest.approx(1.0, abs=0.7)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_white_does_not_wander(seed):
    trials = sailed(Sensor(20.0, 0.003), CALM, seed=seed)
    assert turning_errors(trials)[0].rate is None
    assert moving_wanders(trials).rate is None
    assert with_velocity_wander(trials) == list(trials)


def test_a_receiver_whose_positions_drift_need_not_have_velocities_that_do():
    drifting = Sensor(5.0, 0.05, wander=0.5, wander_time=40.0)
    assert moving_wanders(sailed(velocity=CALM, position=drifting)).rate is None


@pytest.mark.parametrize("seed", range(3))
def test_a_position_that_wanders_smoothly_is_not_held_for_a_velocity_that_does(seed):
    """Within the minutes of a log both look alike; satellites move a position by metres."""
    trials = sailed(velocity=CALM, position=SMOOTH, seed=seed)
    found = moving_wanders(trials)
    assert found.rate is None
    assert found.own.smooth
    assert found.own.size / found.own.time**1.5 == pytest.approx(0.8 / 40.0**1.5, rel=0.5)
    for t in with_velocity_wander(trials):
        assert t.measurements["position"].smooth
        (said,) = [f for f in t.findings if "position wander" in f]
        assert "wander smoothly" in said


def test_a_known_smooth_wander_of_positions_is_noise_and_no_structure():
    """Taken for a velocity that wanders, what the hull really did is believed less than where it was said to be."""
    trials = with_velocity_wander(sailed(velocity=CALM, position=SMOOTH))
    rough = [replace(t, measurements={**t.measurements, "position": rough_of(t)}) for t in trials]
    chi2 = []
    for told in (rough, trials):
        prepared = prepare(told, "modulus")
        chi2.append(fit_from_scratch(prepared.structure, prepared.identify).chi2_per_dof)
    assert chi2[1] == pytest.approx(1.0, abs=0.05)
    assert chi2[0] > chi2[1] + 0.03


def rough_of(trial):
    return replace(trial.measurements["position"], wander=0.0, smooth=False)


def test_positions_and_velocities_of_two_receivers_are_not_held_against_each_other():
    def of_two(t):
        velocity = replace(t.measurements["velocity"], sender="the other")
        return replace(t, measurements={**t.measurements, "velocity": velocity})

    assert moving_wanders([of_two(t) for t in sailed(velocity=FILTERED)]).rate is None
    assert moving_wanders(sailed()).rate is None  # without any


def test_a_log_without_positions_or_of_another_receiver_is_left_as_it_was():
    """What the others tell of their velocities is told of theirs."""
    first, second, *others = sailed(velocity=FILTERED)
    alone = replace(first, measurements={k: m for k, m in first.measurements.items() if k != "position"})
    velocity = replace(second.measurements["velocity"], sender="the other")
    another = replace(second, measurements={**second.measurements, "velocity": velocity})
    found = with_velocity_wander([alone, another, *others])
    assert found[:2] == [alone, another]
    assert all(t.measurements["velocity"].wander > 0.0 for t in found[2:])


@pytest.mark.parametrize(
    ("known", "kind", "name", "sensors"),
    [(with_heading_wander, YAW_RATE, "yaw rate", {"gyro": GYRO}),
     (with_velocity_wander, VELOCITY, "velocity", {"velocity": FILTERED})],
)  # fmt: skip
def test_a_known_wander_of_a_rate_is_noise_and_no_structure(known, kind, name, sensors):
    trials = sailed(**sensors)
    chi2, slow = [], []
    for told in (trials, known(trials)):
        prepared = prepare(told, "modulus")
        fitted = fit_from_scratch(prepared.structure, prepared.identify)
        chi2.append(fitted.chi2_per_dof)
        slow.append(fitted.problem.dispersed.inflation[kind])
    assert all(any(f"errors of the {name} wander" in f for f in t.findings) for t in known(trials))
    assert slow[0] > 2.0 > 1.3 > slow[1]
    assert chi2[0] > 1.1 > chi2[1]


def test_states_that_followed_a_wander_are_less_sure():
    for known, sensors, states in (
        (with_heading_wander, {"gyro": GYRO}, "r"), (with_velocity_wander, {"velocity": FILTERED}, "uv")
    ):  # fmt: skip
        trials = sailed(**sensors)
        for before, after in zip(trials, known(trials), strict=True):
            for k in states:
                assert after.states[f"sigma_{k}"].mean() > 1.1 * before.states[f"sigma_{k}"].mean()


@pytest.mark.parametrize("seed", range(3))
def test_a_smooth_wander_that_may_be_either_s_is_half_of_each(seed):
    """A compass within the minutes of a log looks like a gyro that drifts, and both of them do."""
    compass = Sensor(10.0, 0.006, wander=0.02, wander_time=40.0, smooth=True)
    suite = replace(Suite(), heading=compass, yaw_rate=Sensor(10.0, 0.001), shared_attitude=False)
    found = turning_errors(trials_of("patrol", LOGS, 240.0, seed, validate=0, suite=suite)[1])[0]
    assert found.own.smooth
    assert found.own.size / found.own.time**1.5 == pytest.approx(0.5**0.5 * 0.02 / 40.0**1.5, rel=0.5)
    assert not found.rate.smooth
