"""Of two thrusters the weaker is named; among more the odd one, be it weaker or stronger."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from identification_samples import structure_of, trials_of

from fixtures import vessels
from fixtures.actuators import Actuator
from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fit import Estimated, FittedEffect
from identify.prepare import prepare
from identify.report_fit import make_fit
from identify.simulate.rebuild import rebuild
from preprocess.vessel import Input
from validate.advice import _either_of_two
from validate.candidates import candidates
from validate.diagnosis import TakenEffect
from validate.loop import search


def tripled():
    """The catamaran with a third thruster on its centre line, turned up for speed but not for steering."""
    twin = vessels.catamaran()
    third = Actuator("middle", "thruster", 40.0, (-0.2, 0.0), rate=4.0, throttle=0.35)
    sides = (replace(a, throttle=0.4) for a in twin.actuators)
    return replace(twin, actuators=(*sides, third))


@pytest.mark.parametrize(("name", "ratio"), [("middle", 1.3), ("left", 0.8)])
def test_among_three_thrusters_the_odd_one_is_named(monkeypatch, name, ratio):
    monkeypatch.setattr(vessels, "VESSELS", {"three": tripled})
    effect = Effect("thrust_asymmetry", {"ratio": ratio}, name)
    ship, trials = trials_of("three", ("random", "speed", "zigzag"), 90.0, 7, (effect,), validate=0)
    prepared = prepare(trials, ship.model)
    found = search(prepared, fit_from_scratch(prepared.structure, prepared.identify))
    [standing] = found.standing
    assert standing.active.label == f"thrust_asymmetry ({name})"
    fit = make_fit(prepared, found.fitted, estimator="output_error", optimiser="auto", seed=0)
    [value] = fit.effects[0].parameters
    assert abs(value.value - ratio) < 3.0 * value.stderr < 0.1
    assert rebuild(fit).structure.actives[0].effect.parameters[0].bounds[1] > 1.0
    assert _either_of_two([TakenEffect(fit.effects[0], 0.0, ())], found) == []


def test_of_two_the_weaker_is_named_and_the_other_reading_told():
    motors = tuple(Input(n, "thruster", position=(-0.4, y)) for n, y in (("left", -0.3), ("right", 0.3)))
    structure = structure_of("modulus", motors)
    of_two = [a for a in candidates(structure) if a.effect.name == "thrust_asymmetry"]
    assert len(of_two) == 2
    assert all(a.effect.parameters[0].bounds == (0.0, 1.0) for a in of_two)
    weak = FittedEffect("thrust_asymmetry", "left", (Estimated("", "ratio", 0.8, 0.01, "1"),), {})
    outcome = SimpleNamespace(fitted=SimpleNamespace(solution=SimpleNamespace(structure=structure)))
    assert _either_of_two([TakenEffect(weak, 0.0, ())], outcome) == [
        "Of two only their ratio is known: right may as well give 1.25 times left."
    ]
