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
from identify.structure import null_parameters
from tests.identification_samples import trials_of
from validate.scan import best_value

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
