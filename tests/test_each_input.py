"""What is made alike may be off alike: one effect on all inputs of a kind, found at once and then known of each."""

from __future__ import annotations

import numpy as np
import pytest
from identification_samples import MOTORS, PROPELLER, RUDDER, structure_of, trials_of
from test_kernel import stretch_of

from fixtures.effects import Effect
from identify.acting import actuators_of
from identify.base_fit import fit_from_scratch
from identify.drive import drive
from identify.effect import Active, Variant
from identify.effects.actuators import (
    ACTUATOR_DEADBAND,
    ACTUATOR_DELAY,
    ACTUATOR_LAG,
    ACTUATOR_RATE_LIMIT,
)
from identify.prepare import prepare
from identify.structure import effects_alone, null_parameters
from validate.candidates import candidates
from validate.each_input import on_each_input
from validate.look_alikes import standing
from validate.loop import search

BOTH = Variant("left", besides=("right",))
ALIKE = (ACTUATOR_DELAY, ACTUATOR_LAG, ACTUATOR_RATE_LIMIT, ACTUATOR_DEADBAND)


def valued(structure, **values):
    p = null_parameters(structure)
    for k, slot in enumerate(structure.slots):
        if slot.effect >= 0:
            p[k] = values[slot.name]
    return p


def test_what_may_be_off_alike_is_looked_for_on_all_inputs_of_a_kind():
    bare = structure_of("modulus", MOTORS)
    found = [a for a in candidates(bare) if a.variant.besides]
    assert {a.effect.name for a in found} == {e.name for e in ALIKE}
    assert all(a.variant.inputs == ("left", "right") for a in found)
    assert {a.variant.options["form"] for a in found if a.effect is ACTUATOR_DEADBAND} == {"neutral"}
    assert found[0].label == f"{found[0].effect.name} (left and right)"
    assert not any(a.variant.besides for a in candidates(structure_of("modulus", (RUDDER, PROPELLER))))
    taken = candidates(bare.with_effect(Active(ACTUATOR_LAG, Variant("right"))))
    assert not any(a.effect is ACTUATOR_LAG and "right" in a.variant.inputs for a in taken)


def test_an_input_that_keeps_one_value_has_nothing_alike_with_others():
    still = structure_of("modulus", MOTORS, extents={"left": (0.3, 0.6), "right": (0.0, 0.6)})
    assert not any(a.variant.besides for a in candidates(still))


@pytest.mark.parametrize(
    ("effect", "values"),
    [(ACTUATOR_LAG, {"time_constant": 0.4}), (ACTUATOR_DELAY, {"delay": 0.3}), (ACTUATOR_RATE_LIMIT, {"rate": 0.5})],
    ids=lambda x: getattr(x, "name", ""),
)  # fmt: skip
def test_on_both_is_on_each_and_so_are_its_derivatives(effect, values):
    bare, stretch = structure_of("modulus", MOTORS), stretch_of(MOTORS)
    alike = bare.with_effect(Active(effect, BOTH))
    apart = bare.with_effect(Active(effect, Variant("left"))).with_effect(Active(effect, Variant("right")))
    here, there = (
        actuators_of(s, p, [s.values(p, e) for e in range(len(s.actives))], stretch)
        for s, p in ((alike, valued(alike, **values)), (apart, valued(apart, **values)))
    )
    assert here.keys() == there.keys()
    for name in here:
        assert np.array_equal(here[name], there[name])
    assert np.array_equal(
        *(drive(s, valued(s, **values), stretch).channels for s in (alike, apart)), equal_nan=True
    )


LATE = 0.6


def both_slow():
    """A catamaran both of whose motors follow their commands slowly."""
    slow = [Effect("actuator_lag", {"time_constant": LATE}, name) for name in ("left", "right")]
    ship, trials = trials_of("catamaran", ("zigzag", "random", "circle", "random"), 60.0, 11, slow)
    return prepare(trials, ship.model)


def test_what_was_found_on_both_has_a_value_on_each():
    ready = both_slow()
    alike = ready.structure.with_effect(Active(ACTUATOR_LAG, BOTH))
    begun = effects_alone(
        alike, valued(alike, time_constant=0.3) * np.array([s.effect == 0 for s in alike.slots])
    )
    together = fit_from_scratch(alike, ready.identify, begun)
    apart = on_each_input(together)
    structure = apart.solution.structure
    assert [a.label for a in structure.actives] == ["actuator_lag (left)", "actuator_lag (right)"]
    assert apart.solution.total <= together.solution.total + 1.0
    for k in range(2):
        assert structure.values(apart.solution.p, k)["time_constant"] == pytest.approx(LATE, abs=0.05)
    assert on_each_input(apart) is apart
    assert not any("left and right" in name for name in standing(apart, 0).look_alikes)


def test_motors_that_are_slow_alike_are_both_named_and_nothing_else():
    found = search(both_slow())
    assert sorted(a.label for a in found.fitted.solution.structure.actives) == [
        "actuator_lag (left)",
        "actuator_lag (right)",
    ]
    assert all(not s.look_alikes for s in found.standing)
