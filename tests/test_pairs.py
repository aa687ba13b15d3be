"""Two effects each of which hides the other are found together."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import pytest
from identification_samples import trials_of

import validate.rounds
from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import FAR
from identify.noise import dispersed_cost
from identify.prepare import prepare
from validate.candidates import candidates
from validate.pace import Pace
from validate.pairs import best_pair, promises, two_for_one
from validate.refits import under
from validate.rounds import Turn, _in_pairs, _turn


@pytest.mark.slow
def test_a_strong_current_and_an_offset_of_the_rudder_where_neither_alone_is_enough():
    effects = (
        Effect("current", {"speed": 0.7, "direction": 3.2}),
        Effect("actuator_offset", {"offset": 0.12}, "rudder"),
    )
    _, trials = trials_of("usv", ("zigzag", "random", "zigzag"), 45.0, 6, effects)
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


BOTH = {"actuator_offset (right)", "thrust_asymmetry (right)"}


@cache
def off_and_weak(offset=0.04, ratio=0.92):
    """A thruster that is off its neutral and weak besides, at many speeds."""
    effects = (
        Effect("actuator_offset", {"offset": offset}, "right"),
        Effect("thrust_asymmetry", {"ratio": ratio}, "right"),
    )
    logs = ("speed", "random", "zigzag", "speed")
    return prepare(trials_of("catamaran", logs, 90.0, 6, effects, validate=0)[1], "modulus")


def with_causes(prepared, *labels):
    """The model fitted with some causes, as a search has it that took them."""
    structure = prepared.structure
    for label in labels:
        structure = structure.with_effect(next(a for a in candidates(structure) if a.label == label))
    return fit_from_scratch(structure, prepared.identify)


def test_two_causes_take_the_place_of_a_third_that_made_up_for_them():
    fitted = with_causes(off_and_weak(), "port_starboard_asymmetry")
    assert fitted.chi2_per_dof < FAR
    found = two_for_one(fitted)
    assert {a.label for a in found.solution.structure.actives} == BOTH
    assert (
        dispersed_cost(found.problem, found.solution)
        < dispersed_cost(fitted.problem, fitted.solution) - 100.0
    )
    assert two_for_one(found) is None
    other = two_for_one(fitted, barred=("thrust_asymmetry",))
    named = set() if other is None else {a.effect.name for a in other.solution.structure.actives}
    assert "thrust_asymmetry" not in named, "what was taken back does not come in by another door"


def test_what_was_taken_rightly_is_not_exchanged_for_two():
    fitted = with_causes(off_and_weak(ratio=1.0), "actuator_offset (right)")
    assert not fitted.is_off
    assert two_for_one(fitted) is None


def test_a_promise_is_what_a_fit_with_both_gains_where_the_fit_is_near_it():
    prepared = off_and_weak(0.002, 0.995)
    base = fit_from_scratch(prepared.structure, prepared.identify)
    actives = [a for a in candidates(prepared.structure) if a.label in BOTH]
    [promise] = promises(base, actives)
    both = under(base.problem, with_causes(prepared, *sorted(BOTH)), 20)
    gained = base.solution.total - both.solution.total
    assert gained > 50.0
    assert promise.gain == pytest.approx(gained, rel=0.4)


def test_what_takes_a_parameter_of_the_fit_away_is_in_no_pair():
    """Inputs that have a clock of their own are not ahead of it as well: the first order would be of another place."""
    base = with_causes(off_and_weak(), "port_starboard_asymmetry")
    actives = candidates(base.solution.structure)
    named = {a.label for x in promises(base, actives) for a in x.causes}
    assert "clock_offset (inputs)" not in named
    assert not {f"actuator_delay ({i})" for i in ("left", "right")} <= named
    assert named >= BOTH


def test_at_the_noise_no_pair_is_looked_for():
    base = with_causes(off_and_weak(), *sorted(BOTH))
    asked = []
    assert best_pair(base, None, candidates(base.solution.structure), asked.append) is None
    assert not asked


@pytest.mark.parametrize(
    ("p_value", "together", "found"), [(1e-9, True, 2), (1e-9, False, 0), (1e-2, True, 0)]
)
def test_near_the_noise_what_is_sure_but_not_worth_a_name_is_looked_at_with_another(
    monkeypatch, p_value, together, found
):
    """A compass that is late predicts no worse as long as nobody knows that it is off as well."""
    off, late, both = (
        SimpleNamespace(chi2_per_dof=1.1, problem=name, solution=SimpleNamespace(structure=SimpleNamespace(actives=())))
        for name in ("off", "late", "both")
    )  # fmt: skip
    judged = SimpleNamespace(label="late", fitted=late, p_value=p_value, evidence=100.0)
    other = Turn(late, (), (), SimpleNamespace(label="off", fitted=both))
    for name, stub in {
        "_turn": lambda fitted, pace, barred: other, "settled": lambda fitted: fitted,
        "under": lambda problem, fitted: fitted, "consistent": lambda base, fit: True,
        "at_bound": lambda fit: False, "worthwhile": lambda base, fit: together,
    }.items():  # fmt: skip
        monkeypatch.setattr(validate.rounds, name, stub)
    turns = _in_pairs(Turn(off, (), (judged,), None), Pace())
    assert [t.taken for t in turns if t.taken] == [judged, other.taken][:found]


@pytest.mark.parametrize(
    ("still", "chi2", "taken"), [(False, 1.2, True), (True, 1.2, False), (False, 9.0, False)]
)
def test_what_swings_stands_for_waves_where_none_are_seen_with_it(monkeypatch, still, chi2, taken):
    """Waves that a fit knows of leave nothing of a roll: it is looked at without them, and alone."""
    structure = SimpleNamespace(actives=())
    fit = SimpleNamespace(
        problem=SimpleNamespace(swell="seen"), solution=SimpleNamespace(structure=structure)
    )
    effects = {
        n: SimpleNamespace(name=n, fixed_terms=n == "roll_coupling")
        for n in ("wind", "roll_coupling", "current")
    }
    judged = SimpleNamespace(label="roll", fitted=SimpleNamespace(chi2_per_dof=chi2))
    after = SimpleNamespace(problem=SimpleNamespace(swell="seen" if still else None))
    seen = []

    def turn(fitted, pace, barred):
        seen.append((fitted, barred))
        return Turn(fitted, (), (judged,), judged)

    for name, stub in {
        "candidates": lambda structure: [SimpleNamespace(effect=e) for e in effects.values()], "_turn": turn,
        "without_waves": lambda fitted: "bare", "_after": lambda judged: after,
    }.items():  # fmt: skip
        monkeypatch.setattr(validate.rounds, name, stub)
    found = validate.rounds._swinging(fit, Pace(), frozenset({"current"}))
    assert (found is not None) is taken
    assert not taken or (found[0].taken, found[1]) == (judged, after)
    assert seen == [("bare", frozenset({"wind", "current"}))]
