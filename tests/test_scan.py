"""What is looked at value by value through the accelerations, and how much of a gyro's fault a smoother shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fixtures.effects import Effect
from identify.drive import drive
from identify.effect import Active, Variant
from identify.effects import EFFECTS, WIND
from identify.predict import shown
from identify.prepare import prepare
from identify.regression import regressors, start_by_regression
from identify.slopes import accelerations, averaged, true_accelerations
from identify.stretch import slopes_of
from identify.structure import null_parameters
from identify.true_motion import over_ground
from tests.identification_samples import PROPELLER, RUDDER, structure_of, trials_of
from tests.test_kernel import stretch_of
from validate.candidates import candidates
from validate.motion_seen import FINE, Motion
from validate.scan import WORTH, _valleys, best_value, gain_and_value, wanted_values

LIBRARY = {e.name: e for e in EFFECTS if e is not WIND}  # here nothing logs the wind
BIAS, SCALE = 0.03, 0.8


def missing(name, variant, effects, seed):
    """Stretches of a vessel with some effects, and its structure with a candidate in."""
    _, trials = trials_of("usv", ("zigzag", "random"), 60.0, seed, effects, validate=0)
    prepared = prepare(trials, "modulus")
    return prepared.identify, prepared.structure.with_effect(Active(LIBRARY[name], variant))


@pytest.mark.parametrize("offset", [0.07, -0.07])
def test_a_rudder_that_is_off_its_zero_is_seen_in_the_accelerations(offset):
    there = [Effect("actuator_offset", {"offset": offset}, input="rudder")]
    stretches, structure = missing("actuator_offset", Variant("rudder"), there, 5)
    p = best_value(structure, stretches, null_parameters(structure))
    [found] = [x for x, s in zip(p, structure.slots, strict=True) if s.name == "offset"]
    assert found == pytest.approx(offset, rel=0.3)


def test_nothing_is_seen_of_a_rudder_that_is_on_its_zero():
    stretches, structure = missing("actuator_offset", Variant("rudder"), [], 6)
    assert best_value(structure, stretches, null_parameters(structure)) is None


@pytest.mark.parametrize("followed", ["compass", "gyro"])
def test_the_fault_of_a_gyro_shows_where_the_smoother_followed_the_gyro(followed):
    there = [Effect("gyro_bias", {"bias": BIAS, "scale": SCALE})]
    stretches, structure = missing("gyro_bias", Variant(), there, 7)
    p = np.array([{"bias": BIAS, "scale": SCALE}.get(s.name, 0.0) for s in structure.slots])
    stretch = stretches[0]
    true = np.column_stack([stretch.states, np.zeros((stretch.steps + 1, 2))])
    if followed == "gyro":
        states = stretch.states.copy()
        states[:, 5] = BIAS + SCALE * states[:, 5]
        stretch = replace(stretch, states=states)
    says = shown(structure, drive(structure, p, stretch), stretch, true)[:, 5]
    assert np.sqrt(np.mean((says - stretch.states[:, 5]) ** 2)) < 0.1 * BIAS


@pytest.mark.parametrize(
    "name, size",
    [("wind", {"cx": 0.004, "cy": 0.008, "cn": 0.002, "speed": 7.0}), ("current", {"speed": 0.4})],
)
def test_where_air_and_water_go_is_seen_in_the_accelerations(name, size):
    going = 2.0
    comes = going - np.pi if name == "wind" else going
    there = [Effect(name, {**size, "direction": comes})]
    stretches, structure = missing(name, Variant(), there, 8)
    p = best_value(structure, stretches, null_parameters(structure))
    north, east = (p[[s.name for s in structure.slots].index(n)] for n in ("north", "east"))
    assert np.arctan2(east, north) == pytest.approx(going, abs=0.4)


@pytest.mark.parametrize("name, of, value", [("shallow_water", "factor", 1.7), ("mass_change", "ratio", 0.6)])
def test_a_large_load_is_seen_in_the_log_that_it_is_in(name, of, value):
    """The first order tells little of it: every coefficient has bent to follow that log."""
    there = [Effect(name, {of: value}, options={"logs": (1,)})]
    _, trials = trials_of("usv", ("zigzag", "random", "zigzag"), 60.0, 9, there, validate=0)
    prepared = prepare(trials, "modulus")
    seen = {}
    for log in prepared.structure.setting.logs:
        structure = prepared.structure.with_effect(Active(LIBRARY[name], Variant(options={"logs": (log,)})))
        seen[log] = gain_and_value(structure, prepared.identify, null_parameters(structure))
    loaded = prepared.structure.setting.logs[1]
    assert max(seen, key=lambda log: seen[log][0]) == loaded
    assert seen[loaded][0] > WORTH
    assert seen[loaded][1][[s.name for s in structure.slots].index(of)] == pytest.approx(value, rel=0.15)


def test_a_regression_knows_of_a_load():
    there = [Effect("mass_change", {"ratio": 1.8}, options={"logs": (1,)})]
    runs = [
        prepare(trials_of("usv", ("zigzag", "random"), 60.0, 9, effects, validate=0)[1], "modulus")
        for effects in ((), there)
    ]
    light, heavy = runs
    log = heavy.structure.setting.logs[1]
    structure = heavy.structure.with_effect(Active(LIBRARY["mass_change"], Variant(options={"logs": (log,)})))
    p = null_parameters(structure)
    p[[s.name for s in structure.slots].index("ratio")] = 1.8
    found = start_by_regression(structure, p, heavy.identify)[: len(light.structure.setting.terms)]
    true = start_by_regression(light.structure, null_parameters(light.structure), light.identify)
    unaware = start_by_regression(heavy.structure, null_parameters(heavy.structure), heavy.identify)
    some = np.flatnonzero(true[: len(found)])
    off, without = (np.median(np.abs(x[some] / true[some] - 1.0)) for x in (found, unaware))
    assert off < 0.5 * without


def test_a_thrust_that_fades_is_seen_where_the_first_order_knows_of_no_thrust():
    there = [Effect("thrust_fade", {"rate": 2e-3})]
    _, trials = trials_of("usv", ("zigzag", "random", "zigzag"), 60.0, 9, there, validate=0)
    prepared = prepare(trials, "modulus")
    structure = prepared.structure.with_effect(Active(LIBRARY["thrust_fade"], Variant()))
    gain, p = gain_and_value(structure, prepared.identify, null_parameters(structure))
    assert gain > 0.0
    assert p[[s.name for s in structure.slots].index("rate")] > 0.0


def test_an_actuator_that_follows_by_many_seconds_is_seen_so():
    lag = Effect("actuator_lag", {"time_constant": 8.0}, "propeller")
    stretches, structure = missing("actuator_lag", Variant("propeller"), [lag], 3)
    p = start_by_regression(structure, null_parameters(structure), stretches)
    found = structure.values(best_value(structure, stretches, p), 0)
    assert found["time_constant"] == pytest.approx(8.0, rel=0.25)


def test_times_of_ships_are_longer_than_those_of_boats():
    def time(length):
        structure = structure_of("modulus")
        structure = replace(structure, vessel=replace(structure.vessel, length=length))
        [lag] = [
            s
            for s in structure.with_effect(Active(LIBRARY["actuator_lag"], Variant("rudder"))).slots
            if s.effect == 0
        ]
        return lag.parameter

    boat, ship = time(2.0), time(80.0)
    assert boat.bounds == (0.0, 20.0) and ship.bounds == (0.0, 80.0)
    assert ship.starts == pytest.approx([4.0 * x for x in boat.starts])


@pytest.mark.parametrize("direction", [-1.0, 2.0])
def test_a_strong_current_is_looked_for_where_it_flows(direction):
    """Over ground a vessel that turns changes its velocity along its own axes without any force."""
    flow = Effect("current", {"speed": 0.6, "direction": direction})
    _, trials = trials_of("catamaran", ("random", "circle", "zigzag"), 60.0, 5, (flow,), validate=0)
    prepared = prepare(trials, "modulus")
    structure = prepared.structure.with_effect(Active(LIBRARY["current"], Variant()))
    gain, p = gain_and_value(structure, prepared.identify, null_parameters(structure))
    north, east = p[[k for k, s in enumerate(structure.slots) if s.effect == 0]]
    aside = np.angle(np.exp(1j * (np.arctan2(east, north) - direction)))
    assert abs(aside) < 0.6
    assert 0.3 <= np.hypot(north, east) <= 1.0
    assert gain > 0.3


def test_what_keeps_its_velocity_through_the_water_has_no_acceleration_though_it_turns_in_a_current():
    structure, stretch = structure_of("modulus"), stretch_of((RUDDER, PROPELLER))
    psi = np.linspace(0.0, 4.0, stretch.steps + 1)
    states = np.zeros((len(psi), 6))
    states[:, 2], states[:, 3], states[:, 5] = psi, 1.5, 4.0 / (stretch.h * stretch.steps)
    ground = over_ground(states, np.array([0.4, -0.3]))
    stretch = replace(stretch, states=ground)
    inside = slice(6, -6)  # at its ends a slope looks beyond the stretch
    through = accelerations(stretch, current=np.array([0.4, -0.3]))[inside]
    assert np.allclose(through, 0.0, atol=1e-12)
    assert np.abs(accelerations(stretch)[inside]).max() > 0.01
    current = structure.with_effect(Active(LIBRARY["current"], Variant()))
    p = null_parameters(current)
    p[[k for k, s in enumerate(current.slots) if s.effect == 0]] = 0.4, -0.3
    assert np.allclose(true_accelerations(current, p, stretch)[inside], 0.0, atol=1e-12)


@pytest.mark.parametrize("m", [1, 3, 5])
def test_rates_are_averaged_as_slopes_see_them(m):
    rates = np.random.default_rng(m).normal(size=(50, 3))
    motion = np.vstack([np.zeros((1, 3)), np.cumsum(0.1 * rates, axis=0)])
    slopes = slopes_of(np.hstack([np.zeros((51, 3)), motion]), 0.1, m)
    assert np.allclose(slopes, averaged(rates, m), atol=1e-12)


def test_valleys_are_places_that_one_must_climb_out_of():
    flat = np.array([0.0, 0.001, -0.0005, 0.001, 0.002])
    assert _valleys(flat) == [2]
    two = np.array([-0.1, -0.3, -0.5, -0.45, -0.42, -0.47, -0.1])
    assert _valleys(two) == [2, 5]
    at_the_ends = np.array([-0.2, 0.0, 0.1, -0.4])
    assert _valleys(at_the_ends) == [3, 0]


def test_a_rudder_that_is_off_its_zero_has_its_valley_first():
    there = [Effect("actuator_offset", {"offset": -0.07}, input="rudder")]
    stretches, structure = missing("actuator_offset", Variant("rudder"), there, 5)
    p = null_parameters(structure)
    found = wanted_values(structure, stretches, p)
    gains = [gain for gain, _ in found]
    assert gains == sorted(gains, reverse=True)
    gain, best = gain_and_value(structure, stretches, p)
    assert gain == gains[0] and np.array_equal(best, found[0][1])


def test_what_motion_makes_of_the_terms_is_kept_for_inputs_and_loads_and_made_anew_for_the_rest():
    """Regressors of one value after another are those of each by itself."""
    structure = structure_of("modulus")
    for active in (
        Active(LIBRARY["actuator_offset"], Variant("rudder")),
        Active(LIBRARY["mass_change"], Variant(options={"logs": ("b",)})),
        Active(LIBRARY["current"]),
        Active(LIBRARY["gyro_bias"]),
    ):
        structure = structure.with_effect(active)
    states = np.random.default_rng(1).normal(0.3, 0.1, (2, stretch_of((RUDDER, PROPELLER)).steps + 1, 6))
    runs = [replace(stretch_of((RUDDER, PROPELLER), k), name=n, states=states[k]) for k, n in enumerate("ab")]
    motion, null = Motion(structure, runs), null_parameters(structure)
    for k in [None, *structure.general, None]:
        p = null if k is None else null + 0.1 * (np.arange(len(null)) == k)
        driven = [drive(structure, p, s) for s in runs]
        along = [regressors(structure, p, s) for s in runs]
        for found, m in zip(motion.designs(driven), (FINE, motion.slope), strict=True):
            assert found == pytest.approx(motion.thinned([averaged(x, m) for x in along]), abs=1e-9)


def test_a_clock_put_wrong_explains_nothing_by_the_accelerations_that_it_makes():
    """Positions of a ship that turns, seconds off their headings, accelerate with the turn, and any model says that."""
    slow = Effect("actuator_rate_limit", {"rate": 0.05}, "rudder")
    _, trials = trials_of("tanker", ("zigzag", "random", "circle"), 90.0, 5, (slow,))
    prepared = prepare(trials, "blanke")
    clock, limit = (
        prepared.structure.with_effect(a)
        for a in candidates(prepared.structure)
        if a.label in ("clock_offset (position)", "actuator_rate_limit (rudder)")
    )
    gains = {}
    for structure in (clock, limit):
        gain, best = gain_and_value(structure, prepared.identify, null_parameters(structure))
        [value] = [
            x for x, s in zip(best, structure.slots, strict=True) if s.effect == 0 and s.coefficient < 0
        ]
        gains[structure.actives[0].effect.name] = gain, value
    assert gains["actuator_rate_limit"] == (pytest.approx(0.83, abs=0.1), pytest.approx(0.05, rel=0.1))
    gain, offset = gains["clock_offset"]
    assert gain < 0.1
    assert abs(offset) < 0.1
