"""What its own standard errors do not tell from nothing is not taken; what they tell stays."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of, with_nothing_between

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.disturbance import with_disturbances
from identify.effect import Active
from identify.effects import CURRENT, EFFECTS, QUADRATIC_DAMPING, ROLL_COUPLING, SHALLOW_WATER, WIND_UNSEEN
from identify.parameter_covariance import covariance_of
from identify.prepare import prepare
from identify.structure import null_parameters
from validate import sure
from validate.candidates import candidates
from validate.judgement import least_gain
from validate.look_alikes import Standing, departure, dropped
from validate.outcome import Outcome
from validate.sure import _by_chance, _by_flow, _flow_of, _wald, evidence, surely
from validate.within import GivenUp


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


@pytest.mark.parametrize("effect", ["actuator_delay", "actuator_lag"])
@pytest.mark.parametrize(("late", "told"), [(0.04, False), (0.3, True)])
def test_what_a_log_may_hide_between_its_entries_is_no_delay(effect, late, told):
    """Of one input that moves at the entries and one that moved since the last, the former seems late."""
    size = {"actuator_delay": "delay", "actuator_lag": "time_constant"}[effect]
    ahead = Effect("clock_offset", {"offset": 0.07}, None, {"stream": "inputs"})
    truth = (ahead, Effect(effect, {size: late}, "left"))
    _, trials = trials_of("catamaran", ("zigzag", "random", "random"), 60.0, 3, truth)
    prepared = prepare(trials, "modulus")
    active = next(a for a in candidates(prepared.structure) if a.label == f"{effect} (left)")
    structure = prepared.structure.with_effect(active)
    p = null_parameters(structure)
    p[[s.name == size for s in structure.slots]] = late
    fitted = fit_from_scratch(structure, prepared.identify, p, rounds=1)
    found = surely(Outcome(fitted, (), (Standing(active, 20.0, 1e-3, ()),), None))
    assert bool(found.standing) is told


@pytest.mark.parametrize(("error", "hidden"), [(0.002, False), (0.05, True)])
def test_an_input_that_is_not_surely_late_may_have_moved_between_its_entries(monkeypatch, error, hidden):
    """It acts four hundredths of a second after it is written, if its delay is what it seems to be."""
    delay = next(e for e in EFFECTS if e.name == "actuator_delay")
    slot = SimpleNamespace(effect=0, parameter=delay.parameters[0])
    active = SimpleNamespace(effect=delay, variant=SimpleNamespace(input="left"))
    structure = SimpleNamespace(actives=[active], slots=[slot], values=lambda *_: {"delay": 0.1})
    fitted = SimpleNamespace(
        solution=SimpleNamespace(structure=structure, p=[0.1]),
        problem=SimpleNamespace(stretches=[SimpleNamespace(start=0.0)]),
    )
    monkeypatch.setattr(sure, "input_clocks", lambda *_: {"left": -0.04 + (delay.input_delay is None) * 0.1})
    assert sure._between_entries(fitted, np.array([[error**2]]), 0) is hidden


def test_a_roll_that_moves_nothing_goes_and_leaves_the_current():
    outcome = with_in((Effect("current", {"speed": 0.1, "direction": 1.0}),), ROLL_COUPLING, CURRENT)
    found = surely(outcome)
    assert found.unsure == ("roll_coupling",)
    assert [x.active.label for x in found.standing] == ["current"]


def test_what_is_taken_back_leaves_its_place_to_what_is_missing(monkeypatch):
    """A roll stood where a compass was off; it is not taken again."""
    unsure = iter([0])
    truly = sure._least_sure
    monkeypatch.setattr(
        sure, "_least_sure", lambda fitted: next(unsure, None) if _rolls(fitted) else truly(fitted)
    )
    found = surely(with_in((Effect("heading_bias", {"bias": 0.15}),), ROLL_COUPLING))
    assert found.unsure == ("roll_coupling",)
    assert [x.active.label for x in found.standing] == ["heading_bias"]
    assert not found.fitted.is_off


@pytest.mark.parametrize(("bias", "limit"), [(0.15, True), (0.0, False)])
def test_a_search_that_goes_on_must_come_nearer_than_one_that_stayed_off_the_noise(monkeypatch, bias, limit):
    """It is given up with two effects or as many; beside one that came to the noise with more than that had."""
    asked, truth = [], (Effect("heading_bias", {"bias": bias}),) if bias else ()

    def given_up(_, within, __):
        asked.append(within.first)
        raise GivenUp

    outcome = with_in(truth, ROLL_COUPLING)
    unsure = iter([0])
    monkeypatch.setattr(sure, "_least_sure", lambda _: next(unsure, None))
    monkeypatch.setattr(sure, "leaves_much", lambda _: True)
    monkeypatch.setattr(sure, "searched_on", given_up)
    found = surely(outcome)
    assert outcome.fitted.is_off is limit
    assert found.standing == ()
    assert found.unsure == ("roll_coupling",)
    [first] = asked
    assert first.is_out_of_reach(outcome.fitted, stuck=False) is False  # with one effect
    assert first.is_as_good(outcome.fitted) is False
    far = SimpleNamespace(chi2_per_dof=3.0 * outcome.fitted.chi2_per_dof, solution=outcome.fitted.solution)
    assert first.is_out_of_reach(far, stuck=True) is limit  # what went leaves its place empty
    assert (first.chi2_per_dof < outcome.fitted.chi2_per_dof) is limit
    assert (first.effects, first.at_noise) == (2, not limit)


def _rolls(fitted):
    return any(a.effect is ROLL_COUPLING for a in fitted.solution.structure.actives)


def test_damping_that_a_linear_model_lacks_is_sure_beside_coefficients_of_every_size():
    """Propellers' coefficients are a ten-thousandth of the hull's, whose standard errors must not suffer from it."""
    _, trials = trials_of("tug", ("zigzag", "random", "circle"), 60.0, 3, (), validate=1)
    prepared = prepare(trials, "linear")
    structure = prepared.structure.with_effect(Active(QUADRATIC_DAMPING))
    fitted = fit_from_scratch(structure, prepared.identify, null_parameters(structure), rounds=1)
    assert evidence(fitted, dropped(fitted, 0), covariance_of(fitted), 0) > 1000.0


def test_a_wind_is_sure_whose_speed_alone_is_not():
    """Its speed is known no better than its coefficients are; that it is no resistance is beyond doubt."""
    wind = {
        "cx": 2.5e-4,
        "cy": 3.6e-4,
        "cn": 3.7e-4,
        "speed": 4.9,
        "direction": 5.51,
        "gust": 0.03,
        "veer": 0.02,
    }
    _, trials = trials_of(
        "tanker", ("random", "zigzag", "pull_out", "circle"), 120.0, 5, (Effect("wind", wind),)
    )
    prepared = prepare(trials, "blanke")
    structure = prepared.structure.with_effect(Active(WIND_UNSEEN))
    p = null_parameters(structure)
    p[[k for k, s in enumerate(structure.slots) if s.name in ("north", "east")]] = -3.5, 3.5
    fitted = with_disturbances(
        fit_from_scratch(structure, with_nothing_between(prepared.identify), p, rounds=1)
    )
    covariance = covariance_of(fitted)
    flow = [k for k, s in enumerate(structure.slots) if s.name in ("north", "east")]
    away = fitted.solution.p[flow]
    wald = away @ np.linalg.solve(covariance[np.ix_(flow, flow)], away)
    said = evidence(fitted, dropped(fitted, 0), covariance, 0)
    assert wald < 30.0
    assert said > 300.0


def test_a_shallow_water_in_which_the_hull_meets_no_more_is_none():
    """What turning does besides, in the coupled form, stands for anything; the factor says that it is the water."""
    _, trials = trials_of("usv", ("zigzag", "random", "circle"), 60.0, 3, (), validate=0)
    prepared = prepare(trials, "modulus")
    active = next(a for a in candidates(prepared.structure) if a.effect is SHALLOW_WATER)
    coupled = replace(
        active, variant=replace(active.variant, options={**active.variant.options, "form": "coupled"})
    )
    structure = prepared.structure.with_effect(coupled)
    fitted = fit_from_scratch(structure, prepared.identify, null_parameters(structure), rounds=1)
    mine, _ = departure(fitted, 0)
    flow = _flow_of(fitted, mine)
    assert [structure.slots[k].name for k in flow] == ["factor"]
    assert _by_flow(fitted, covariance_of(fitted), flow) < 10.0


def test_of_many_logs_chance_finds_some_that_want_anything():
    """Which of four logs an effect is in was looked for: fourteen choices, besides all that was looked at."""
    _, trials = trials_of("usv", ("zigzag", "random", "circle", "zigzag"), 20.0, 3, (), validate=0)
    prepared = prepare(trials, "modulus")
    by_name = {a.effect.name: a for a in candidates(prepared.structure)}
    for name, more in (("mass_change", 14), ("heading_bias", 0)):
        structure = prepared.structure.with_effect(by_name[name])
        fitted = fit_from_scratch(structure, prepared.identify, null_parameters(structure), rounds=0)
        others = len(candidates(prepared.structure))
        assert _by_chance(fitted, 0) == least_gain(1, others + more)


def test_a_direction_that_nothing_tells_counts_for_nothing_however_far_it_is_off():
    covariance, off = np.diag([1e-310, 4.0]), np.array([1e200, 2.0])
    assert _wald(covariance, np.array([0, 1]), off) == pytest.approx(1.0)
    assert _wald(covariance, np.array([0]), off[:1]) == 0.0


@pytest.mark.parametrize(("late", "told"), [(0.012, False), (0.12, True)])
def test_stamps_that_are_off_as_little_as_any_are_known_in_the_fit_and_no_effect(late, told):
    truth = (
        Effect("clock_offset", {"offset": late}, None, {"stream": "position"}),
        Effect("thrust_asymmetry", {"ratio": 0.8}, "left"),
    )
    _, trials = trials_of("catamaran", ("zigzag", "random", "random"), 60.0, 3, truth)
    prepared = prepare(trials, "modulus")
    structure = prepared.structure
    for label in ("clock_offset (position)", "thrust_asymmetry (left)"):
        structure = structure.with_effect(next(a for a in candidates(prepared.structure) if a.label == label))
    p = null_parameters(structure)
    p[[s.name == "offset" for s in structure.slots]] = late
    p[[s.name == "ratio" and s.effect >= 0 for s in structure.slots]] = 0.8
    fitted = fit_from_scratch(structure, prepared.identify, p, rounds=1)
    standing = tuple(Standing(a, 1e4, 1e-9, ()) for a in structure.actives)
    found = surely(Outcome(fitted, (), standing, None))
    assert [s.active.effect.name for s in found.standing] == ["clock_offset"] * told + ["thrust_asymmetry"]
    assert found.slight == (() if told else ("clock_offset (position)",))
    assert found.fitted.chi2_per_dof == pytest.approx(fitted.chi2_per_dof, abs=0.01)
    ratio = found.fitted.solution.structure.values(found.fitted.solution.p, int(told))["ratio"]
    assert ratio == pytest.approx(0.8, abs=0.01)
