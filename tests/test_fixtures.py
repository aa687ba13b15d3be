"""The truth simulator against physics and against the models that it claims to be."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fixtures.campaign import DEFAULT_SUITE
from fixtures.draw import LIBRARY, make_effect
from fixtures.dynamics import OPEN
from fixtures.effects import Effect, World
from fixtures.forces import WorldNumbers, derivative
from fixtures.manoeuvres import MANOEUVRES, Leg, Manoeuvre, make_manoeuvre
from fixtures.outside import OUTSIDE
from fixtures.sensors import Sensor, sense
from fixtures.simulator import simulate
from fixtures.vessels import VESSELS, actuator_table, make_vessel
from fixtures.writers.formats import FORMATS, fitted

# ----------------------------------------------------------------------------------------------------
# Exactness: the terms of each model, as the contract lists them, reproduce the accelerations to rounding


def regressors(model, truth):
    """Columns of surge, sway and yaw as the contract writes them, of the true state and actuators."""
    u, v, r = truth.u_w, truth.v_w, truth.r
    vessel, c = truth.vessel, truth.actuators
    kinds = {}
    delta = np.zeros_like(u)
    n2 = n1 = np.zeros_like(u)
    turned = {a.drives: i for i, a in enumerate(vessel.actuators) if a.drives}
    for i, a in enumerate(vessel.actuators):
        x, y = a.position
        if a.kind == "rudder":
            delta = c[:, i]
            side = delta * (u**2 + v**2)
            kinds["rudder"] = (0 * u, side, x * side)
        elif a.kind == "tunnel":
            f = c[:, i] * np.abs(c[:, i])
            kinds["tunnel"] = (0 * u, f, x * f)
        elif a.kind != "azimuth":
            f = c[:, i] * np.abs(c[:, i])
            angle = c[:, turned[a.name]] if a.name in turned else 0.0
            part = (f * np.cos(angle), f * np.sin(angle), f * (x * np.sin(angle) - y * np.cos(angle)))
            old = kinds.get(a.kind, (0 * u, 0 * u, 0 * u))
            kinds[a.kind] = tuple(p + q for p, q in zip(old, part, strict=True))
            n2, n1 = n2 + f, n1 + np.abs(c[:, i])
    T, F, N = ([k[i] for k in kinds.values() if np.any(k[i])] for i in range(3))
    m = np.abs
    one = np.ones_like(u)
    return {
        "modulus": (
            [u, u * m(u), v * r, r * r, *T], [v, v * m(v), r, u * r, *F], [r, r * m(r), v, u * v, *N]
        ),
        "linear": ([u, v * r, r * r, *T], [v, r, u * r, *F], [r, v, u * v, *N]),
        "zhu2019": ([u, m(u) * u, u**3, n2], *[[v, r, m(v) * r, delta]] * 2),
        "blanke": (
            [m(u) * u, v * r, r * r, n2, delta**2, one],
            *[[u * r, u * v, m(v) * v, m(v) * r, delta, one]] * 2,
        ),
        "cybership2": (
            [u, m(u) * u, u**3, v * r, r * r, n2, n1 * u],
            *[[u * r, u * v, v, m(v) * v, m(r) * v, r, m(v) * r, m(r) * r, m(u) * u * delta,
               m(u) * u * m(delta) * delta]] * 2,
        ),
    }[model]  # fmt: skip


def misfit(truth, model):
    """Largest residual of least squares per equation, as a share of the acceleration's standard deviation."""
    worst = []
    for state, columns in zip((truth.u_w, truth.v_w, truth.r), regressors(model, truth), strict=True):
        steady = np.ones(len(truth.t), dtype=bool)
        jumps = np.flatnonzero(np.any(np.diff(truth.actuators, axis=0) != 0, axis=1))
        for shift in (-1, 0, 1, 2):
            steady[np.clip(jumps + shift, 0, len(steady) - 1)] = False
        rate = np.gradient(state, truth.t)[steady][2:-2]
        table = np.column_stack(columns)[steady][2:-2]
        scale = np.linalg.norm(table, axis=0)
        theta = np.linalg.lstsq(table / scale, rate, rcond=None)[0]
        worst.append(np.abs(rate - table / scale @ theta).max() / rate.std())
    return worst


@pytest.mark.parametrize("name", VESSELS)
def test_each_vessel_is_exactly_its_model(name):
    vessel = make_vessel(name)
    truth = simulate(vessel, make_manoeuvre("random", vessel, 80 * vessel.time_scale, 5), seed=5)
    assert max(misfit(truth, vessel.model)) < 2e-3


@pytest.mark.parametrize(
    ("name", "simpler"), [("catamaran", "linear"), ("cybership", "zhu2019"), ("usv", "linear")]
)
def test_a_simpler_model_does_not_fit(name, simpler):
    vessel = make_vessel(name)
    truth = simulate(vessel, make_manoeuvre("random", vessel, 80 * vessel.time_scale, 5), seed=5)
    assert max(misfit(truth, simpler)) > 0.05


@pytest.mark.parametrize("name", VESSELS)
def test_each_vessel_keeps_its_course_and_its_service_speed(name):
    vessel = make_vessel(name)
    truth = simulate(vessel, make_manoeuvre("pull_out", vessel, 150 * vessel.time_scale, 1), seed=1)
    held = simulate(vessel, make_manoeuvre("circle", vessel, 60 * vessel.time_scale, 1), seed=1)
    assert held.u_w[0] == pytest.approx(vessel.speed, rel=0.02)
    ends = np.searchsorted(truth.t, np.array([2, 4, 6]) * truth.t[-1] / 6 - 0.1)
    turning = np.abs(truth.r).max()
    assert turning > 0.03 * vessel.speed / vessel.length
    assert np.all(np.abs(truth.r[ends]) < 0.02 * turning), "it turns on with the helm amidships"


@pytest.mark.parametrize("name", VESSELS)
@pytest.mark.parametrize("manoeuvre", MANOEUVRES)
def test_every_manoeuvre_of_every_vessel_stays_plausible(name, manoeuvre):
    vessel = make_vessel(name)
    truth = simulate(vessel, make_manoeuvre(manoeuvre, vessel, 60 * vessel.time_scale, 2), seed=2)
    assert np.abs(truth.u).max() < 1.6 * vessel.speed
    assert np.abs(truth.v).max() < 0.7 * vessel.speed
    assert np.abs(truth.r).max() * vessel.length / vessel.speed < 2.0
    low = [-a.limit if a.low is None else a.low for a in vessel.actuators]
    assert np.all(truth.inputs >= np.array(low) - 1e-12)


def test_zigzag_reverses_at_the_heading():
    vessel = make_vessel("usv")
    truth = simulate(vessel, make_manoeuvre("zigzag", vessel, 120, 4), seed=4)
    rudder = truth.inputs[:, 0]
    reversals = np.flatnonzero(rudder[1:] * rudder[:-1] < 0)
    inside = reversals[truth.t[reversals] < 60]
    assert len(inside) >= 3
    assert np.degrees(np.abs(truth.psi[inside] - truth.psi[0])) == pytest.approx(
        [20.0] * len(inside), abs=3.0
    )


# ----------------------------------------------------------------------------------------------------
# Effects, by their definitions


def run(effects=(), name="catamaran", manoeuvre="random", duration=60.0, seed=3, **options):
    vessel = make_vessel(name)
    return simulate(
        vessel, make_manoeuvre(manoeuvre, vessel, duration, seed), World(tuple(effects)), seed, **options
    )


def test_a_current_carries_the_vessel_and_changes_nothing_else():
    calm = run()
    there = run([Effect("current", {"speed": 0.3, "direction": 2.0})])
    assert np.allclose(there.u_w, calm.u_w, atol=1e-9)
    drift = (there.x - calm.x) - (there.x[0] - calm.x[0])
    assert np.allclose(drift, 0.3 * math.cos(2.0) * there.t, atol=1e-6)
    assert np.allclose(there.u - there.u_w, 0.3 * np.cos(2.0 - there.psi), atol=1e-3)


def test_actuator_effects_stand_between_the_log_and_the_actuator():
    lag = run([Effect("actuator_lag", {"time_constant": 0.5}, "left")])
    k = np.flatnonzero(np.diff(lag.inputs[:, 0]) != 0)[0]
    step = lag.inputs[k + 1, 0] - lag.inputs[k, 0]
    after = (lag.actuators[k + 51, 0] - lag.inputs[k, 0]) / step
    assert after == pytest.approx(1 - math.exp(-1), abs=0.03)
    assert np.array_equal(lag.actuators[:, 1], lag.inputs[:, 1])
    delay = run([Effect("actuator_delay", {"delay": 0.4}, "left")])
    assert np.array_equal(delay.actuators[40:, 0], delay.inputs[:-40, 0])
    offset = run([Effect("actuator_offset", {"offset": 0.05}, "right")])
    assert np.allclose(offset.actuators[:, 1] - offset.inputs[:, 1], 0.05)
    swapped = run([Effect("input_wiring", {}, None, {"swapped": ("left", "right")})])
    assert np.array_equal(swapped.actuators[:, ::-1], swapped.inputs)
    limited = run([Effect("actuator_rate_limit", {"rate": 0.2}, "left")])
    assert np.abs(np.diff(limited.actuators[:, 0])).max() <= 0.2 * 0.01 + 1e-12
    neutral = run([Effect("actuator_deadband", {"width": 0.4}, "left", {"form": "neutral"})])
    small = np.abs(neutral.inputs[:, 0]) <= 0.4
    assert small.any() and not neutral.actuators[small, 0].any()
    assert np.array_equal(neutral.actuators[~small, 0], neutral.inputs[~small, 0])
    play = run([Effect("actuator_deadband", {"width": 0.1}, "left", {"form": "play"})])
    assert np.abs(play.actuators[:, 0] - play.inputs[:, 0]).max() <= 0.1 + 1e-12


def test_sensor_effects_stand_in_the_stamps_and_values():
    truth = run([Effect("clock_offset", {"offset": 0.4}, None, {"stream": "heading"})])
    quiet = dataclasses.replace(DEFAULT_SUITE, heading=Sensor(10.0, 0.0))
    heading = sense(truth, quiet).streams["heading"]
    assert np.allclose(heading.columns["value"], np.interp(heading.t - 0.4, truth.t, truth.psi), atol=1e-9)
    biased = run([Effect("gyro_bias", {"bias": 0.02, "scale": 1.1}), Effect("heading_bias", {"bias": 0.1})])
    streams = sense(biased, dataclasses.replace(quiet, yaw_rate=Sensor(10.0, 0.0))).streams
    rate = streams["yaw_rate"]
    assert np.allclose(rate.columns["value"], 1.1 * np.interp(rate.t, biased.t, biased.r) + 0.02)
    assert np.allclose(
        streams["heading"].columns["value"] - np.interp(streams["heading"].t, biased.t, biased.psi), 0.1
    )
    moved = run([Effect("antenna_offset", {"x": 0.5, "y": 0.2})])
    position = sense(moved, dataclasses.replace(quiet, position=Sensor(5.0, 0.0))).streams["position"]
    psi = np.interp(position.t, moved.t, moved.psi)
    north = np.interp(position.t, moved.t, moved.x) + 0.5 * np.cos(psi) - 0.2 * np.sin(psi)
    assert np.allclose(position.columns["north"], north)


def sailed(vessel, world, log):
    """The truth of a random manoeuvre, and what sensors without noise of the position see of it."""
    manoeuvre = make_manoeuvre("random", vessel, 80 * vessel.time_scale, 3)
    truth = simulate(vessel, manoeuvre, world, 3, log=log, start=300.0)
    suite = dataclasses.replace(DEFAULT_SUITE, position=Sensor(5.0, 0.0), antenna=vessel.antenna)
    return truth, sense(truth, suite, 3)


@cache
def unmoved(vessel, log):
    """What they see where nothing acts."""
    return sailed(vessel, World(), log)[1]


@pytest.mark.parametrize("name", [*LIBRARY, *OUTSIDE])
def test_every_effect_can_be_drawn_and_leaves_its_mark(name):
    recipe = (LIBRARY | OUTSIDE)[name]
    vessels = [make_vessel(v) for v in VESSELS if recipe.suits(make_vessel(v))]
    assert vessels
    for vessel in vessels:
        effect = make_effect(name, recipe.sizes(vessel)[1], vessel, 7)
        with_it, seen = sailed(vessel, World((effect,)), effect.options.get("logs", (0,))[0])
        unseen = unmoved(vessel, effect.options.get("logs", (0,))[0])
        moved = max(
            np.abs(np.interp(s.t, seen.streams[k].t, next(iter(seen.streams[k].columns.values())))
                   - next(iter(s.columns.values()))).max()
            for k, s in unseen.streams.items()
        )  # fmt: skip
        assert moved > 0.01, vessel.name
        assert np.abs(with_it.u).max() < 2.5 * vessel.speed


# ----------------------------------------------------------------------------------------------------
# Sensors


def test_sensor_noise_rate_and_gaps_are_as_ordered():
    truth = run(duration=300.0)
    sensor = Sensor(5.0, 0.1, jitter=0.01, gap_every=30.0, gap_length=3.0, lost=0.02)
    stream = sense(truth, dataclasses.replace(DEFAULT_SUITE, position=sensor)).streams["position"]
    error = stream.columns["north"] - np.interp(stream.t, truth.t, truth.x)
    assert error.std() == pytest.approx(0.1, rel=0.15)
    assert np.all(np.diff(stream.t) > 0)
    assert np.median(np.diff(stream.t)) == pytest.approx(0.2, abs=0.01)
    assert np.diff(stream.t).max() > 1.0


def test_a_wander_is_slow_and_of_its_size():
    truth = run(duration=600.0)
    stream = sense(
        truth, dataclasses.replace(DEFAULT_SUITE, position=Sensor(5.0, 0.0, wander=0.5, wander_time=5.0))
    )
    error = stream.streams["position"].columns["east"] - np.interp(
        stream.streams["position"].t, truth.t, truth.y
    )
    assert error.std() == pytest.approx(0.5, rel=0.4)
    assert np.corrcoef(error[:-1], error[1:])[0, 1] == pytest.approx(math.exp(-0.2 / 5.0), abs=0.03)


def test_measured_inputs_move_no_faster_than_the_servo():
    truth = run(name="usv", servos=True)
    assert np.abs(np.diff(truth.inputs[:, 0])).max() <= 0.5 * 0.01 + 1e-12
    assert np.array_equal(truth.inputs, truth.actuators)


def replayed(recording):
    """The truth again, from nothing but the logged inputs, each held until the next."""
    inputs, truth = recording.streams["inputs"], recording.truth
    vessel, first = truth.vessel, truth.manoeuvre.legs[0]
    values = np.column_stack(list(inputs.columns.values()))
    idle = np.array([a.throttle * first.throttle for a in vessel.actuators])
    legs = [
        Leg(t, OPEN, first.throttle, 0.0, 0.0, tuple(row - idle))
        for t, row in zip(np.round(inputs.t, 2), values, strict=True)
    ]
    manoeuvre = dataclasses.replace(truth.manoeuvre, legs=(dataclasses.replace(first, start=0.0), *legs))
    return simulate(vessel, manoeuvre, heading=truth.psi[0], place=(truth.x[0], truth.y[0]), helm_rate=100.0)


@pytest.mark.parametrize("name", VESSELS)
@pytest.mark.parametrize("form", ["dataflash", "nmea0183-epochs"])
def test_logged_inputs_alone_reproduce_a_clean_run(name, form):
    vessel = fitted(make_vessel(name), FORMATS[form])
    if vessel is None:
        pytest.skip(f"{form} has no messages for the inputs of {name}")
    suite = FORMATS[form].suite(DEFAULT_SUITE)
    manoeuvre = make_manoeuvre("random", vessel, 40 * vessel.time_scale, 6)
    truth = simulate(vessel, manoeuvre, heading=0.4, helm_rate=suite.helm_rate)
    again = replayed(sense(truth, suite, 1))
    apart = np.hypot(again.x - truth.x - (again.x - truth.x)[0], again.y - truth.y - (again.y - truth.y)[0])
    assert apart.max() < 0.002 * vessel.length
    assert np.abs(again.psi - truth.psi).max() < 0.001


def test_the_integrator_agrees_with_an_adaptive_one():
    vessel = make_vessel("cybership")
    settle = Manoeuvre("circle", (Leg(0.0, OPEN, 1.0, 0.6),), 30.0, 0.0)
    truth = simulate(vessel, settle)
    table, turned = actuator_table(vessel)
    numbers, none, out = WorldNumbers(), np.zeros(3), np.zeros(11)

    def rate(_, s):
        derivative(
            vessel.hull, numbers, 0.0, s, table, turned, truth.actuators[0], np.ones(2), none, none, none, out
        )
        return out.copy()

    begin = np.zeros(11)
    begin[3] = vessel.speed
    end = solve_ivp(rate, (0.0, 30.0), begin, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    found = [truth.x[-1], truth.y[-1], truth.psi[-1], truth.u_w[-1], truth.v_w[-1], truth.r[-1]]
    assert np.abs(np.array(found) - end[:6]).max() < 1e-7


def test_geodesy_agrees_with_pymap3d():
    import pymap3d

    from fixtures.geodesy import to_geodetic

    north, east = np.array([0.0, 500.0, -800.0]), np.array([0.0, -300.0, 900.0])
    lat, lon = to_geodetic(north, east, (52.0, 4.3))
    e, n, _ = pymap3d.geodetic2enu(lat, lon, 0.0, 52.0, 4.3, 0.0)
    assert np.allclose(n, north, atol=1e-4)
    assert np.allclose(e, east, atol=1e-4)
