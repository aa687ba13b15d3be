"""What pushes the vessel without being logged: told from what a fit leaves of it, and counted in standard errors."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from identify.base_fit import fit_from_scratch
from identify.disturbance import _less, _Reduced, with_disturbances
from identify.disturbed import blocks_in, unit_answers
from identify.drive import drive
from identify.first_states import first_states
from identify.kernel import HEADING
from identify.output_error import solve
from identify.parameter_covariance import _inverse, _of_prior_alone, covariance_of
from identify.predict import run
from identify.prepare import prepare
from identify.whole_windows import over_whole_logs
from identify.windows import moments

LOGS = ("zigzag", "random", "circle", "zigzag10")


@cache
def sailed(seed=3):
    _, trials = trials_of("catamaran", LOGS, 60.0, seed, (), validate=1)
    prepared = prepare(trials, "modulus")
    return over_whole_logs(fit_from_scratch(prepared.structure, prepared.identify))


def pushed(fitted, rng, size):
    """The same logs with samples as a vessel shows them that is pushed at random times, refitted."""
    s, problem = fitted.solution, fitted.problem
    bare = replace(problem, inflation=np.ones(4))
    now = moments(bare, s.structure, s.p, s.first)
    drives = [drive(s.structure, s.p, x) for x in bare.stretches]
    answers = unit_answers(bare, s.structure, drives, s.first, 31)  # jumps at places that no block knows
    made = []
    for k, (x, a) in enumerate(zip(bare.stretches, answers, strict=True)):
        noise = rng.standard_normal(x.samples.value.shape) * x.samples.sigma[:, None]
        noise[np.isin(x.samples.kind, (1, 2)), 1] = 0.0
        jumps = rng.standard_normal((3, 31)) * np.array(size)[:, None]
        value = x.samples.value + noise
        mine = bare.windows[k].samples  # whole logs: one window each
        value[mine] -= now.residuals[k] * x.samples.sigma[mine, None]
        made.append(
            replace(x, samples=replace(x.samples, value=value + np.einsum("madb,db->ma", a[:, :, :3], jumps)))
        )
    again = replace(problem, stretches=tuple(made))
    solution = solve(again, s.structure, s.p, s.first, fitted.prior, anchor=first_states(again))
    return replace(fitted, problem=again, solution=solution)


def off(found, truth):
    kept = [k for k, s in enumerate(found.solution.structure.slots) if s.coefficient >= 0]
    return ((found.solution.p - truth) / np.sqrt(np.diag(covariance_of(found))))[kept]


def test_a_window_of_fewer_steps_than_blocks_beside_long_ones():
    fitted = sailed()
    s, problem = fitted.solution, fitted.problem
    short = replace(problem.windows[0], steps=5)
    mixed = replace(problem, windows=(short, *problem.windows[1:]))
    drives = [drive(s.structure, s.p, x) for x in mixed.stretches]
    answers = unit_answers(mixed, s.structure, drives, s.first, 16)
    assert all(np.isfinite(a).all() for a in answers)


def test_pushes_far_below_the_noise_of_a_sample_are_counted():
    """Jumps of the turning by under half of the gyro's noise: χ² says nothing, but the coefficients are off by them."""
    fitted = sailed()
    truth, plain, told = fitted.solution.p, [], []
    for seed in range(5):
        found = pushed(fitted, np.random.default_rng(seed), (1.2e-3, 1.2e-3, 1.2e-3))
        assert found.chi2_per_dof < 1.1
        plain.append(off(found, truth))
        told.append(off(with_disturbances(found), truth))
    assert np.sqrt(np.mean(np.square(plain))) > 1.8
    assert 0.6 < np.sqrt(np.mean(np.square(told))) < 1.3


def test_sizes_of_pushes_are_found():
    fitted = sailed()
    found = with_disturbances(pushed(fitted, np.random.default_rng(1), (0.0, 0.0, 2e-3)))
    apart = 60.0 / 31.0  # s between two jumps: as white as their variance over this time
    assert found.disturbed.sizes.push_time == 0.0
    assert found.disturbed.sizes.push[2] == pytest.approx(2e-3 / np.sqrt(apart), rel=0.5)


def test_white_noise_alone_widens_nothing_much():
    fitted = sailed()
    for seed in range(3):
        found = pushed(fitted, np.random.default_rng(seed), (0.0, 0.0, 0.0))
        wider = np.sqrt(np.diag(covariance_of(with_disturbances(found))) / np.diag(covariance_of(found)))
        assert np.median(wider) < 1.25


def test_answers_are_what_a_push_changes():
    """Against runs with the velocity changed in the middle of a block."""
    fitted = sailed()
    s, problem = fitted.solution, replace(fitted.problem, inflation=np.ones(4))
    drives = [drive(s.structure, s.p, x) for x in problem.stretches]
    count = blocks_in(problem)
    unit = unit_answers(problem, s.structure, drives, s.first, count)
    w = problem.windows[0]
    step = round(2.5 * w.steps / count)
    tail = replace(w, first=w.first + step, steps=w.steps - step)
    start = problem.stretches[w.stretch].samples.t - problem.stretches[w.stretch].start
    late = start[w.samples] >= tail.first * problem.stretches[w.stretch].h
    tail = replace(tail, samples=slice(w.samples.stop - int(late.sum()), w.samples.stop))
    state = run(s.structure, drives[0], problem.stretches[0], s.first[0], w.first, w.steps)[step]
    for d in range(3):
        ends = []
        for change in (1e-5, -1e-5):
            moved = state.copy()
            moved[3 + d] += change
            part = replace(problem, windows=(tail,))
            ends.append(moments(part, s.structure, s.p, moved[None]).residuals[0])
        sigma = problem.stretches[0].samples.sigma[tail.samples]
        change = -(ends[0] - ends[1]) / 2e-5 * sigma[:, None]
        assert np.allclose(unit[0][tail.samples][:, :, d, 2], change, atol=2e-4 * np.abs(change).max())
    assert np.array_equal(np.unique(unit[0][:, :, 3:].sum(axis=3)), [0.0, 1.0])


def test_first_states_of_sizes_far_apart_are_eliminated_all_the_same():
    """A fit that all but runs away in a window once ended a run with an error."""
    random = np.random.default_rng(2)
    root = random.normal(size=(4, 8, 8))
    size = 10.0 ** random.uniform(-8, 8, (4, 8))
    plain = root @ np.swapaxes(root, 1, 2)
    scaled = plain * size[:, :, None] * size[:, None, :]
    assert np.allclose(
        _inverse(scaled) * size[:, :, None] * size[:, None, :], np.linalg.inv(plain), rtol=1e-4, atol=1e-6
    )
    scaled[0] = 1e290 * np.outer(np.arange(1.0, 9.0), np.arange(1.0, 9.0))  # singular, and huge
    assert np.isfinite(_inverse(scaled)).all()


def test_what_rounding_alone_made_of_the_information_is_left_out():
    prior = np.diag([1.0, 0.25, 4.0])
    information = np.array([[5.0, 1.0, 7.0], [1.0, 3.0, 2.0], [7.0, 2.0, -1e15]])
    assert np.array_equal(
        _of_prior_alone(information, prior), [[5.0, 1.0, 0.0], [1.0, 3.0, 0.0], [0.0, 0.0, 4.0]]
    )
    assert np.array_equal(_of_prior_alone(information[:2, :2], prior[:2, :2]), information[:2, :2])
    assert np.isfinite(_of_prior_alone(np.full((3, 3), np.nan), prior)).all()


def with_a_wandering_compass(fitted, rng, size, time=30.0):
    """The same logs with headings that drift (Gauss-Markov), refitted."""
    s, problem, made = fitted.solution, fitted.problem, []
    for x in problem.stretches:
        at = np.flatnonzero(x.samples.kind == 1)
        keep = np.exp(-np.diff(x.samples.t[at], prepend=x.samples.t[at[0]]) / time)
        drift, wander = size * rng.standard_normal(), []
        for k in keep:
            drift = k * drift + size * np.sqrt(1.0 - k * k) * rng.standard_normal()
            wander.append(drift)
        value = x.samples.value.copy()
        value[at, 0] += wander
        made.append(replace(x, samples=replace(x.samples, value=value)))
    again = replace(problem, stretches=tuple(made))
    solution = solve(again, s.structure, s.p, s.first, fitted.prior, anchor=first_states(again))
    return replace(fitted, problem=again, solution=solution)


def test_a_compass_that_wanders_is_no_push():
    """Its drift is told as the heading's own: pushes that could make it would leave nothing known of the vessel."""
    size = np.radians(1.0)
    found = with_disturbances(with_a_wandering_compass(sailed(), np.random.default_rng(2), size))
    assert found.disturbed.sizes.drift[1] == pytest.approx(size, rel=0.5)
    assert found.disturbed.sizes.push[2] < 1e-3


@pytest.mark.parametrize("restricted", [True, False])
def test_slopes_of_the_likelihood_are_those_of_its_values(restricted):
    rng, n, q = np.random.default_rng(1), 6, 3
    rows = rng.standard_normal((5, n + q + 1, 30))
    m = rows @ rows.transpose(0, 2, 1)
    shapes, across, toward = m[:, :n, :n], m[:, :n, n : n + q], m[:, :n, -1]
    information, score = m[:, n:-1, n:-1].sum(axis=0), m[:, n:-1, -1].sum(axis=0)
    reduced = _Reduced(shapes, across, toward, information, score, 1.0)
    x, step = rng.standard_normal(n) - 2.0, 1e-6 * np.eye(n)
    values = [[_less(reduced, np.exp(x + by * s), restricted)[0] for s in step] for by in (1.0, -1.0)]
    slopes = _less(reduced, np.exp(x), restricted)[1]
    assert slopes == pytest.approx((np.array(values[0]) - values[1]) / 2e-6, abs=1e-6)


def test_a_sensor_s_drift_is_on_lines_between_the_middles_of_the_blocks():
    """What is off by as much as the time itself, there, is so at every sample between the first and the last."""
    fitted = sailed()
    s, problem = fitted.solution, fitted.problem
    drives, count = [drive(s.structure, s.p, x) for x in problem.stretches], blocks_in(problem)
    stretch, window = problem.stretches[0], problem.windows[0]
    [answers, *_] = unit_answers(problem, s.structure, drives, s.first, count)
    heading = np.nonzero(stretch.samples.kind[window.samples] == HEADING)[0] + window.samples.start
    since = (stretch.samples.t[heading] - stretch.start) / stretch.h - window.first
    middles = (np.arange(count) + 0.5) * window.steps / count
    told = answers[heading, 0, 5] @ middles
    assert np.allclose(told, np.clip(since, middles[0], middles[-1]))
    assert np.allclose(answers[heading, 0, 5].sum(axis=1), 1.0)
