"""What a filter leaves of rows is as white as the covariance of what it knows says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.innovations import NO_FILTER, Process, filter_of, new_in, together

COUNT = 12


def some_process(rng, states):
    """A process whose every state carries over to every other, noisily."""
    every = np.array([(i, j) for i in range(states) for j in range(states)])
    upper = every[every[:, 0] <= every[:, 1]]
    roots = rng.standard_normal((COUNT, states, states)) * 0.3
    noise = roots @ np.swapaxes(roots, 1, 2)
    return Process(
        every, rng.uniform(-0.6, 0.6, (COUNT, len(every))), upper, noise[:, upper[:, 0], upper[:, 1]],
        rng.standard_normal((COUNT, 2, states)), roots[0] @ roots[0].T + 0.1 * np.eye(states),
    )  # fmt: skip


def covariance_of(process, sigma):
    """Of all rows, in units of their σ, summed from what drives them."""
    states = len(process.begin)
    roots = [np.linalg.cholesky(process.begin)]
    rows = []
    for m in range(COUNT):
        if m:
            step, noise = np.zeros((states, states)), np.zeros((states, states))
            for (i, j), by in zip(process.places, process.carried[m], strict=True):
                step[i, j] = by
            for (i, j), by in zip(process.noise_places, process.noise[m], strict=True):
                noise[i, j] = noise[j, i] = by
            roots = [step @ r for r in roots] + [np.linalg.cholesky(noise + 1e-12 * np.eye(states))]
        rows.append([process.seen[m] @ r / sigma[m] for r in roots])
    full = np.zeros((2 * COUNT, COUNT * states))
    for m, parts in enumerate(rows):
        for k, part in enumerate(parts):
            full[2 * m : 2 * m + 2, k * states : (k + 1) * states] = part
    return np.eye(2 * COUNT) + full @ full.T


@settings(deadline=None)  # the first compiles
@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_columns_are_made_white_as_their_covariance_says(states, seed):
    rng = np.random.default_rng(seed)
    process, sigma = some_process(rng, states), rng.uniform(0.1, 1.0, COUNT)
    columns = rng.standard_normal((COUNT, 2, 3))
    known = filter_of(process, sigma, np.ones(COUNT, dtype=bool), [slice(0, COUNT)])
    left = new_in(known, slice(0, COUNT), columns).reshape(2 * COUNT, 3)
    covariance, flat = covariance_of(process, sigma), columns.reshape(2 * COUNT, 3)
    assert left.T @ left == pytest.approx(flat.T @ np.linalg.solve(covariance, flat), rel=1e-5, abs=1e-7)
    assert known.information(slice(0, COUNT)) == pytest.approx(
        np.linalg.slogdet(covariance)[1], rel=1e-6, abs=1e-6
    )


def test_processes_beside_each_other_add_their_covariances():
    rng = np.random.default_rng(3)
    parts = [some_process(rng, n) for n in (2, 3)]
    both = together(parts)
    ones = np.ones(COUNT)
    expected = sum(covariance_of(p, ones) for p in parts) - np.eye(2 * COUNT)
    assert covariance_of(both, ones) == pytest.approx(expected)


def test_every_window_begins_anew_and_what_shows_nothing_is_left_alone():
    rng = np.random.default_rng(4)
    process = some_process(rng, 2)
    used = rng.random(COUNT) < 0.7
    columns = rng.standard_normal((COUNT, 2, 1))
    halves = [slice(0, 6), slice(6, COUNT)]
    both = filter_of(process, np.ones(COUNT), used, halves)
    second = filter_of(process, np.ones(COUNT), used, halves[1:])
    assert np.array_equal(new_in(both, halves[1], columns[6:]), new_in(second, halves[1], columns[6:]))
    left = new_in(both, halves[0], columns[:6])
    assert np.array_equal(left[~used[:6]], columns[:6][~used[:6]])
    assert new_in(NO_FILTER, halves[0], columns) is columns
