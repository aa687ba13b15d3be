"""What its own standard errors do not tell from nothing is not taken; what they tell stays."""

from __future__ import annotations

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active
from identify.effects import CURRENT, QUADRATIC_DAMPING, ROLL_COUPLING
from identify.prepare import prepare
from identify.report_fit import covariance_of
from identify.structure import null_parameters
from validate.look_alikes import Standing, dropped
from validate.loop import Outcome
from validate.sure import evidence, surely


def with_in(effects, *taken):
    _, trials = trials_of("catamaran", ("zigzag", "random", "circle"), 60.0, 3, effects, validate=1)
    prepared = prepare(trials, "modulus")
    structure = prepared.structure
    for effect in taken:
        structure = structure.with_effect(Active(effect))
    fitted = fit_from_scratch(structure, prepared.identify, null_parameters(structure), rounds=1)
    return Outcome(fitted, (), tuple(Standing(a, 20.0, 1e-3, ()) for a in structure.actives), None)


@pytest.mark.parametrize("speed", [0.0, 0.1])
def test_a_current_stays_where_there_is_one(speed):
    effects = (Effect("current", {"speed": speed, "direction": 1.0}),) if speed else ()
    found = surely(with_in(effects, CURRENT))
    assert len(found.standing) == len(found.fitted.solution.structure.actives) == (speed > 0.0)
    assert np.isfinite(found.fitted.chi2_per_dof)
    assert found.unsure == (() if speed else ("current",))


def test_a_roll_that_moves_nothing_goes_and_leaves_the_current():
    outcome = with_in((Effect("current", {"speed": 0.1, "direction": 1.0}),), ROLL_COUPLING, CURRENT)
    found = surely(outcome)
    assert found.unsure == ("roll_coupling",)
    assert [x.active.label for x in found.standing] == ["current"]


def test_damping_that_a_linear_model_lacks_is_sure_beside_coefficients_of_every_size():
    """Propellers' coefficients are a ten-thousandth of the hull's, whose standard errors must not suffer from it."""
    _, trials = trials_of("tug", ("zigzag", "random", "circle"), 60.0, 3, (), validate=1)
    prepared = prepare(trials, "linear")
    structure = prepared.structure.with_effect(Active(QUADRATIC_DAMPING))
    fitted = fit_from_scratch(structure, prepared.identify, null_parameters(structure), rounds=1)
    assert evidence(fitted, dropped(fitted, 0), covariance_of(fitted), 0) > 1000.0
