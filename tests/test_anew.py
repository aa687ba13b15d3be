"""Fits begun anew."""

from __future__ import annotations

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active, Variant
from identify.effects.actuators import ACTUATOR_DELAY, ACTUATOR_OFFSET
from identify.prepare import prepare
from identify.structure import null_parameters
from ingest.errors import NotIdentifiable
from validate import anew as module
from validate import other_start, refits
from validate.anew import VALLEYS, anew
from validate.candidates import Screened


@pytest.fixture(scope="module")
def offset():
    """A fit with an offset of the rudder in."""
    there = (Effect("actuator_offset", {"offset": 0.07}, input="rudder"),)
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 5, there)
    prepared = prepare(trials, ship.model)
    structure = prepared.structure.with_effect(Active(ACTUATOR_OFFSET, Variant("rudder")))
    return fit_from_scratch(structure, prepared.identify, length=10.0, rounds=0)


def test_it_begins_in_each_valley_and_the_best_is_taken(offset, monkeypatch):
    structure, begun = offset.solution.structure, []
    valleys = [null_parameters(structure) + x for x in (0.1, 0.2, 0.3, 0.4)]
    monkeypatch.setattr(module, "wanted_values", lambda *_: [(1.0, p) for p in valleys])
    monkeypatch.setattr(module, "_begun_roughly", lambda fitted, p: begun.append(p) or fitted)
    assert anew(offset) is offset
    assert all(np.array_equal(a, b) for a, b in zip(begun, valleys[:VALLEYS], strict=False))


@pytest.mark.parametrize(("far", "count"), [(False, 2), (True, 1)])
def test_near_the_noise_a_valley_is_begun_in_that_the_accelerations_do_not_want(
    offset, monkeypatch, far, count
):
    """What a slow rudder does is small in noisy accelerations, and another model may follow them better."""
    begun, p = [], offset.solution.p
    monkeypatch.setattr(module, "FAR", 0.0 if far else 1e9)
    monkeypatch.setattr(module, "wanted_values", lambda *_: [(0.1, p + 0.1), (-0.1, p - 0.1)])
    monkeypatch.setattr(module, "_begun_roughly", lambda fitted, p: begun.append(p) or fitted)
    anew(offset, rounds=0)
    assert len(begun) == count


def runs_away(*_):
    raise NotIdentifiable("it runs away")


def test_where_every_begin_runs_away_the_fit_is_as_it_was(offset, monkeypatch):
    monkeypatch.setattr(module, "roughly", runs_away)
    assert anew(offset) is offset


def test_so_is_the_start_of_a_refit(offset, monkeypatch):
    structure = offset.solution.structure.with_effect(Active(ACTUATOR_DELAY, Variant("rudder")))
    p = structure.carried(offset.solution.p, offset.solution.structure)
    monkeypatch.setattr(other_start, "roughly", runs_away)
    screened = Screened(structure.actives[-1], p, p, 10.0, wanted=(1.0, p + 0.1))
    found, first = other_start.other_start(structure, screened, offset)
    assert np.array_equal(found, p)
    assert np.isfinite(first).all()


def test_so_are_the_begins_of_a_fit_of_some_windows(offset, monkeypatch):
    monkeypatch.setattr(refits, "roughly", runs_away)
    assert len(list(refits._begins(offset, offset))) == 2
