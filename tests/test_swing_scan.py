"""What swings by itself, looked for in the accelerations."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from identification_samples import structure_of, trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active
from identify.effects import EFFECTS
from identify.effects.hull import CROSS_TERMS, ROLL_COUPLING
from identify.fitted import Fitted
from identify.prepare import prepare
from identify.rough_fit import roughly_from
from ingest.errors import NotIdentifiable
from validate.candidates import candidates, screen
from validate.refits import refit
from validate.scan import MUCH, gain_and_value
from validate.swing_scan import VALLEYS, swings, wanted_swings

ROLLS = [
    ("usv", {"frequency": 0.56, "damping": 0.106, "sway": -0.321, "yaw": 0.236}),
    ("usv", {"frequency": 0.284, "damping": 0.15, "sway": -0.488, "yaw": -0.185}),
    ("tanker", {"frequency": 0.448, "damping": 0.117, "sway": -0.42, "yaw": -0.326}),
    ("tanker", {"frequency": 0.361, "damping": 0.106, "sway": -0.321, "yaw": 0.236}),
]


@cache
def rolling(k: int | None, vessel: str) -> Fitted:
    """A fit without a roll of trials with the k-th."""
    effects = () if k is None else (Effect("roll_coupling", ROLLS[k][1]),)
    ship, trials = trials_of(vessel, ("zigzag", "random", "circle", "zigzag10"), 120.0, 6, effects)
    prepared = prepare(trials, ship.model)
    return fit_from_scratch(prepared.structure, prepared.identify)


def with_roll(fit: Fitted):
    structure = fit.solution.structure.with_effect(Active(ROLL_COUPLING))
    return structure, structure.carried(fit.solution.p, fit.solution.structure)


@pytest.mark.parametrize(("k", "vessel"), [(k, vessel) for k, (vessel, _) in enumerate(ROLLS)])
def test_a_roll_is_one_of_the_few_valleys_with_what_it_pushes_with(k, vessel):
    fit = rolling(k, vessel)
    structure, p = with_roll(fit)
    found = wanted_swings(structure, fit.problem.stretches, p)
    assert 0 < len(found) <= VALLEYS
    assert [gain for gain, _ in found] == sorted((gain for gain, _ in found), reverse=True)
    own = [structure.values(q, 0) for _, q in found]
    roll = ROLLS[k][1]
    near = [x for x in own if x["frequency"] == pytest.approx(roll["frequency"], rel=0.15)]
    assert near
    assert np.sign(near[0]["sway"]) == np.sign(roll["sway"]) and np.sign(near[0]["yaw"]) == np.sign(
        roll["yaw"]
    )
    gain, q = gain_and_value(structure, fit.problem.stretches, p)
    assert gain == found[0][0] > MUCH
    assert np.array_equal(q, found[0][1])


@pytest.mark.parametrize(("k", "vessel"), [(k, vessel) for k, (vessel, _) in enumerate(ROLLS)])
def test_a_refit_from_far_off_finds_it(k, vessel):
    fit = rolling(k, vessel)
    [screened] = screen(fit, [a for a in candidates(fit.solution.structure) if a.effect is ROLL_COUPLING])
    found = refit(fit, screened)
    assert found.chi2_per_dof < max(0.05 * fit.chi2_per_dof, 1.3)
    own = found.solution.structure.values(found.solution.p, 0)
    assert own["frequency"] == pytest.approx(ROLLS[k][1]["frequency"], rel=0.1)


def test_without_a_roll_there_is_none_that_the_accelerations_want():
    fit = rolling(None, "usv")
    structure, p = with_roll(fit)
    gain, _ = gain_and_value(structure, fit.problem.stretches, p)
    assert gain < MUCH


def test_windows_of_a_quick_roll_that_hold_hardly_a_sample_are_no_begin():
    fit = rolling(None, "usv")
    structure, p = with_roll(fit)
    p[[s.name == "frequency" for s in structure.slots]] = 3.0
    with pytest.raises(NotIdentifiable):
        roughly_from(structure, fit.problem.stretches, p, 0.2)


def test_only_a_roll_swings():
    structure = structure_of("modulus")
    assert not swings(structure)
    assert [e.name for e in EFFECTS if any(x.shape for x in e.parameters)] == ["roll_coupling"]
    both = structure.with_effect(Active(ROLL_COUPLING)).with_effect(Active(CROSS_TERMS))
    assert swings(both, 0) and not swings(both)
