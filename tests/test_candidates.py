"""A look at a candidate begins where the fit without it is, and credits that fit with no more than it could have."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from identification_samples import structure_of, trials_of

from fixtures.effects import Effect
from identify.acting import lead_slot
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from identify.structure import null_parameters
from validate.candidates import _as_far_ahead, _starts, candidates, screen


def late(offset):
    """A fit of logs whose inputs are all late by a part of a second, with its clock as a candidate."""
    effect = Effect("clock_offset", {"offset": offset}, None, {"stream": "inputs"})
    ship, trials = trials_of("usv", ("random", "zigzag", "random"), 60.0, 5, (effect,))
    ready = prepare(trials, ship.model)
    fitted = fit_from_scratch(ready.structure, ready.identify)
    clock = [a for a in candidates(ready.structure) if a.label == "clock_offset (inputs)"]
    return fitted, clock


@pytest.mark.parametrize(("offset", "promises"), [(0.15, True), (0.08, False)])
def test_a_clock_a_little_late_is_looked_at_from_where_the_inputs_are_ahead_already(offset, promises):
    """The lead that a log's interval allows takes what it can; from nothing no step leads to the rest."""
    fitted, clock = late(offset)
    structure = fitted.solution.structure
    lead = lead_slot(structure)
    high = structure.slots[lead].parameter.bounds[1]
    assert bool(fitted.solution.p[lead] > 0.99 * high) is promises
    (seen,) = screen(fitted, clock)
    assert bool(seen.gain > 8.0) is promises
    assert not promises or seen.p[-1] == pytest.approx(offset - structure.input_lead[0], abs=0.01)


def test_no_actuator_is_begun_before_its_order():
    """Where the last input may be late, too, what they were ahead by would be a delay of less than nothing."""
    ship, trials = trials_of("usv", ("random", "zigzag"), 30.0, 5, ())
    bare = prepare(trials, ship.model).structure
    first, *_, last = [a for a in candidates(bare) if a.effect.name == "actuator_delay"]
    structure = bare.with_effect(first)
    p = null_parameters(structure)
    p[lead_slot(structure)] = structure.input_lead[0] + 0.05
    fitted = SimpleNamespace(solution=SimpleNamespace(structure=structure, p=p))
    assert _as_far_ahead(fitted, structure.with_effect(last)) == [{"delay": 0.0}]
    assert _as_far_ahead(fitted, structure) == []


@pytest.mark.parametrize(("length", "begins"), [(2.0, (0.2, 0.8)), (45.0, (0.6, 2.4)), (2000.0, (1.0, 4.0))])
def test_what_is_late_aboard_a_large_ship_is_looked_for_seconds_late(length, begins):
    plain = structure_of("blanke")
    structure = replace(plain, vessel=replace(plain.vessel, length=length))
    fitted = SimpleNamespace(
        solution=SimpleNamespace(structure=structure, p=null_parameters(structure)),
        problem=SimpleNamespace(stretches=()),
    )
    delay = next(a for a in candidates(structure) if a.label == "actuator_delay (rudder)")
    assert [s["delay"] for s in _starts(fitted, delay)] == pytest.approx(begins)


def test_no_effect_is_begun_out_of_its_bounds():
    _, trials = trials_of("catamaran", ("zigzag", "random"), 60.0, 5, validate=0)
    prepared = prepare(trials, "modulus")
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    searched = [a for a in candidates(prepared.structure) if a.effect.parameters]
    assert len(searched) > 20
    for active in searched:
        slots = prepared.structure.with_effect(active).slots
        bounds = {s.name: s.parameter.bounds for s in slots if s.effect == 0}
        begins = [(bounds[name], value) for start in _starts(fitted, active) for name, value in start.items()]
        assert begins and all(low <= value <= high for (low, high), value in begins), active.label
