"""First states of windows: an effect's own oscillator begins about where the smoothed motion has brought it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.drive import drive
from identify.effect import Active
from identify.effects.hull import ROLL_COUPLING
from identify.first_states import begun, first_states
from identify.predict import run, true_first_state
from identify.prepare import prepare
from identify.settled import settled
from identify.structure import null_parameters
from identify.windows import moments

ROLL = {"frequency": 3.0, "damping": 0.08, "sway": 1.5, "yaw": -1.0}


@cache
def rolling():
    _, trials = trials_of(
        "catamaran", ("random", "zigzag", "pull_out"), 60.0, 4, (Effect("roll_coupling", ROLL),)
    )
    prepared = prepare(trials, "modulus")
    structure = prepared.structure.with_effect(Active(ROLL_COUPLING))
    p = null_parameters(structure)
    for k, slot in enumerate(structure.slots):
        if slot.effect >= 0:
            p[k] = ROLL[slot.name]
    return fit_from_scratch(structure, prepared.identify, p)


def test_a_roll_of_its_own_begins_where_the_motion_has_brought_it_but_for_what_is_fitted():
    fitted = rolling()
    s, problem = fitted.solution, fitted.problem
    drives = [drive(s.structure, s.p, stretch) for stretch in problem.stretches]
    first = first_states(problem)
    plain, unit = begun(problem, s.structure, drives, first)
    off = first.copy()
    off[:, 6] = 0.5
    moved, _ = begun(problem, s.structure, drives, off)
    assert unit[:6] == pytest.approx(1.0)
    assert moved[:, 6] - plain[:, 6] == pytest.approx(0.5 * unit[6])
    assert moved[:, [0, 1, 2, 3, 4, 5, 7]] == pytest.approx(plain[:, [0, 1, 2, 3, 4, 5, 7]])


@pytest.mark.parametrize("column", [5, 6, 7])
def test_moments_are_the_derivatives_by_what_is_fitted(column):
    fitted = rolling()
    s, problem = fitted.solution, fitted.problem
    step = 1e-3
    costs = []
    for sign in (1.0, -1.0):
        first = s.first.copy()
        first[:, column] += sign * step
        costs.append(moments(problem, s.structure, s.p, first, held=True).matrices[:, -1, -1])
    slope = (costs[0] - costs[1]) / (2.0 * step)
    here = moments(problem, s.structure, s.p, s.first, held=True).matrices
    scale = np.sqrt(here[:, column, column])
    # the errors are measured less predicted
    assert slope / scale == pytest.approx(-2.0 * here[:, column, -1] / scale, abs=0.05)


def test_a_window_that_begins_in_a_roll_that_the_motion_tells_badly_is_followed():
    """Ten degrees of roll off are far from the noise; within its share of the usual roll the first state makes up."""
    fitted = rolling()
    s, problem = fitted.solution, fitted.problem
    assert 0.9 < fitted.chi2_per_dof < 1.15
    found = settled(problem, s.structure, s.p)
    bare = s.first.copy()
    bare[:, 6:] += 1.0
    assert moments(problem, s.structure, s.p, bare, held=True).cost > 3.0 * found.cost
    assert found.cost < 1.1 * s.cost


def test_a_roll_that_grows_beyond_all_measure_costs_no_number_and_warns_of_nothing():
    fitted = rolling()
    s, problem = fitted.solution, fitted.problem
    p = s.p.copy()
    p[[q.name == "damping" for q in s.structure.slots]] = -2.0
    assert not np.isfinite(moments(problem, s.structure, p, s.first, held=True).cost)


def test_a_free_run_that_begins_in_a_turn_begins_heeled():
    """Upright it would swing for as long as the roll takes to damp, and be worse than without any roll."""
    fitted = rolling()
    s, errors = fitted.solution, []
    for stretch in fitted.problem.stretches:
        d = drive(s.structure, s.p, stretch)
        begin = int(np.argmax(np.abs(stretch.states[:-40, 3] * stretch.states[:-40, 5])))
        heeled = true_first_state(s.structure, d, stretch, begin)
        for first in (heeled, np.where(np.arange(8) < 6, heeled, 0.0)):
            states = run(s.structure, d, stretch, first, begin, 40)
            errors.append(states[:, 4:6] - stretch.states[begin : begin + 41, 4:6])
    right, upright = (np.sqrt(np.mean(np.square(errors[k::2]), axis=(0, 1))) for k in (0, 1))
    assert (right < 0.5 * upright).all()
