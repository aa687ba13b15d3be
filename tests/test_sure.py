"""What its own standard errors do not tell from nothing is not taken; what they tell stays."""

from __future__ import annotations

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active
from identify.effects import CURRENT
from identify.prepare import prepare
from validate.look_alikes import Standing
from validate.loop import Outcome
from validate.sure import surely


def with_a_current(effects):
    _, trials = trials_of("catamaran", ("zigzag", "random", "circle"), 60.0, 3, effects, validate=1)
    prepared = prepare(trials, "modulus")
    structure = prepared.structure.with_effect(Active(CURRENT))
    fitted = fit_from_scratch(structure, prepared.identify, rounds=1)
    return Outcome(fitted, (), (Standing(structure.actives[0], 20.0, 1e-3, ()),), None)


@pytest.mark.parametrize("speed", [0.0, 0.1])
def test_a_current_stays_where_there_is_one(speed):
    effects = (Effect("current", {"speed": speed, "direction": 1.0}),) if speed else ()
    found = surely(with_a_current(effects))
    assert len(found.standing) == len(found.fitted.solution.structure.actives) == (speed > 0.0)
    assert np.isfinite(found.fitted.chi2_per_dof)
