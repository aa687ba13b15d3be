"""Of two inputs that are moved alike neither may surely be slow where both surely are."""

from __future__ import annotations

from functools import cache

import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active, Variant
from identify.effects.actuators import ACTUATOR_LAG
from identify.prepare import prepare
from validate import sure
from validate.as_one import as_one, same_elsewhere

LAGS = tuple(Effect("actuator_lag", {"time_constant": 0.8}, name) for name in ("left", "right"))


@cache
def slow_on_both():
    ship, trials = trials_of("catamaran", ("zigzag", "random"), 60.0, 5, LAGS, validate=0)
    ready = prepare(trials, ship.model)
    structure = ready.structure
    for name in ("left", "right"):
        structure = structure.with_effect(Active(ACTUATOR_LAG, Variant(name)))
    return fit_from_scratch(structure, ready.identify)


def test_the_same_on_two_inputs_becomes_one_on_both_with_the_value_that_they_have_alike():
    fitted = slow_on_both()
    assert same_elsewhere(fitted, 0, (0, 1)) == [0, 1]
    one = as_one(fitted, (0, 1))
    [active] = one.solution.structure.actives
    assert active.label == "actuator_lag (left and right)"
    assert one.solution.structure.values(one.solution.p, 0)["time_constant"] == pytest.approx(0.8, rel=0.05)
    assert one.solution.total == pytest.approx(fitted.solution.total, abs=10.0)


@pytest.mark.parametrize(
    ("each", "both", "least"),
    [((-3.0, -2.0), 5.0, None), ((-3.0, -2.0), -5.0, 0), ((2.0, -2.0), 5.0, 1), ((2.0, 3.0), -5.0, None)],
)
def test_what_is_unsure_on_each_input_stands_where_it_is_sure_on_all(monkeypatch, each, both, least):
    """One that alone is sure does not vouch for the other."""

    def beyond(fitted, _covariance, index):
        return both if len(fitted.solution.structure.actives) == 1 else each[index]

    monkeypatch.setattr(sure, "_beyond", beyond)
    monkeypatch.setattr(sure, "side_by_side", lambda way, some: [way(k) for k in some])
    assert sure._least_sure(slow_on_both()) == least
