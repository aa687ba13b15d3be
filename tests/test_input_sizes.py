"""A dead band about neutral: only between which two sizes of the input it lies can be known, and that is said."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import MOTORS, PROPELLER, RUDDER, structure_of, trials_of
from test_effects import with_effect
from test_kernel import stretch_of

from fixtures.effects import Effect
from fixtures.sensors import Suite
from identify.base_fit import fit_from_scratch
from identify.drive import drive
from identify.effect import Active, Variant
from identify.effects import EFFECTS
from identify.input_sizes import LARGEST, MOST_STARTS, between, sizes_of, untold
from identify.noise import calibrated
from identify.prepare import prepare
from identify.structure import null_parameters
from identify.unlogged import unlogged
from validate import rounds
from validate.candidates import Screened, candidates
from validate.judgement import Judged
from validate.refits import begun_at, under
from validate.sizes import at_likeliest_size, begun_all_over, begun_between_sizes

LEVELS = np.array([0.0, 0.08, -0.12, 0.3, -0.5, 0.9])
NEUTRAL = Variant("right", {"form": "neutral"})


def at_levels():
    """A stretch whose right motor is only ever at some levels."""
    stretch = stretch_of(MOTORS)
    right = stretch.inputs["right"]
    held = replace(right, value=np.resize(LEVELS, len(right.t)))
    return replace(stretch, inputs={**stretch.inputs, "right": held})


def test_a_dead_band_is_begun_between_the_sizes_that_an_input_has():
    sizes = sizes_of([at_levels()], "right")
    assert sizes == pytest.approx([0.0, 0.08, 0.12, 0.3, 0.5, 0.9])
    assert between(sizes) == pytest.approx([0.04, 0.1, 0.21, 0.4])


@given(st.lists(st.floats(0.0, 100.0), max_size=200))
def test_there_are_few_begins_and_each_is_within_reach(values):
    sizes = np.unique(np.array(values, dtype=float))
    begins = between(sizes)
    assert len(begins) < MOST_STARTS
    assert all(0.0 <= b <= LARGEST * sizes[-1] for b in begins)


def test_between_two_sizes_nothing_changes_and_that_is_the_uncertainty():
    stretch = at_levels()
    structure, p, _, _ = with_effect("actuator_deadband", {"width": 0.2}, NEUTRAL)
    k = next(k for k, s in enumerate(structure.slots) if s.effect == 0)
    one, other, beyond = (np.where(np.arange(len(p)) == k, w, p) for w in (0.13, 0.29, 0.31))
    channels = [drive(structure, q, stretch).channels for q in (one, other, beyond)]
    assert np.array_equal(channels[0], channels[1])
    assert not np.array_equal(channels[0], channels[2])
    variance = untold(structure, p, [stretch])
    assert variance[k] == pytest.approx((0.3 - 0.12) ** 2 / 12.0)
    assert np.count_nonzero(variance) == 1


def test_a_slack_linkage_is_not_so():
    structure, p, _, _ = with_effect("actuator_deadband", {"width": 0.2}, Variant("right", {"form": "play"}))
    assert not untold(structure, p, [at_levels()]).any()


def with_dead_band(ship, trials, width):
    """Prepared trials, a structure with a dead band of the rudder, its parameters, and where the width is."""
    prepared = prepare(trials, ship.model)
    [active] = [a for a in candidates(prepared.structure) if a.label == "actuator_deadband (rudder, neutral)"]
    structure = prepared.structure.with_effect(active)
    [k] = [k for k, s in enumerate(structure.slots) if s.effect == 0]
    p = null_parameters(structure)
    p[k] = width
    return prepared, structure, p, k


def test_a_dead_band_is_taken_to_the_size_that_the_measurements_want():
    """A rudder that moves through all sizes: a width has no slope, and a search from beside it stays beside it."""
    band = Effect("actuator_deadband", {"width": 0.09}, "rudder", {"form": "neutral"})
    suite = Suite(measured=True)
    ship, trials = trials_of("usv", ("zigzag", "random", "zigzag10"), 60.0, 5, (band,), suite=suite)
    prepared, structure, p, k = with_dead_band(ship, trials, 0.09)
    fitted = fit_from_scratch(structure, prepared.identify, p)
    beside = begun_at(fitted, np.where(np.arange(len(p)) == k, 0.097, fitted.solution.p), 20)
    found = at_likeliest_size(beside)
    assert found.solution.p[k] == pytest.approx(0.09, abs=0.002)
    assert found.solution.total < beside.solution.total - 10.0
    assert at_likeliest_size(found).solution.p[k] == pytest.approx(found.solution.p[k], abs=0.001)


def test_a_dead_band_far_from_its_size_is_begun_between_any_two_sizes_of_the_input():
    """At the wrong size the hull bends to make up for it, and no step from there leads back."""
    band = Effect("actuator_deadband", {"width": 0.13}, "rudder", {"form": "neutral"})
    ship, trials = trials_of("usv", ("spiral", "zigzag10", "random"), 36.0, 5, (band,), validate=0)
    prepared, structure, p, k = with_dead_band(ship, trials, 0.3)
    astray = fit_from_scratch(structure, prepared.identify, p, length=10.0)
    assert astray.is_off
    found = begun_between_sizes(astray)
    assert found.chi2_per_dof < 0.5 * astray.chi2_per_dof
    sizes = sizes_of(prepared.identify, "rudder")
    near = at_likeliest_size(found).solution.p[k]
    assert np.count_nonzero(sizes < near) == pytest.approx(np.count_nonzero(sizes < 0.13), abs=1)


@cache
def with_the_rest_hidden():
    """A fit with a size of 0.097 for 0.108, what is left over thought to be hidden between the inputs' samples."""
    band = Effect("actuator_deadband", {"width": 0.108}, "rudder", {"form": "neutral"})
    ship, trials = trials_of("tanker", ("zigzag", "speed", "random", "spiral"), 90.0, 6, (band,), validate=0)
    prepared, structure, p, k = with_dead_band(ship, trials, 0.097)
    beside = fit_from_scratch(structure, prepared.identify, p)
    hidden = replace(beside.problem, unlogged=unlogged(beside.problem, structure, beside.solution.p, 1.0))
    beside = under(calibrated(hidden, beside.solution), beside, 60)
    beside = under(calibrated(beside.problem, beside.solution), beside, 60)
    return beside, k


def test_a_size_is_looked_for_even_if_what_the_wrong_one_leaves_is_thought_to_be_hidden():
    """Weights that know of what inputs may hide between their samples put a fit with the wrong size at the noise."""
    beside, k = with_the_rest_hidden()
    assert not beside.is_off
    found = at_likeliest_size(beside)
    assert found.solution.total < beside.solution.total - 1000.0
    assert found.solution.p[k] == pytest.approx(0.108, rel=0.02)


def test_what_a_wrong_size_left_is_not_thought_to_be_hidden_with_the_right_one(monkeypatch):
    beside, _ = with_the_rest_hidden()
    monkeypatch.setattr(rounds, "settled", lambda _: beside)
    [active] = beside.solution.structure.actives
    p = beside.solution.p
    after = rounds._after(Judged(Screened(active, p, p, 0.0), beside, 0.0, 1, 0.0, 1.0))
    assert after.problem.unlogged is None or after.problem.unlogged.share < 0.1
    assert after.chi2_per_dof < 1.05


def test_a_size_is_not_left_for_another_that_is_no_better():
    """Between which two sizes it lies may hardly show: what is as good far off is no reason to go there."""
    band = Effect("actuator_deadband", {"width": 0.108}, "rudder", {"form": "neutral"})
    ship, trials = trials_of("usv", ("zigzag", "speed", "random", "spiral"), 90.0, 5, (band,), validate=0)
    prepared, structure, p, k = with_dead_band(ship, trials, 0.103)
    fitted = fit_from_scratch(structure, prepared.identify, p)
    found = at_likeliest_size(fitted)
    assert found.solution.total <= fitted.solution.total
    assert found.solution.p[k] == pytest.approx(0.108, rel=0.05)


def test_an_effect_that_asks_for_no_size_is_left_as_it_is():
    ship, trials = trials_of("usv", ("spiral", "random"), 60.0, 5, validate=0)
    prepared = prepare(trials, ship.model)
    [fade] = [a for a in candidates(prepared.structure) if a.label == "thrust_fade"]
    fitted = fit_from_scratch(prepared.structure.with_effect(fade), prepared.identify, length=10.0)
    assert begun_between_sizes(fitted) is fitted
    assert at_likeliest_size(fitted) is fitted
    assert begun_all_over(fitted) is fitted


def test_an_antenna_is_looked_for_ahead_and_astern():
    """Linear terms follow a sway of any place aboard; between the valleys of what is not linear there is a ridge."""
    moved = Effect("antenna_offset", {"x": 3.0, "y": 0.6})
    ship, trials = trials_of("patrol", ("zigzag", "random", "circle"), 36.0, 5, (moved,), validate=0)
    prepared = prepare(trials, ship.model)
    [antenna] = [a for a in candidates(prepared.structure) if a.label == "antenna_offset"]
    structure = prepared.structure.with_effect(antenna)
    p = null_parameters(structure)
    p[[k for k, s in enumerate(structure.slots) if s.effect == 0]] = -3.0, 0.6
    astern = fit_from_scratch(structure, prepared.identify, p, length=20.0)
    assert astern.solution.p[[s.name for s in structure.slots].index("x")] < 0.0
    found = begun_all_over(astern).solution
    assert found.total < 0.98 * astern.solution.total
    assert structure.values(found.p, 0) == pytest.approx({"x": 3.0, "y": 0.6}, abs=0.3)


def test_an_offset_is_believed_up_to_half_the_largest_thrust_but_of_any_angle():
    variants = {"actuator_offset": {}, "actuator_deadband": {"form": "neutral"}}
    extents = {RUDDER.name: (0.2, 0.3), PROPELLER.name: (2.0, 8.0)}
    for name, options in variants.items():
        for on, farthest in ((PROPELLER.name, 4.0), (RUDDER.name, np.inf)):
            active = Active(next(e for e in EFFECTS if e.name == name), Variant(on, options))
            structure = replace(structure_of("modulus"), extents=extents).with_effect(active)
            (slot,) = (s for s in structure.slots if s.effect == 0)
            assert slot.parameter.bounds[1] == farthest
            assert slot.parameter.bounds[0] == (0.0 if name == "actuator_deadband" else -farthest)


@pytest.mark.parametrize("half", [1e-6, 0.3, 1e4])
@pytest.mark.parametrize("length", [0.4, 400.0])
def test_a_search_begins_within_bounds_however_small_the_input_moves(half, length):
    bare = structure_of("modulus", inputs=(RUDDER, PROPELLER))
    known = {i.name: (half, 2.0 * half) for i in (RUDDER, PROPELLER)}
    bare = replace(bare, extents=known, vessel=replace(bare.vessel, length=length))
    own = [s.parameter for a in candidates(bare) for s in bare.with_effect(a).slots if s.effect >= 0]
    assert sum(bool(p.starts) for p in own) > 10
    for p in own:
        low, high = p.bounds
        assert all(low < start < high or start == p.null for start in p.starts), p
