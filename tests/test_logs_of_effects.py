"""In which logs an effect on some logs is there, and in which of its forms: what the measurements say."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.drive import drive
from identify.effect import Active, Variant
from identify.effects.hull import PORT_STARBOARD_ASYMMETRY
from identify.effects.sensors import CLOCK_OFFSET_INPUTS, MASS_CHANGE
from identify.effects.water_and_air import SHALLOW_WATER
from identify.fitted import FAR
from identify.output_error import Stopped
from identify.prepare import prepare
from identify.rough_fit import thin
from identify.structure import null_parameters
from identify.windows import cut
from validate import log_groups
from validate.exchange import in_likeliest_form
from validate.judgement import INDISTINCT
from validate.log_groups import free_in_logs, in_likeliest_logs
from validate.logs_of_effects import in_logs_as_they_say
from validate.look_alikes import Standing, standing
from validate.outcome import Outcome
from validate.refits import begun_at
from validate.told_logs import _tells, told_of_the_odd_logs

MANOEUVRES = ("zigzag", "random", "zigzag", "random")


@cache
def loaded_in(*logs):
    effect = Effect("mass_change", {"ratio": 1.3}, options={"logs": logs})
    _, trials = trials_of("usv", MANOEUVRES, 60.0, 4, (effect,), validate=2)
    return prepare(trials, "modulus")


def test_a_load_is_found_in_any_of_the_logs():
    """Runs are loaded and light by turns as often as in order."""
    effect = Effect("mass_change", {"ratio": 1.3}, options={"logs": (1, 3)})
    _, trials = trials_of("usv", (*MANOEUVRES, "random"), 60.0, 4, (effect,))
    found = in_likeliest_logs(fitted_with(prepare(trials, "modulus"), 1, 2, 3).fitted, INDISTINCT)
    active = found.solution.structure.actives[0]
    assert active.variant.options["logs"] == tuple(found.solution.structure.setting.logs[k] for k in (1, 3))
    assert found.solution.structure.values(found.solution.p, 0)["ratio"] == pytest.approx(1.3, abs=0.03)


@pytest.mark.parametrize("model", ["blanke", "linear", "zhu2019"])
def test_a_heavy_load_is_found_in_its_logs_by_a_model_that_is_far_off(model):
    effect = Effect("mass_change", {"ratio": 1.6}, options={"logs": (1, 3)})
    _, trials = trials_of("usv", (*MANOEUVRES, "random"), 60.0, 4, (effect,))
    begun = fitted_with(prepare(trials, model), 1, 2, 3).fitted
    assert begun.chi2_per_dof > FAR
    found = in_likeliest_logs(begun, INDISTINCT).solution.structure
    assert found.actives[0].variant.options["logs"] == tuple(found.setting.logs[k] for k in (1, 3))


def test_what_a_fit_still_gains_by_itself_lets_no_log_in(monkeypatch):
    """Gone on with in other logs, a fit that had used up its steps would be better in any of them."""
    effect = Effect("mass_change", {"ratio": 1.3}, options={"logs": (1, 3)})
    _, trials = trials_of("usv", (*MANOEUVRES, "random"), 60.0, 4, (effect,))
    there = fitted_with(prepare(trials, "modulus"), 1, 3).fitted
    p = np.where([s.name == "ratio" for s in there.solution.structure.slots], 1.02, 0.9 * there.solution.p)
    begun = begun_at(there, p, 2)
    assert begun.solution.stopped is Stopped.BUDGET
    assert begun.solution.total > there.solution.total + 10.0 * INDISTINCT
    asked = []
    monkeypatch.setattr(log_groups, "_refitted", lambda f, _: asked.append(f.solution.total) or f)
    found = in_likeliest_logs(begun, INDISTINCT)
    assert found.solution.structure.actives == there.solution.structure.actives
    assert asked == pytest.approx([there.solution.total] * len(asked), abs=INDISTINCT)


@pytest.mark.parametrize("length", [10.0, 15.0, 30.0])
def test_some_of_the_windows_are_of_every_log(length):
    prepared = loaded_in(1, 3)
    problem = cut(prepared.identify, length)
    left = {problem.stretches[w.stretch].name for w in problem.windows[thin(problem, 5)]}
    assert left == {s.name for s in prepared.identify}
    assert length > 10.0 or len(problem.windows[thin(problem, 5)]) < len(problem.windows)


def fitted_with(prepared, *logs, **form):
    names = prepared.structure.setting.logs
    active = Active(MASS_CHANGE, Variant(options={"logs": tuple(names[k] for k in logs), **form}))
    structure = prepared.structure.with_effect(active)
    fitted = fit_from_scratch(structure, prepared.identify, null_parameters(structure), rounds=1)
    return Outcome(fitted, (), (Standing(active, 100.0, 1e-9, ()),), None)


@pytest.mark.parametrize("said", [(1,), (1, 2), (1, 2, 3)])
def test_an_unseen_log_says_itself_whether_the_vessel_was_loaded(said):
    prepared = loaded_in(1, 3)
    names = prepared.structure.setting.logs
    found = in_logs_as_they_say(fitted_with(prepared, *said), prepared)
    for active in (found.standing[0].active, found.fitted.solution.structure.actives[0]):
        assert active.variant.options["logs"] == (names[1], names[3])


@pytest.mark.parametrize("form", [{}, {"form": "whole"}])
def test_coriolis_terms_stay_where_the_measurements_say_so(form):
    fitted = fitted_with(loaded_in(1, 3), 1, **form).fitted
    assert "form" not in in_likeliest_form(fitted).solution.structure.actives[0].variant.options


@pytest.mark.parametrize(("times", "form"), [(1.0, None), (1.5, "apart")])
def test_what_another_effect_adds_goes_with_a_load_unless_the_measurements_say_otherwise(times, form):
    """A push that is 1.5 times as strong where the vessel is 1.5 times as heavy accelerates it as before."""
    sizes = {"sway": 0.05, "yaw": 0.06}
    truth = [Effect("mass_change", {"ratio": 1.5}, options={"logs": (1, 3)})]
    for logs, by in (((0, 2), 1.0), ((1, 3), times)):
        there = {name: by * value for name, value in sizes.items()}
        truth.append(Effect("port_starboard_asymmetry", there, options={"logs": logs}))
    _, trials = trials_of("usv", MANOEUVRES, 60.0, 4, tuple(truth), validate=0)
    prepared = prepare(trials, "modulus")
    pushed = prepared.structure.with_effect(Active(PORT_STARBOARD_ASYMMETRY, Variant()))
    found = in_likeliest_form(fitted_with(replace(prepared, structure=pushed), 1, 3).fitted).solution
    assert found.structure.actives[1].variant.options.get("form") == form
    assert found.structure.values(found.p, 1)["ratio"] == pytest.approx(1.5, abs=0.03)


@pytest.mark.parametrize(("form", "pushed"), [(None, 0.8), ("apart", 1.0), ("whole apart", 1.0)])
def test_what_other_effects_add_is_divided_by_a_load_or_stays(form, pushed):
    prepared = loaded_in(1, 3)
    options = {"logs": (prepared.structure.setting.logs[1],)} | ({"form": form} if form else {})
    structure = prepared.structure.with_effect(Active(MASS_CHANGE, Variant(options=options)))
    structure = structure.with_effect(Active(PORT_STARBOARD_ASYMMETRY, Variant()))
    values = np.where([s.name == "ratio" for s in structure.slots], 1.25, 1.0)
    factor = drive(structure, values, prepared.identify[1]).factor
    added = {float(f) for f, t in zip(factor, structure.table.terms, strict=True) if t.text == "1"}
    assert [*added] == [pytest.approx(pushed)]


def test_shallow_water_has_coriolis_terms_grow_where_the_measurements_say_so():
    prepared = loaded_in(1, 3)
    names = prepared.structure.setting.logs
    [stay, grow] = [
        Active(SHALLOW_WATER, Variant(options={"logs": (names[1],), **form}))
        for form in ({}, {"form": "whole"})
    ]
    values = np.where([s.effect < 0 for s in prepared.structure.with_effect(stay).slots], 1.0, 1.5)
    factors = [
        drive(prepared.structure.with_effect(a), values, prepared.identify[1]).factor for a in (stay, grow)
    ]
    roles = [t.role for t in prepared.structure.with_effect(stay).table.terms]
    assert {f for f, role in zip(factors[0], roles, strict=True) if role == "hull"} == {1.5}
    assert {f for f, role in zip(factors[0], roles, strict=True) if role == "inertial"} == {1.0}
    assert {f for f, role in zip(factors[1], roles, strict=True) if role in ("hull", "inertial")} == {1.5}
    others = [v.options.get("form") for v in SHALLOW_WATER.forms(grow.variant)]
    assert others == [None, "coupled"]


@pytest.mark.parametrize("later", [(), (Active(CLOCK_OFFSET_INPUTS, Variant()),)])
def test_where_sway_and_yaw_share_inertia_a_part_of_what_turning_does_grows(later):
    """A hull whose forces grow by a quarter seems to do so by more, by one factor for all; whatever came later."""
    effect = Effect("shallow_water", {"factor": 1.25}, options={"logs": (1,)})
    _, trials = trials_of("cybership", MANOEUVRES, 120.0, 4, (effect,), validate=0)
    prepared = prepare(trials, "cybership2")
    log = prepared.structure.setting.logs[1]
    structure = prepared.structure.with_effect(Active(SHALLOW_WATER, Variant(options={"logs": (log,)})))
    for active in later:
        structure = structure.with_effect(active)
    plain = fit_from_scratch(structure, prepared.identify, null_parameters(structure))
    found = in_likeliest_form(plain)
    there = found.solution.structure
    assert there.actives[0].variant.options["form"] == "coupled"
    one, other = (f.solution.structure.values(f.solution.p, 0)["factor"] for f in (plain, found))
    assert abs(other - 1.25) < 0.5 * abs(one - 1.25)
    own = [k for k, t in enumerate(there.table.terms) if k >= len(there.setting.terms) and t.text == "ur"]
    factors = [drive(there, found.solution.p, s).factor[own] for s in prepared.identify]
    assert [set(f) for f in factors] == [{0.0}, {1.0}, {0.0}, {0.0}]


@pytest.mark.parametrize(
    ("said", "form", "odd"),
    [((1, 3), {}, (0, 2)), ((0, 1, 3), {}, (2,)), ((0, 1, 3), {"form": "whole"}, (2,)), ((0, 2), {}, (0, 2))],
)
def test_a_load_is_told_of_fewer_logs_and_of_as_many_the_heavier(said, form, odd):
    effect = Effect("mass_change", {"ratio": 1.5}, options={"logs": odd, **form})
    _, trials = trials_of("usv", MANOEUVRES, 60.0, 4, (effect,), validate=0)
    outcome = fitted_with(prepare(trials, "modulus"), *said, **form)
    told = told_of_the_odd_logs(outcome)
    structure = told.fitted.solution.structure
    assert structure.actives[0].variant.options["logs"] == tuple(structure.setting.logs[k] for k in odd)
    assert structure.values(told.fitted.solution.p, 0)["ratio"] == pytest.approx(1.5, abs=0.05)
    assert told.standing[0].active == structure.actives[0]
    assert told.fitted.solution.total == pytest.approx(outcome.fitted.solution.total, abs=2.0)
    assert (told is outcome) == (said == odd)


@pytest.mark.parametrize(
    ("named", "others", "ratio", "tells"),
    [
        (3, 2, 1.3, True),
        (3, 2, 0.8, False),
        (2, 2, 0.8, False),
        (1, 3, 0.8, True),
        (3, 1, 1.3, False),
        (2, 0, 0.8, True),
    ],
)
def test_a_load_is_told_of_the_heavier_logs_unless_the_others_are_far_fewer(named, others, ratio, tells):
    assert _tells(named, others, ratio) is tells


def test_what_is_told_of_the_odd_log_is_no_look_alike_of_itself():
    effect = Effect("mass_change", {"ratio": 1.5}, options={"logs": (2,)})
    _, trials = trials_of("usv", MANOEUVRES, 60.0, 4, (effect,), validate=0)
    outcome = fitted_with(prepare(trials, "modulus"), 0, 1, 3)
    odd = f"mass_change ({outcome.fitted.solution.structure.setting.logs[2]})"
    alike = replace(outcome.standing[0], look_alikes=(odd, "thrust_fade"))
    told = told_of_the_odd_logs(replace(outcome, standing=(alike,)))
    assert told.standing[0].active.label == odd
    assert told.standing[0].look_alikes == ("thrust_fade",)


def test_the_same_said_of_all_other_logs_is_no_look_alike_of_a_load():
    """Lighter in the others by as much: a person who looks for the cause has one, not two that cannot be told apart."""
    effect = Effect("mass_change", {"ratio": 1.5}, options={"logs": (0,)})
    _, trials = trials_of("usv", MANOEUVRES, 60.0, 4, (effect,), validate=0)
    fitted = fitted_with(prepare(trials, "modulus"), 0).fitted
    stands = standing(fitted, 0)
    assert stands.rivals  # it explains as much
    assert not any(name.startswith("mass_change") for name in stands.look_alikes)


@pytest.mark.parametrize(
    ("depths", "free"), [((None,) * 4, True), ((20.0,) * 4, True), ((20.0, 20.0, 3.0, None), False)]
)
def test_a_depth_that_is_the_same_for_all_logs_says_nothing_of_where_the_water_is_shallow(depths, free):
    structure = loaded_in("log0").structure
    setting = replace(structure.setting, depths=depths)
    structure = replace(structure, setting=setting)
    ways = SHALLOW_WATER.variants(setting)
    assert len(ways) == (len(setting.identify_logs) if free else 1)
    assert free_in_logs(Active(SHALLOW_WATER, ways[0]), structure) is free
