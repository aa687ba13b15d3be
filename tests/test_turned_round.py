"""An azimuth half a turn off and a propeller that runs backwards are one cause, and are both named."""

import numpy as np
import pytest
from identification_samples import trials_of

from identify.prepare import prepare
from identify.report_fit import fitted_effect
from identify.structure import null_parameters
from validate.candidates import candidates
from validate.turned_round import same_wiring


@pytest.fixture(scope="module")
def bare():
    return prepare(trials_of("tug", ("zigzag", "random"), 40.0, 1, validate=0)[1], "modulus").structure


def offset_by(bare, name, value):
    """The model with an input's zero off by a value, its parameters, and the place of the effect."""
    (active,) = (a for a in candidates(bare) if a.label == f"actuator_offset ({name})")
    structure = bare.with_effect(active)
    p = null_parameters(structure)
    p[[k for k, s in enumerate(structure.slots) if s.effect == 0]] = value
    return structure, p, 0


@pytest.mark.parametrize("value", [np.pi, -np.pi, 3.0 * np.pi - 1e-3])
def test_half_a_turn_is_the_propeller_the_other_way(bare, value):
    turned = next(i for i in bare.inputs if i.kind == "azimuth")
    case = offset_by(bare, turned.name, value)
    assert same_wiring(*case) == f"input_wiring (reversed {turned.drives})"
    effect, _ = fitted_effect(*case[:2], np.eye(len(case[1])), 0)
    assert abs(effect.parameters[0].value) == pytest.approx(np.pi, abs=2e-3)


def test_what_is_trim_or_turns_no_thrust_is_no_wiring(bare):
    turned, driving = (next(i for i in bare.inputs if i.kind == k) for k in ("azimuth", "propeller"))
    assert same_wiring(*offset_by(bare, turned.name, 0.3)) is None
    assert same_wiring(*offset_by(bare, driving.name, np.pi)) is None
