"""Inputs that are logged in coarse steps: what was rounded away is no lack of the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import modulus_truth, trials_of, with_nothing_between

from identify.base_fit import fit_from_scratch
from identify.bent_paths import bent
from identify.drive import drive
from identify.effect import Active, Variant
from identify.effects import EFFECTS
from identify.fitted import NEAR, SLOW
from identify.noise import calibrated_anew
from identify.parameter_covariance import covariance_of
from identify.prepare import prepare
from identify.report_fit import make_fit
from identify.rounded_inputs import held_levels, levels_in, rounding_of
from identify.shared_levels import shared_by_windows
from identify.structure import null_parameters
from identify.whitening import weighted, within
from identify.whole_windows import as_a_whole, over_whole_logs
from identify.windows import tangents_of
from preprocess.rounding import common_step, input_step
from preprocess.trial import Measurement
from preprocess.vessel import Input

STEP = 0.01


@cache
def logged():
    return trials_of("catamaran", ("zigzag", "random", "zigzag10"), 80.0, 3)


def rounded(trial, step=STEP):
    """A trial whose inputs are logged to a step that is coarser than what was done."""
    steps = {k: replace(m, value=step * np.round(m.value / step)) for k, m in trial.inputs.items()}
    return replace(trial, inputs=steps)


@cache
def fitted():
    prepared = prepare([rounded(t) for t in logged()[1]], "modulus")
    return prepared, fit_from_scratch(prepared.structure, prepared.identify)


def blind(stretches, quantum=0.0):
    """Stretches whose inputs are said to be rounded to another step."""
    return tuple(
        replace(s, inputs={k: replace(m, quantum=quantum) for k, m in s.inputs.items()}) for s in stretches
    )


def test_rounded_inputs_leave_a_clean_campaign_clean():
    prepared, found = fitted()
    unaware = fit_from_scratch(prepared.structure, with_nothing_between(blind(prepared.identify)))
    assert unaware.chi2_per_dof > 1.3
    assert found.problem.unlogged.rounded is not None
    assert 0.9 < found.chi2_per_dof < 1.1
    truth = modulus_truth(logged()[0])
    fit, other = (
        make_fit(prepared, f, estimator="output_error", optimiser="auto", seed=0) for f in (found, unaware)
    )
    off = [
        np.median([abs(c.value / truth[c.dof, c.term] - 1.0) for c in f.coefficients]) for f in (fit, other)
    ]
    assert off[0] < 0.5 * off[1]
    away = [(c.value - truth[c.dof, c.term]) / c.stderr for c in fit.coefficients]
    assert np.max(np.abs(away)) < 4.0


def test_standard_errors_count_what_was_rounded_away():
    _, found = fitted()
    exact = prepare(logged()[1], "modulus")
    sharp = fit_from_scratch(exact.structure, exact.identify)
    widths = [np.sqrt(np.diag(covariance_of(f))) for f in (found, sharp)]
    assert np.median(widths[0] / widths[1]) > 1.3


def test_what_was_not_rounded_hides_nothing_whatever_its_step_is_said_to_be():
    """Orders that were given in steps and logged as given are exact: the errors say so."""
    prepared = prepare(logged()[1], "modulus")
    found = fit_from_scratch(prepared.structure, blind(prepared.identify))
    s = found.solution
    told = replace(found.problem, stretches=blind(found.problem.stretches, STEP), dispersion=np.full(4, 1.2))
    again = calibrated_anew(told, s)
    assert again.unlogged is None or again.unlogged.rounded is None


def test_each_level_of_a_window_is_one_constant_of_the_size_of_a_rounding():
    _, found = fitted()
    stretch, s = found.problem.stretches[1], found.solution
    shapes = rounding_of(s.structure, s.p, stretch, [(0, stretch.steps)])
    names = [i.name for i in s.structure.inputs]
    levels = [np.unique(stretch.inputs[n].value).size for n in names]
    assert 0 < shapes.count <= sum(levels)
    place = s.structure.table.channels.index("T:thruster")
    value = np.max([np.abs(stretch.inputs[n].value).max() for n in names])
    largest = 2.0 * value * STEP / np.sqrt(12.0)  # of a thrust that goes with the square
    assert np.abs(shapes.mean[:, :, place]).max() == pytest.approx(largest, rel=0.1)


def test_a_level_counts_where_it_is_held():
    t = np.arange(0.0, 12.0, 0.5)
    steps = [0, 0, 0, 0, 5, 9, 14, 20, 20, 20, 20, 20, 21, 21, 22, 22, 23, 23, 20, 20, 20, 20, 20, 20]
    m = Measurement(
        "a", t, 0.1 * np.array(steps), 0.0, np.ones(24, bool), sample_time=0.5, held=True, quantum=0.1
    )
    level = held_levels(m, 0.6)
    assert (level[:4] >= 0).all() and np.ptp(level[:4]) == 0
    assert (level[4:7] == -1).all()  # another value in each sample
    assert np.ptp(level[7:12]) == 0 and level[7] >= 0
    assert (level[12:16] == -1).all()  # passes through
    assert (level[18:] == level[7]).all()  # the same level again


@pytest.mark.parametrize("of", [None, ("actuator_lag", 0.4), ("actuator_rate_limit", 0.3)])
def test_what_levels_do_is_what_their_errors_do_behind_the_actuator(of):
    """Every level off by an error of its own: the channels change by the sum of the levels' shapes."""
    _, found = fitted()
    stretch, structure = found.problem.stretches[1], found.solution.structure
    if of is not None:
        effect = next(e for e in EFFECTS if e.name == of[0])
        structure = structure.with_effect(Active(effect, Variant("left")))
    p = null_parameters(structure)
    p[[s.effect == 0 for s in structure.slots]] = 0.0 if of is None else of[1]
    rng, inputs, sizes = np.random.default_rng(4), dict(stretch.inputs), {}
    for name, m in inputs.items():
        level = held_levels(m, 2.0 * stretch.h)
        error = 0.1 * m.quantum * rng.uniform(-0.5, 0.5, level.max() + 1)
        value = m.value.copy()
        good = value[m.good]
        for k in np.unique(level[level >= 0]):
            sizes[name, float(good[level == k].min())] = error[k] / (m.quantum / np.sqrt(12.0))
        value[m.good] = good + np.where(level >= 0, error[level], 0.0)
        inputs[name] = replace(m, value=value)
    there, here = (drive(structure, p, s).fine for s in (replace(stretch, inputs=inputs), stretch))
    [levels] = levels_in(structure, p, stretch, [(0, stretch.steps)])
    said = sum(sizes[name] * fine for name, fine in levels)
    assert len(levels) > 10
    assert np.linalg.norm(said - (there - here)) < 0.1 * np.linalg.norm(there - here)


def test_a_level_is_as_far_off_in_all_windows():
    """What the sum of all windows' scores varies by, from the errors of all levels at once."""
    _, found = fitted()
    problem, s = found.problem, found.solution
    rows, known = tangents_of(problem, s.structure, s.p, s.first), problem.unlogged.over(problem)
    n = len(s.p)
    total, alone = {}, np.zeros((n, n))
    for k, w in enumerate(problem.windows):
        stretch = problem.stretches[w.stretch]
        answers = weighted(problem, known.rounded, w).reshape(2 * len(rows[k]), -1)
        every = within(problem, known.parts, w).reshape(len(answers), -1)
        at = rows[k].reshape(len(answers), -1)[:, 8:]
        scores = at.T @ np.linalg.solve(np.eye(len(answers)) + every @ every.T, answers)
        [levels] = levels_in(known.structure, known.p, stretch, [(w.first, w.steps)])
        for (name, _), score in zip(levels, scores.T, strict=False):
            total[name] = total.get(name, 0.0) + score
            alone += np.outer(score, score)
    beyond = sum(np.outer(t, t) for t in total.values()) - alone
    own = np.broadcast_to(np.vstack([np.zeros((8, n)), np.eye(n)]), (len(problem.windows), 8 + n, n))
    said = shared_by_windows(problem, s, own)
    size = np.sqrt(np.diag(alone))
    assert len({w.stretch for w in problem.windows}) > 1
    assert np.abs(beyond / size / size[:, None]).max() > 0.1
    # eigenvalues that change nothing are left out of the whitening
    assert np.allclose(said / size / size[:, None], beyond / size / size[:, None], atol=0.05)


def test_windows_are_short_where_rounding_turns_the_path():
    """A course that is far off bends a path, which no covariance of errors that go with the inputs counts."""
    ship, trials = logged()
    prepared = prepare([rounded(t, 2.0 * STEP) for t in trials], "modulus")
    found = fit_from_scratch(prepared.structure, prepared.identify)
    assert found.problem.length < 20.0
    assert bent(found.problem) < 1.0
    assert 0.9 < found.chi2_per_dof < 1.1
    truth, deviation = modulus_truth(ship), np.sqrt(np.diag(covariance_of(found)))
    slots = found.solution.structure.slots
    own = [k for k, slot in enumerate(slots) if slot.term is not None]
    away = [(found.solution.p[k] - truth[slots[k].term.dof, slots[k].term.text]) / deviation[k] for k in own]
    assert np.sqrt(np.mean(np.square(away))) < 2.0


def test_the_step_of_an_input_is_what_all_its_levels_are_multiples_of():
    rng = np.random.default_rng(0)
    value = np.repeat(rng.uniform(-30.0, 30.0, 15), 40)
    assert common_step(np.radians(np.round(value, 1))) == pytest.approx(np.radians(0.1))
    assert common_step(np.round(value, 1).astype(np.float32)) == pytest.approx(0.1, rel=0.01)
    assert common_step(value) == 0.0
    assert common_step(np.repeat([-20.0, 0.0, 10.0, 20.0], 40)) == 0.0  # that was ordered, not rounded
    assert common_step(5.0 * np.round(value / 5.0)) == 0.0


def test_a_calibration_takes_the_step_along():
    declared = Input("port", "thruster", pwm=(1100.0, 1500.0, 1900.0), value=(-0.5, 0.0, 1.0))
    pwm = np.round(np.random.default_rng(1).uniform(1500.0, 1900.0, 30))
    assert input_step(declared, (pwm - 1500.0) / 400.0) == pytest.approx(1.0 / 400.0)
    assert input_step(declared, (1500.0 - pwm) / 800.0) == pytest.approx(1.0 / 800.0)
    folded = replace(declared, value=(0.0, 0.0, 1.0))
    assert input_step(folded, (pwm - 1500.0) / 400.0) == 0.0


def test_what_rounding_adds_up_to_over_whole_logs_leaves_the_fit_to_windows():
    """A rudder to a tenth of a degree: whole logs are near the noise, and their positions are off by slow errors."""
    trials = trials_of("usv", ("zigzag", "random", "zigzag10", "circle"), 120.0, 5)[1]
    plain, coarse = (
        fit_from_scratch(ready.structure, blind(ready.identify))
        for some in (trials, [rounded(t, np.radians(0.1)) for t in trials])
        for ready in (prepare(some, "modulus"),)
    )
    assert over_whole_logs(plain) is not plain
    whole = as_a_whole(coarse)
    assert whole.chi2_per_dof < NEAR
    slow, before = (f.problem.dispersed.inflation.max() for f in (whole, coarse))
    assert slow > SLOW > 1.1 > before
    assert over_whole_logs(coarse) is coarse
