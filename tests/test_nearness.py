"""How far a fit is from the noise: by its own errors, its slow ones too, not by the weights it happened to have."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from benchmarks.bench_measured import trials_of as trials_in
from fixtures.blind import draw_case, write_case
from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch, fit_one_way, window_length
from identify.effect import Active, Variant
from identify.effects.water_and_air import CURRENT
from identify.fitted import FAR, NEAR, SLOW
from identify.held_inputs import prepare_best
from identify.kernel import POSITION
from identify.prepare import Prepared, prepare
from identify.structure import null_parameters
from validate.refits import best_first, under


def with_current(prepared: Prepared, speed: float, direction: float):
    """The declared model in a current, and its parameters with that alone."""
    structure = prepared.structure.with_effect(Active(CURRENT, Variant()))
    flow = {"north": speed * math.cos(direction), "east": speed * math.sin(direction)}
    null = null_parameters(structure)
    return structure, np.array([flow.get(s.name, x) for s, x in zip(structure.slots, null, strict=True)])


@cache
def in_a_current():
    """Fits of a vessel in a current, without it and with it."""
    current = Effect("current", {"speed": 0.3, "direction": 1.0})
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 6, (current,))
    prepared = prepare(trials, ship.model)
    structure, p = with_current(prepared, 0.3, 1.0)
    without = fit_from_scratch(prepared.structure, prepared.identify, length=10.0)
    return without, fit_from_scratch(structure, prepared.identify, p, length=10.0)


@pytest.mark.parametrize("ignored", [1.0, 300.0])
def test_of_refits_far_off_the_nearest_is_first_however_little_the_weights_ask_the_stream_that_is_off(
    ignored,
):
    without, right = in_a_current()
    assert without.chi2_per_dof > FAR
    weights = without.problem.inflation.copy()
    weights[POSITION] = ignored
    there = replace(without.problem, inflation=weights)
    found = [under(there, f, 0) for f in (without, right)]
    assert found[1].astray_by < 0.1 * found[0].astray_by
    assert [f for _, f in best_first([(None, f) for f in found], without)] == found[::-1]


def test_a_fit_whose_cost_hides_slow_errors_is_begun_again(tmp_path, monkeypatch):
    """Thousands of white samples, two of a sensor in a step, bring the cost of a wrong valley down to that of noise."""
    monkeypatch.setattr("identify.merged.FAST", 0.0)
    write_case(draw_case(101037), tmp_path / "case")
    prepared = prepare_best(trials_in(tmp_path / "case" / "campaign.toml"), "zhu2019")
    structure, p = with_current(prepared, 0.343, 5.292)
    begun = fit_one_way(structure, prepared.identify, p, length=window_length(structure.vessel.length))
    once, again = (
        fit_from_scratch(structure, prepared.identify, p, apart=apart, begun=begun) for apart in (False, True)
    )
    assert once.chi2_per_dof < NEAR
    assert once.slow > SLOW
    assert once.is_off
    assert again.slow < 1.1
    assert not again.is_off
