"""A chosen model that lacks terms is another one by name, where that has just these."""

from __future__ import annotations

import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.effects import EFFECTS
from identify.prepare import prepare
from identify.richer_model import richer_model
from validate import analysis
from validate.candidates import candidates
from validate.diagnosis import Verdict
from validate.search_in_waves import searched


def lacking(vessel, model, *effects):
    _, trials = trials_of(vessel, ("zigzag",), 20.0, 3, validate=0)
    structure = prepare(trials, model).structure
    for name in effects:
        structure = structure.with_effect(
            next(a for a in candidates(structure, EFFECTS) if a.effect.name == name)
        )
    return structure


@pytest.mark.parametrize(
    ("vessel", "model", "effects", "richer"),
    [
        ("catamaran", "linear", ("quadratic_damping",), "modulus"),
        ("usv", "linear", ("quadratic_damping", "current"), "modulus"),
        ("catamaran", "linear", (), None),
        ("catamaran", "linear", ("current",), None),
        ("catamaran", "linear", ("quadratic_damping", "port_starboard_asymmetry"), None),
        ("tanker", "blanke", ("linear_damping",), None),
    ],
)
def test_a_model_with_the_terms_that_it_lacks_has_the_name_of_the_one_that_has_them(
    vessel, model, effects, richer
):
    assert richer_model(lacking(vessel, model, *effects)) == richer


@pytest.fixture
def asked_once(monkeypatch):
    """What two analyses of the same trials ask alike, a model and what it lacks, is answered once."""
    plain, known = analysis._identify, {}

    def identify(trials, model, *rest):
        if len(rest) > 5:  # goes on from what was found before
            return plain(trials, model, *rest)
        key = id(trials), model, rest[:4]
        known[key] = known.get(key) or (trials, plain(trials, model, *rest))
        return known[key][1]

    monkeypatch.setattr(analysis, "_identify", identify)


@pytest.mark.usefixtures("asked_once")
def test_a_model_that_was_chosen_grows_with_what_else_it_lacks_and_one_that_was_declared_does_not(
    monkeypatch,
):
    searches = []
    monkeypatch.setattr(analysis, "searched", lambda *a: searches.append(a) or searched(*a))
    current = Effect("current", {"speed": 0.2, "direction": 1.0})
    _, trials = trials_of("catamaran", ("zigzag", "random", "circle"), 30.0, 4, (current,))
    chosen = analysis.analyse(trials, model="linear", grows=True)
    assert chosen.before.model == "modulus"
    assert chosen.diagnosis.verdict is Verdict.EXPLAINED
    [effect] = chosen.diagnosis.effects
    values = {p.name: p.value for p in effect.fitted.parameters}
    assert values == pytest.approx({"speed": 0.2, "direction": 1.0}, rel=0.05)
    assert [r.accepted for r in chosen.diagnosis.rounds if r.accepted] == ["current"]
    assert len(searches) == 1, "what was found beside the terms was looked for again"
    declared = analysis.analyse(trials, model="linear")
    assert declared.before.model == "linear"
    assert sorted(e.fitted.name for e in declared.diagnosis.effects) == ["current", "quadratic_damping"]


@pytest.mark.usefixtures("asked_once")
def test_a_model_that_lacks_nothing_but_terms_grows_to_one_that_is_adequate():
    _, trials = trials_of("catamaran", ("zigzag", "random", "circle"), 30.0, 4)
    chosen, declared = (analysis.analyse(trials, model="linear", grows=grows) for grows in (True, False))
    assert chosen.before.model == "modulus"
    assert chosen.diagnosis.verdict is Verdict.ADEQUATE
    assert declared.before.model == "linear"
    assert [e.fitted.name for e in declared.diagnosis.effects] == ["quadratic_damping"]
