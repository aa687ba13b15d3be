"""A log may begin while a slow actuator is on its way: where it was is found, in logs that clearly say so."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.predict import free_run
from identify.prepare import prepare
from validate.candidates import candidates
from validate.on_its_way import on_its_way
from validate.unseen_begins import begun_in

SLOW = 6.0


@cache
def begun_under_way(effect="actuator_lag", name="time_constant", value=SLOW, vessel="usv"):
    """A fit with a slow rudder that stood amidships as every log began, whatever it was told there, and unseen logs."""
    slow = Effect(effect, {name: value}, input="rudder")
    _, trials = trials_of(vessel, ("zigzag", "random", "random", "random"), 120.0, 5, (slow,), validate=1)
    prepared = prepare(trials, vessel_model(vessel))
    [active] = [a for a in candidates(prepared.structure) if a.label == f"{effect} (rudder)"]
    structure = prepared.structure.with_effect(active)
    p = np.array([value if s.name == name else 0.0 for s in structure.slots])
    return fit_from_scratch(structure, prepared.identify, p), prepared.validate


def vessel_model(vessel):
    return {"usv": "modulus", "patrol": "zhu2019"}[vessel]


def begins(fitted):
    return fitted.solution.structure.actives[-1].begin


def first_order(stretch):
    return float(stretch.inputs["rudder"].value[0])


@pytest.mark.parametrize("vessel", ["usv", "patrol"])
def test_a_slow_rudder_is_begun_where_it_was_in_the_logs_that_say_so(vessel):
    fitted, _ = begun_under_way(vessel=vessel)
    assert fitted.chi2_per_dof > 1.4
    found = on_its_way(fitted)
    assert found.chi2_per_dof == pytest.approx(1.0, abs=0.03)
    [time] = found.solution.p[[s.name == "time_constant" for s in found.solution.structure.slots]]
    assert time == pytest.approx(SLOW, abs=0.1)
    told = {s.name: first_order(s) for s in found.problem.stretches}
    assert set(begins(found)) == {log for log, order in told.items() if order != 0.0}
    assert list(begins(found).values()) == pytest.approx([-told[log] for log in begins(found)], abs=0.02)


def test_so_is_one_that_turns_at_a_rate():
    fitted, _ = begun_under_way("actuator_rate_limit", "rate", 0.02)
    found = on_its_way(fitted)
    assert found.chi2_per_dof < fitted.chi2_per_dof - 0.1
    [(log, begin)] = begins(found).items()
    [told] = [first_order(s) for s in fitted.problem.stretches if s.name == log]
    assert begin == pytest.approx(-told, abs=0.02)


def test_one_that_was_where_it_was_told_begins_there():
    fitted, _ = begun_under_way(value=0.5)
    assert on_its_way(fitted) is fitted
    assert not begins(fitted)


def test_unseen_logs_are_begun_by_their_first_window_alone():
    fitted, [unseen] = begun_under_way()
    found = on_its_way(fitted)
    known = begun_in(found, [unseen])
    assert begins(known).keys() - begins(found).keys() == {unseen.name}
    assert begins(known)[unseen.name] == pytest.approx(-first_order(unseen), abs=0.02)
    assert astray(known, unseen) < 0.5 * astray(found, unseen)
    half = replace(unseen, states=unseen.states.copy())
    half.states[unseen.steps // 2 :] += 1.0
    assert begins(begun_in(found, [half])) == begins(known)


def astray(fitted, stretch):
    """Free-running error of the yaw rate over the first half minute, rad/s, root mean square."""
    error = free_run(fitted.solution.structure, fitted.solution.p, stretch)[:300, 5] - stretch.states[:300, 5]
    return float(np.sqrt(np.mean(error**2)))
