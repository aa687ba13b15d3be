"""What sensors are and where they sit: saturation, arms, magnetic heading, latency, course; clocks of inputs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from preprocess_samples import Imperfect, sampled, table, truth_of

from ingest.log import Log, Source
from preprocess.judge import judge, saturated
from preprocess.raw import Raw
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.turns import untold, with_turns
from preprocess.vessel import Sensor

PLAIN = {
    "position": Imperfect(5.0, 0.02),
    "heading": Imperfect(10.0, 0.005),
    "yaw_rate": Imperfect(20.0, 0.003),
}


def trial_of(made, log=None, vessel=None, sensors=None):
    run = LoggedRun("a", log or made.log, "identify")
    return make_trials([run], vessel or made.vessel, made.inputs, sensors or made.sensors, by_response=False)[
        0
    ]


def with_table(made, name, frame, **options):
    """The log with another table for a quantity, recognised by a source with these options."""
    source = Source(name, name, {"value": "value"}, "rad", None, 50.0, options)
    return replace(made.log, sources=(source,), tables={**made.log.tables, name: frame})


def off(trial, truth, name):
    s = trial.states
    inside = (s["t"] > 3.0) & (s["t"] < truth.t[-1] - 3.0)
    return (s[name] - np.interp(s["t"], truth.t, getattr(truth, name)))[inside].to_numpy()


def test_a_gyro_at_the_end_of_its_range_is_not_believed():
    truth = truth_of("usv", "zigzag", 80.0)
    made = sampled(truth, **PLAIN)
    limit = 0.7 * np.abs(truth.r).max()
    gyro = made.log.tables["yaw_rate"]
    clipped = replace(made.log, tables={**made.log.tables, "yaw_rate": gyro.clip(-limit, limit)})
    trial = trial_of(made, clipped)
    beyond = (gyro["value"].abs() >= limit).sum()
    assert trial.measurements["yaw_rate"].reasons["saturated"] == beyond > 20
    assert np.abs(trial.states["r"]).max() > 1.2 * limit
    assert np.sqrt(np.mean(off(trial, truth, "r") ** 2)) < 0.012


@given(st.integers(0, 1000), st.sampled_from([0.0, 1e-3, 1e-2]))
@settings(max_examples=40, deadline=None)
def test_natural_extremes_are_no_saturation(seed, quantum):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 60.0, 0.1)
    x = 0.3 * np.sin(rng.uniform(0.1, 1.0) * t) + rng.normal(0.0, 0.003, len(t))
    x = np.round(x / quantum) * quantum if quantum else x
    assert not saturated(x, quantum).any()


def test_a_velocity_along_the_hull_is_moved_from_where_its_sensor_sits():
    truth, arm = truth_of("usv", "zigzag", 60.0), (1.2, -0.4)
    made = sampled(truth, **PLAIN)
    t = np.arange(0.0, 60.0, 0.2)
    u, v, r = (np.interp(t, truth.t, getattr(truth, k)) for k in ("u", "v", "r"))
    noise = np.random.default_rng(1).normal(0.0, 0.01, (2, len(t)))
    value = np.column_stack([u - arm[1] * r + noise[0], v + arm[0] * r + noise[1]])
    log = replace(made.log, tables={**made.log.tables, "dvl": table(t, ["f", "s"], value)})
    sensors = {
        **made.sensors,
        "velocity": Sensor("velocity", {"forward": "dvl.f", "starboard": "dvl.s"}, "m/s"),
    }
    trial = trial_of(made, log, replace(made.vessel, imu=arm), sensors)
    wrong = trial_of(made, log, made.vessel, sensors)
    assert np.abs(off(trial, truth, "v")).mean() < 0.006
    logged = trial.measurements["velocity"]
    c, d, u, v = (f(logged.t) for f in (
        lambda t: np.cos(np.interp(t, truth.t, truth.psi)), lambda t: np.sin(np.interp(t, truth.t, truth.psi)),
        lambda t: np.interp(t, truth.t, truth.u), lambda t: np.interp(t, truth.t, truth.v)))  # fmt: skip
    ground = np.column_stack([u * c - v * d, u * d + v * c])
    assert np.sqrt(np.mean((logged.value - ground)[logged.good] ** 2)) < 1.2 * 0.01
    assert np.abs(off(wrong, truth, "v")).mean() > 0.02


def test_a_magnetic_heading_gets_the_variation_and_a_true_one_does_not():
    truth, variation = truth_of("usv", "zigzag", 30.0), np.radians(7.0)
    made = sampled(truth, **PLAIN)
    vessel = replace(made.vessel, magnetic_variation=variation)
    sensors = {k: v for k, v in made.sensors.items() if k != "heading"}
    frame = made.log.tables["heading"] - variation
    magnetic = trial_of(made, with_table(made, "heading", frame, magnetic=True), vessel, sensors)
    true = trial_of(made, with_table(made, "heading", frame), vessel, sensors)
    assert np.mean(off(magnetic, truth, "psi")) == pytest.approx(0.0, abs=0.005)
    assert np.mean(off(true, truth, "psi")) == pytest.approx(-variation, abs=0.005)


def test_the_latency_of_each_sensor_is_its_own():
    truth, late = truth_of("usv", "zigzag", 60.0), {"position": 0.4, "heading": 0.0, "yaw_rate": 0.25}
    made = sampled(truth, **{k: replace(v, delay=late[k]) for k, v in PLAIN.items()})
    sensors = {k: replace(s, latency=late[k]) for k, s in made.sensors.items()}
    trial = trial_of(made, sensors=sensors)
    for name, sigma in (("u", 0.03), ("v", 0.03), ("r", 0.006)):
        assert np.sqrt(np.mean(off(trial, truth, name) ** 2)) < sigma, name
    assert not [f for f in trial.findings if "stamps" in f]


def test_a_course_over_ground_is_a_velocity_and_no_heading():
    truth = truth_of("usv", "zigzag", 60.0)
    made = sampled(truth, **PLAIN)
    t = np.arange(0.0, 60.0, 0.2)
    u, v, psi = (np.interp(t, truth.t, getattr(truth, k)) for k in ("u", "v", "psi"))
    value = np.column_stack([np.hypot(u, v), np.degrees(psi + np.arctan2(v, u)) % 360.0])
    frame = table(t, ["speed", "course"], value)
    source = Source("velocity", "vtg", {"speed": "speed", "course": "course"}, "deg", None, 50.0, {})
    log = Log(Path("a"), "made", {**made.log.tables, "vtg": frame}, sources=(source,))
    trial = trial_of(made, log)
    drift = np.arctan2(trial.states["v"], trial.states["u"])
    assert np.abs(drift).max() > np.radians(4.0)  # heading and course differ, and stay apart
    assert trial.measurements["velocity"].sigma < 0.02
    assert np.abs(off(trial, truth, "psi")).max() < 0.02


@pytest.mark.parametrize("turned", [3.6, 5.5])
@pytest.mark.parametrize("gyro", ["heard", "silent too", "none"])
def test_a_compass_that_is_silent_for_more_than_half_a_turn_loses_none(gyro, turned):
    """By the gyro's word; without it by the rates before and after, or the stretch ends there."""
    truth = truth_of("catamaran", "circle", 90.0)
    made = sampled(truth, **PLAIN)
    heading = made.log.tables["heading"]
    t = heading.index.to_numpy() * 1e-9
    way = np.abs(truth.psi - np.interp(20.0, truth.t, truth.psi))
    end = truth.t[(truth.t > 20.0) & (way > turned)][0]
    tables = {**made.log.tables, "heading": heading[(t < 20.0) | (t > end)]}
    sensors = {k: v for k, v in made.sensors.items() if k != "yaw_rate" or gyro != "none"}
    if gyro == "silent too":
        during = made.log.tables["yaw_rate"].index.to_numpy() * 1e-9
        tables["yaw_rate"] = tables["yaw_rate"][(during < 20.0) | (during > end)]
    trial = trial_of(made, replace(made.log, tables=tables), sensors=sensors)
    assert len(trial.segments) == (1 if gyro == "heard" else 2)
    for begin, last in trial.segments:
        s = trial.states[trial.states["t"].between(begin + 1.0, last - 1.0)]
        off_by = (s["psi"] - np.interp(s["t"], truth.t, truth.psi)).to_numpy()
        assert np.abs(off_by - np.median(off_by)).max() < 0.3
        assert np.sqrt(np.mean((s["r"] - np.interp(s["t"], truth.t, truth.r)) ** 2)) < 0.03


def test_a_steady_turn_goes_on_while_nothing_tells_it():
    """Half a turn and more in a gap of both sensors, as long a gap as tells nothing wrong anywhere in the log."""
    t = np.arange(0.0, 200.0, 0.1)
    rate = 1.5 + 0.3 * np.sin(0.2 * t) + np.random.default_rng(1).normal(0.0, 0.01, len(t))
    psi = np.cumsum(rate) * 0.1
    kept = (t < 90.0) | (t > 93.0)
    measured = np.angle(np.exp(1j * psi[kept]))
    for told in ({"yaw_rate": rate}, {}):
        judged = {"heading": judged_of("heading", t[kept], measured)}
        judged |= {k: judged_of(k, t[kept], v[kept]) for k, v in told.items()}
        assert judged["heading"].raw.value[-1] - psi[kept][-1] == pytest.approx(-2.0 * np.pi, abs=0.01)
        turned = with_turns(judged)
        np.testing.assert_allclose(turned["heading"].raw.value, psi[kept], atol=1e-6)
        assert not untold(turned).any()


def judged_of(quantity, t, value):
    source = Source(quantity, quantity, {"value": "value"}, "rad", None, 50.0, {})
    return judge(Raw(quantity, t, value, np.zeros(len(t), dtype=bool), source))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("every", [40.0, 0.05])
@pytest.mark.parametrize("count", range(9))
def test_of_a_few_headings_nothing_is_told_and_nothing_fails(count, every):
    t = np.arange(count) * every
    for told in ({}, {"yaw_rate": judged_of("yaw_rate", t[:3], 0.1 * t[:3] % 0.7)}):
        judged = {"heading": judged_of("heading", t, 0.9 * t % 2.0), **told}
        assert len(untold(with_turns(judged))) == max(0, count - 1)


def test_a_gap_whose_turns_nothing_tells_is_not_bridged():
    """A motion that changes its mind every few seconds, as fast as this: nobody knows how often it went round."""
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 120.0, 0.1)
    rate = np.repeat(rng.choice([-2.5, 2.5], 40), 30) + rng.normal(0.0, 0.01, 1200)
    psi = np.cumsum(rate) * 0.1
    silent = (t > 60.0) & (t < 64.0)
    for told in ({"yaw_rate": rate[~silent]}, {"yaw_rate": rate}, {}):
        tt = {k: t if len(v) == len(t) else t[~silent] for k, v in told.items()}
        judged = {"heading": judged_of("heading", t[~silent], np.angle(np.exp(1j * psi[~silent])))}
        judged |= {k: judged_of(k, tt[k], v) for k, v in told.items()}
        lost = untold(with_turns(judged))
        known = "yaw_rate" in told and len(told["yaw_rate"]) == len(t)
        assert lost.sum() == (0 if known else 1)
        assert lost[np.argmax(np.diff(t[~silent]))] != known
