"""A cause that moves positions slowly is not left to a drift of the receiver's."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from drifting_samples import fitted_to_drifts
from identification_samples import trials_of

from fixtures.effects import Effect
from fixtures.sensors import Sensor, Suite
from identify.kernel import POSITION
from identify.parameter_covariance import reduction_of
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.wander import gain_of_wander, wander_shown
from validate.candidates import candidates, screen
from validate.instead_of_wander import instead_of_wander
from validate.judgement import beyond_doubt, judge, worthwhile
from validate.pace import Pace
from validate.rounds import rounds
from validate.wander import with_wander_known

SUITE = Suite(position=Sensor(10.0, 0.24))


@cache
def declared(y=0.0):
    effects = (Effect("antenna_offset", {"x": 0.0, "y": y}),) if y else ()
    trials = trials_of("patrol", ("zigzag", "random", "zigzag10"), 90.0, 5, effects, suite=SUITE)[1]
    return fit_declared(prepare(trials, "zhu2019"))


@cache
def in_its_place(y):
    """A fit that knows of the drift which it showed of an antenna elsewhere, and the round that looks at that alone."""
    known = with_wander_known(declared(y))
    every = candidates(known.solution.structure)
    [antenna] = [s for s in screen(known, every) if s.active.label == "antenna_offset"]
    return judge(known, [antenna], len(every))


@pytest.mark.parametrize("y", [0.18, 0.3])
def test_an_antenna_elsewhere_is_found_where_it_passes_for_a_drift(y):
    base, judged = in_its_place(y)
    assert wander_shown(base.problem) is not None
    assert not any(worthwhile(base, j.fitted) or beyond_doubt(base, j) for j in judged)
    found = instead_of_wander(base, judged, 40)
    structure = found.fitted.solution.structure
    assert wander_shown(found.fitted.problem) is None
    assert found.evidence > 0.0
    values = structure.values(found.fitted.solution.p, 0)
    assert values["y"] == pytest.approx(y, abs=0.03)


def test_nothing_stands_in_the_place_of_a_drift_that_there_is():
    """Not even what gains beside it; and where none is known there is nothing to stand in for."""
    plain = fitted_to_drifts(declared(), POSITION, 3.0, 30.0, 5)
    base = with_wander_known(plain)
    assert wander_shown(base.problem) is not None
    every = candidates(base.solution.structure)
    some = [s for s in screen(base, every) if s.active.effect.name in ("antenna_offset", "current", "wind")]
    base, judged = judge(base, some, len(every))
    sure = [replace(j, gain=100.0, evidence=50.0) for j in judged]
    assert instead_of_wander(base, sure, 40) is None
    assert instead_of_wander(plain, sure, 40) is None


def test_a_round_takes_what_stands_in_the_place_of_a_drift():
    turns = []
    found = rounds(in_its_place(0.3)[0], turns, Pace())
    assert [a.effect.name for a in found.solution.structure.actives] == ["antenna_offset"]
    assert turns[0].taken.label == "antenna_offset"


def test_what_a_drift_gains_is_what_its_errors_are_likelier_by():
    for y, least, most in ((0.0, 0.0, 0.0), (0.18, 50.0, 500.0), (0.3, 200.0, 2000.0)):
        fitted = declared(y)
        gain = gain_of_wander(fitted.problem, fitted.solution, reduction_of(fitted))
        assert least <= gain <= most
