"""Two effects each of which hides the other are found together."""

from __future__ import annotations

from dataclasses import replace

import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import FAR, fit_from_scratch
from identify.prepare import prepare
from validate.pace import Pace
from validate.rounds import _in_pairs, _turn


@pytest.mark.slow
def test_a_strong_current_and_an_offset_of_the_rudder_where_neither_alone_is_enough():
    effects = (
        Effect("current", {"speed": 0.7, "direction": 3.2}),
        Effect("actuator_offset", {"offset": 0.12}, "rudder"),
    )
    _, trials = trials_of("usv", ("zigzag", "circle", "random", "zigzag"), 75.0, 6, effects)
    prepared = prepare(trials, "modulus")
    turn = _turn(fit_from_scratch(prepared.structure, prepared.identify, length=10.0), Pace())
    both = _in_pairs(replace(turn, taken=None), Pace())
    assert {t.taken.screened.active.effect.name for t in both} == {"current", "actuator_offset"}
    assert both[-1].taken.fitted.chi2_per_dof < FAR


@pytest.mark.slow
def test_no_pair_stands_for_what_the_library_lacks():
    _, trials = trials_of(
        "usv", ("zigzag", "circle", "random"), 60.0, 6, (Effect("tether", {"stiffness": 0.02}),)
    )
    prepared = prepare(trials, "modulus")
    turn = _turn(fit_from_scratch(prepared.structure, prepared.identify, length=10.0), Pace())
    assert turn.base.chi2_per_dof > FAR
    assert _in_pairs(replace(turn, taken=None), Pace()) == [replace(turn, taken=None)]
