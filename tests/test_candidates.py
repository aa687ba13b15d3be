"""A look at a candidate begins where the fit without it is, and credits that fit with no more than it could have."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import structure_of, trials_of

from fixtures.effects import Effect
from identify.acting import lead_slot
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from identify.structure import null_parameters
from validate import candidates as looked_at
from validate.candidates import (
    Screened,
    _screen_at_null,
    bend_alike,
    candidates,
    readings,
    screen,
)
from validate.starts import as_far_ahead, starts_of


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


def test_what_bends_an_input_about_its_zero_is_not_looked_at_beside_what_does_too():
    """Two dead bands and two offsets followed the thrust of propellers that push less astern, and were no causes."""
    ship, trials = trials_of("catamaran", ("random", "zigzag"), 30.0, 5, ())
    bare = prepare(trials, ship.model).structure
    every = {a.label: a for a in candidates(bare)}
    dead = every["actuator_deadband (left, neutral, shifted)"]
    gone = every.keys() - {a.label for a in candidates(bare.with_effect(dead))}
    assert "actuator_offset (left)" in gone
    assert "actuator_offset (right)" not in gone
    play = bare.with_effect(every["actuator_deadband (left, play)"])
    assert "actuator_offset (left)" in {a.label for a in candidates(play)}
    offset = every["actuator_offset (left)"]
    assert [bend_alike(a, offset) for a in (dead, every["actuator_offset (right)"])] == [True, False]


def test_no_actuator_is_begun_before_its_order():
    """Where the last input may be late, too, what they were ahead by would be a delay of less than nothing."""
    ship, trials = trials_of("usv", ("random", "zigzag"), 30.0, 5, ())
    bare = prepare(trials, ship.model).structure
    first, *_, last = [a for a in candidates(bare) if a.effect.name == "actuator_delay"]
    structure = bare.with_effect(first)
    p = null_parameters(structure)
    p[lead_slot(structure)] = structure.input_lead[0] + 0.05
    fitted = SimpleNamespace(solution=SimpleNamespace(structure=structure, p=p))
    assert as_far_ahead(fitted, structure.with_effect(last)) == [{"delay": 0.0}]
    assert as_far_ahead(fitted, structure) == []


@pytest.mark.parametrize("phased", [False, True])
def test_what_is_late_by_less_than_a_sample_is_looked_for_within_it(phased, monkeypatch):
    """Inputs that are logged ten times a second hide it: the fit is at the noise, and a start of 0.2 s is too far.

    Where they may be as old each time that they are entered, what is always as late is told less well.
    """
    if not phased:
        monkeypatch.setattr("identify.unlogged._with_phases", lambda _, known, raw=None: known)
    late = Effect("actuator_delay", {"delay": 0.06}, "right")
    ship, trials = trials_of("catamaran", ("random", "zigzag", "random"), 40.0, 5, (late,), validate=0)
    ready = prepare(trials, ship.model)
    fitted = fit_from_scratch(ready.structure, ready.identify)
    hidden = fitted.problem.unlogged
    assert fitted.chi2_per_dof < 1.02
    assert hidden.phased is not None if phased else hidden.share > 0.0
    delays = {a.label: a for a in candidates(ready.structure) if a.effect.name == "actuator_delay"}
    found, *others = screen(fitted, list(delays.values()))
    phase = 0.1 / np.sqrt(12.0 * len(fitted.problem.windows))
    times, error = (1.2, 2.0 * phase) if phased else (2.0, 0.005)
    assert found.active.label == "actuator_delay (right)"
    assert found.gain > times * max(s.gain for s in others)
    assert found.p[-2] == pytest.approx(0.06, abs=error)
    none = replace(fitted, problem=replace(fitted.problem, unlogged=None))
    within = [s["delay"] for s in starts_of(fitted, found.active) if s not in starts_of(none, found.active)]
    assert within == pytest.approx([0.025, 0.05, 0.075, 0.1])


@pytest.mark.parametrize(("length", "begins"), [(2.0, (0.2, 0.8)), (45.0, (0.6, 2.4)), (2000.0, (1.0, 4.0))])
def test_what_is_late_aboard_a_large_ship_is_looked_for_seconds_late(length, begins):
    plain = structure_of("blanke")
    structure = replace(plain, vessel=replace(plain.vessel, length=length))
    fitted = SimpleNamespace(
        solution=SimpleNamespace(structure=structure, p=null_parameters(structure)),
        problem=SimpleNamespace(stretches=(), unlogged=None),
    )
    delay = next(a for a in candidates(structure) if a.label == "actuator_delay (rudder)")
    assert [s["delay"] for s in starts_of(fitted, delay)] == pytest.approx(begins)


@pytest.mark.parametrize(("length", "slowest"), [(2.0, 0.2), (45.0, 0.2 / 3.0), (2000.0, 0.04)])
def test_a_large_ship_may_roll_as_much_more_slowly(length, slowest):
    plain = structure_of("zhu2019")
    structure = replace(plain, vessel=replace(plain.vessel, length=length))
    roll = next(a for a in candidates(structure) if a.label == "roll_coupling")
    slot = next(s for s in structure.with_effect(roll).slots if s.name == "frequency")
    assert slot.parameter.bounds == pytest.approx((slowest, 75.0 * slowest))
    assert min(slot.parameter.starts) == pytest.approx(1.1 * slowest)


def test_no_effect_is_begun_out_of_its_bounds():
    _, trials = trials_of("catamaran", ("zigzag", "random"), 60.0, 5, validate=0)
    prepared = prepare(trials, "modulus")
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    searched = [a for a in candidates(prepared.structure) if a.effect.parameters]
    assert len(searched) > 20
    for active in searched:
        slots = prepared.structure.with_effect(active).slots
        bounds = {s.name: s.parameter.bounds for s in slots if s.effect == 0}
        begins = [
            (bounds[name], value) for start in starts_of(fitted, active) for name, value in start.items()
        ]
        assert begins and all(low <= value <= high for (low, high), value in begins), active.label


def test_what_overflows_on_the_way_promises_nothing_and_costs_no_other_its_look(monkeypatch):
    """Derivatives of a candidate may overflow along a path that itself does not."""
    _, trials = trials_of("usv", ("zigzag",), 40.0, 4, (), validate=0)
    prepared = prepare(trials, "modulus")
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0)
    some = [
        a
        for a in candidates(prepared.structure)
        if a.label in ("current", "heading_bias", "quadratic_damping")
    ]
    before = {s.active.label: s.gain for s in _screen_at_null(fitted, some)}
    known = looked_at.normal

    def overflowing(fitted, wide, p):
        information, score, cost = known(fitted, wide, p)
        spoilt = [k for k, s in enumerate(wide.slots) if s.effect >= 0 and s.name == "bias"]
        information[spoilt], information[:, spoilt], score[spoilt] = np.inf, np.nan, np.nan
        return information, score, cost

    monkeypatch.setattr(looked_at, "normal", overflowing)
    after = {s.active.label: s.gain for s in _screen_at_null(fitted, some)}
    assert after.pop("heading_bias") == -np.inf
    assert after == pytest.approx({k: before[k] for k in after})


def test_a_cause_is_looked_at_in_each_of_its_forms():
    effect = Effect("mass_change", {"ratio": 1.3}, options={"logs": (1, 2)})
    _, trials = trials_of("usv", ("zigzag", "random", "zigzag"), 60.0, 4, (effect,), validate=0)
    prepared = prepare(trials, "modulus")
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0)
    load = next(a for a in candidates(prepared.structure) if a.effect.name == "mass_change")
    [found] = screen(fitted, [load])
    gains = {s.active.label: s.gain for s in _screen_at_null(fitted, readings(load))}
    assert len(gains) == 4
    assert found.active.label == load.label == max(gains, key=lambda label: round(gains[label], 3))
    assert gains[load.label] > 1.1 * min(gains.values())


@pytest.mark.parametrize(
    ("gains", "sizes", "taken"),
    [((5.0, 5.0), (3, 3), 0), ((5.0, 6.0), (3, 3), 1), ((5.0, 8.0), (3, 5), 0), ((5.0, 9.5), (3, 5), 1)],
)
def test_the_form_that_promises_most_for_its_parameters_is_the_one(monkeypatch, gains, sizes, taken):
    load = next(
        a for a in candidates(structure_of("modulus", logs=("a", "b", "c"))) if a.effect.name == "mass_change"
    )
    two = readings(load)[:2]
    rows = [np.zeros(n) for n in sizes]
    looks = [Screened(a, p, p, g) for a, p, g in zip(two, rows, gains, strict=True)]
    monkeypatch.setattr(looked_at, "readings", lambda _: two)
    monkeypatch.setattr(looked_at, "_screen_at_null", lambda *_: looks)
    assert looked_at._in_best_forms(None, [load]) == [looks[taken]]


def test_a_load_that_was_taken_in_one_form_is_not_looked_for_in_another():
    structure = structure_of("modulus", logs=("a", "b", "c"))
    load = next(a for a in candidates(structure) if a.effect.name == "mass_change")
    taken = structure.with_effect(readings(load)[1])
    assert load.label not in {a.label for a in candidates(taken)}


def test_an_effect_that_is_in_two_choices_of_the_logs_is_not_looked_for_in_a_third():
    """With a value of its own in every log it would stand for whatever changes between them."""
    structure = structure_of("modulus", logs=("a", "b", "c", "d"))
    for left in (True, True, False):
        load = next((a for a in candidates(structure) if a.effect.name == "mass_change"), None)
        assert (load is not None) is left
        structure = structure.with_effect(load) if load else structure
