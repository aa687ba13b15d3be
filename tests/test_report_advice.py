"""What to do next: each check is said once, and nothing is said of what is nothing."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.effects import EFFECTS
from identify.fit import Estimated, FittedEffect
from identify.report_fit import lead_words
from validate.advice import NOTHING_SAILED, _once, advice_for
from validate.diagnosis import TakenEffect, Verdict
from validate.outcome import Outcome
from validate.pace import Pace
from validate.rounds import MOST_EFFECTS

CHECK = {e.name: e.check for e in EFFECTS}
EMPTY = Outcome(fitted=None, turns=(), standing=(), wiring=None)


def taken(name, input=None, alike=()):
    return TakenEffect(FittedEffect(name, input, ()), 1e-4, alike)


def advice(*effects, verdict=Verdict.AMBIGUOUS):
    return advice_for(verdict, effects, {"u": 0.0}, EMPTY, 0.1)


@pytest.mark.parametrize(
    ("standing", "says"), [(MOST_EFFECTS, "no one or two effects"), (2, "nothing in the library")]
)
def test_that_many_effects_stand_in_for_something_else_is_said(monkeypatch, standing, says):
    monkeypatch.setattr("validate.advice._slow_inputs", lambda _: [])
    stands = SimpleNamespace(active=SimpleNamespace(effect=EFFECTS[0], label=EFFECTS[0].name))
    outcome = replace(EMPTY, standing=(stands,) * standing)
    words = advice_for(Verdict.UNEXPLAINED, (), {"u": 0.0, "r": 0.4}, outcome, 0.1)
    assert f"In r, 40 % of the standard deviation is structure that {says} account" in words
    assert ("it is probably none of them" in words) == (standing == MOST_EFFECTS)


def test_a_check_is_said_once_however_many_inputs_it_is_about():
    words = advice(taken("actuator_lag", "left"), taken("actuator_lag", "right"), verdict=Verdict.EXPLAINED)
    assert words.count(CHECK["actuator_lag"]) == 1
    assert words.startswith("actuator_lag of left and right: ")


def test_the_checks_of_look_alikes_are_said_once_and_by_name():
    words = advice(
        taken("current", alike=("wind", "heading_bias")),
        taken("actuator_lag", "rudder", alike=("wind", "current", "clock_offset (inputs)")),
    )
    for name in ("current", "wind", "heading_bias", "actuator_lag", "clock_offset"):
        assert words.count(CHECK[name]) == 1, name
    assert "cannot be told from wind or heading_bias" in words
    assert f"wind: {CHECK['wind']}" in words
    assert NOTHING_SAILED in words


@pytest.mark.parametrize(
    ("lead", "error", "says"),
    [
        (-0.001, 0.001, None),
        (0.001, 0.001, None),
        (0.05, math.nan, None),
        (0.05, 0.01, None),
        (0.21, 0.01, None),
        (0.25, 0.01, "0.250 ± 0.010 s ahead of the logged inputs; only up to 0.200 s of that follows"),
        (-0.05, 0.01, "0.050 ± 0.010 s behind the logged inputs."),
    ],
)
def test_a_lead_of_nothing_is_not_worth_a_word_and_none_is_negative(lead, error, says):
    words = lead_words(lead, error, 0.2)
    assert (words == []) == (says is None)
    assert all(says in w and "-" not in w for w in words)


def test_the_share_of_a_search_grows_at_every_step_and_never_reaches_its_end():
    seen = []
    pace = Pace(lambda text, share: seen.append(share))
    for steps, later in ((9, 16), (3, 6), (9, 16), (40, 0), (0, 0)):
        pace.expect(steps, later)
        for _ in range(steps + 1):
            pace("a step")
    assert (np.diff(seen) > 0).all()
    assert 0 < seen[0] < 0.1
    assert 0.9 < seen[-1] < 1


def test_a_search_that_goes_as_expected_moves_evenly():
    seen = []
    pace = Pace(lambda text, share: seen.append(share))
    pace.expect(19)
    for _ in range(19):
        pace("a step")
    np.testing.assert_allclose(np.diff(seen), 0.05)


def test_gusts_of_a_wind_that_nothing_measured_are_told():
    unlogged = SimpleNamespace(gusty=0.16)
    fitted = SimpleNamespace(problem=SimpleNamespace(unlogged=unlogged))
    outcome = replace(EMPTY, fitted=fitted)
    words = advice_for(Verdict.EXPLAINED, (taken("wind"),), {"u": 0.0}, outcome, 0.1)
    assert "gusts of about 12 % of the wind's speed" in words
    calm = replace(EMPTY, fitted=SimpleNamespace(problem=SimpleNamespace(unlogged=None)))
    assert "gusts" not in advice_for(Verdict.EXPLAINED, (taken("wind"),), {"u": 0.0}, calm, 0.1)


@pytest.mark.parametrize(("left", "says"), [(0.0, False), (0.096, True)])
def test_what_is_missing_and_too_small_to_matter_is_said(left, says):
    words = advice_for(Verdict.ADEQUATE, (), {"u": 0.0, "v": left}, EMPTY, 0.1)
    assert ("In v, 9.6 % of the standard deviation" in words) is says
    assert ("Nothing to add" in words) is not says


def test_what_a_search_came_back_to_is_told_once():
    assert _once(("walk of a", "bias", "walk of a")) == "walk of a and bias"


@pytest.mark.parametrize(("model", "said"), [("nomoto1", True), ("modulus", False)])
def test_a_lag_and_a_hull_of_first_order_may_be_exchanged(model, said):
    slots = [SimpleNamespace(effect=-1, name="N_delta"), SimpleNamespace(effect=-1, name="N_r")]
    structure = SimpleNamespace(model=SimpleNamespace(name=model), slots=slots)
    solution = SimpleNamespace(structure=structure, p=np.array([0.01, -0.125]))
    outcome = replace(EMPTY, fitted=SimpleNamespace(solution=solution))
    lag = TakenEffect(
        FittedEffect("actuator_lag", "rudder", (Estimated("", "time_constant", 5.3, 0.1, "s"),)), 1e-4, ()
    )
    words = advice_for(Verdict.EXPLAINED, (lag,), {"r": 0.0}, outcome, 0.1)
    assert ("may as well be the 5.3 s, and the actuator's lag 8 s." in words) is said
