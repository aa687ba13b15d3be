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
from identify.regression import start_by_regression
from identify.structure import null_parameters
from tests.identification_samples import trials_of
from validate.scan import WORTH, best_value, gain_and_value

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
