"""Eigenvectors of what is hidden: as sharp without the many columns that show next to nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.whitening import LEAST, SLIGHT, eigen


@given(
    seed=st.integers(0, 10_000), rows=st.integers(1, 30), large=st.integers(0, 5), small=st.integers(0, 60)
)
def test_columns_that_show_next_to_nothing_move_no_eigenvalue_that_counts(seed, rows, large, small):
    rng = np.random.default_rng(seed)
    size = np.concatenate([rng.uniform(0.1, 3.0, large), 1e-3 * rng.uniform(0.0, 1.0, small)])
    answers = rng.standard_normal((rows, 2, large + small)) * rng.permutation(size)
    power, vectors = eigen(answers)
    flat = answers.reshape(2 * rows, -1)
    every = np.sort(np.linalg.svd(flat, compute_uv=False))[::-1] ** 2
    found = np.sort(power)[::-1]
    sure = int((every > LEAST + SLIGHT).sum())
    assert sure <= len(found) <= int((every > LEAST - SLIGHT).sum())
    assert found == pytest.approx(every[: len(found)], abs=1.01 * SLIGHT)
    along = vectors.reshape(2 * rows, -1)
    assert along.T @ along == pytest.approx(np.eye(len(found)), abs=1e-9)


def test_nothing_hidden_has_no_eigenvectors():
    for answers in (np.zeros((7, 2, 0)), np.zeros((7, 2, 3))):
        power, vectors = eigen(answers)
        assert (power.shape, vectors.shape) == ((0,), (7, 2, 0))
