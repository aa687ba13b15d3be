"""Two effects each of which hides the other are found together."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from identification_samples import trials_of

import validate.rounds
from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import FAR
from identify.prepare import prepare
from validate.pace import Pace
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
