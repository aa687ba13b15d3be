"""Gusts of a wind that nothing measured: what they leave open is no lack of the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of, with_nothing_between

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active
from identify.effects.water_and_air import WIND_UNSEEN
from identify.gusts import GUSTIEST, TIME, blown, gusts_of
from identify.noise import calibrated
from identify.prepare import prepare
from identify.structure import null_parameters
from identify.windows import moments
from validate.at_its_best import settled
from validate.exchange import at_likeliest_speed
from validate.refits import begun_at

SPEED, FROM, GUST = 6.0, 0.8, 0.12


def values(gust):
    return {
        "speed": SPEED,
        "direction": FROM,
        "cx": 0.002,
        "cy": 0.003,
        "cn": 5e-4,
        "gust": gust,
        "veer": gust / 2,
    }


@cache
def fitted_in(gust):
    wind = Effect("wind", values(gust))
    _, trials = trials_of("raft", ("zigzag", "circle", "random"), 90.0, 6, (wind,))
    prepared = prepare(trials, "linear")
    structure = prepared.structure.with_effect(Active(WIND_UNSEEN))
    p = null_parameters(structure)
    p[flow_of(structure)] = -4.0
    return fit_from_scratch(structure, with_nothing_between(prepared.identify), p, rounds=2)


def flow_of(structure):
    return [k for k, s in enumerate(structure.slots) if s.name in ("north", "east") and s.effect >= 0]


def test_a_gusty_wind_leaves_the_fit_at_the_noise():
    fitted = fitted_in(GUST)
    s, problem = fitted.solution, fitted.problem
    assert 0.9 < fitted.chi2_per_dof < 1.15
    assert 0.4 * GUST < GUSTIEST * np.sqrt(problem.unlogged.gusty) < 2.5 * GUST
    calm = replace(problem, unlogged=None)
    assert moments(calm, s.structure, s.p, s.first).cost > 2.0 * s.cost


def test_a_wind_that_was_taken_is_known_to_be_gusty():
    """Weights that knew of no wind held the fit with it to be off the noise, whatever it said of gusts."""
    fitted = fitted_in(GUST)
    calm = replace(fitted.problem, unlogged=None)
    weighted = calibrated(calm, fitted.solution)
    unaware = replace(begun_at(replace(fitted, problem=weighted), fitted.solution.p, 10), problem=weighted)
    assert unaware.is_off
    found = settled(unaware)
    assert not found.is_off
    assert 0.4 * GUST < GUSTIEST * np.sqrt(found.problem.unlogged.gusty) < 2.5 * GUST


def test_a_steady_wind_has_no_gusts():
    unlogged = fitted_in(0.0).problem.unlogged
    assert unlogged is None or GUSTIEST * np.sqrt(unlogged.gusty) < 0.02


def test_other_windows_know_of_the_same_gusts():
    fitted = fitted_in(GUST)
    known = fitted.problem.unlogged
    fewer = replace(fitted.problem, windows=fitted.problem.windows[::2])
    there = known.gusts_alone.over(fewer)
    assert there.gusty == known.gusty
    assert there.share == 0.0 and there.rounded is None
    w = fewer.windows[1]
    [(size, blown)] = there.parts
    assert size == np.sqrt(known.gusty)
    assert blown[w.stretch][w.samples] == pytest.approx(known.blown[w.stretch][w.samples])


def test_shapes_have_the_variance_and_the_memory_of_gusts():
    fitted = fitted_in(GUST)
    s, stretch = fitted.solution, fitted.problem.stretches[0]
    shapes = gusts_of(s.structure, s.p, stretch, [(10, 300)])
    inside = shapes.mean[10:310]
    assert not shapes.mean[:10].any() and not shapes.mean[310:].any()
    wind = np.hypot(*s.p[flow_of(s.structure)])
    covariance = np.einsum("akc,bkc->ab", inside, inside) / 2.0
    nodes = np.argmax(np.diag(covariance)[:40])  # variance is whole at the nodes, a little less between them
    assert covariance[nodes, nodes] == pytest.approx((GUSTIEST * wind) ** 2, rel=0.05)
    assert np.diag(covariance).min() > 0.85 * (GUSTIEST * wind) ** 2
    later = covariance[nodes, nodes + round(TIME / stretch.h)]
    assert later == pytest.approx(np.exp(-1.0) * (GUSTIEST * wind) ** 2, rel=0.12)


def test_gusts_that_are_drawn_are_as_large_as_they_are_said_to_be():
    fitted = fitted_in(GUST)
    s, rng = fitted.solution, np.random.default_rng(1)
    drawn = [blown(s.structure, s.p, fitted.problem.stretches[0], 0.25, rng) for _ in range(300)]
    wind = np.hypot(*s.p[flow_of(s.structure)])
    assert np.std(drawn) == pytest.approx(0.5 * GUSTIEST * wind, rel=0.1)


def test_a_wind_that_began_much_too_slow_comes_to_its_speed():
    fitted = fitted_in(GUST)
    structure, p = fitted.solution.structure, fitted.solution.p.copy()
    p[flow_of(structure)] *= 0.4 / np.hypot(*p[flow_of(structure)])
    slow = begun_at(fitted, p, 10)
    found = at_likeliest_speed(slow)
    assert found.solution.total < fitted.solution.total + 1.0
    north, east = found.solution.p[flow_of(structure)]
    assert np.arctan2(-east, -north) == pytest.approx(FROM, abs=0.1)


def test_a_wind_that_was_taken_back_has_no_gusts():
    """What unseen logs spoke against left its gusts behind, and the search ended in an error."""
    s = fitted_in(GUST).solution
    bare = s.structure.without(0)
    stretch = fitted_in(GUST).problem.stretches[0]
    drawn = blown(bare, bare.carried(s.p, s.structure), stretch, 0.25, np.random.default_rng(0))
    assert drawn.shape == (stretch.steps, 2)
    assert not drawn.any()
