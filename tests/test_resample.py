"""A logged input on an even grid is the mean of what it was, whatever its own times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import convolve1d

from identify.slopes import averaged, slope_weights
from identify.stretch import sampled
from preprocess.trial import Measurement


def test_an_input_that_holds_is_averaged_exactly_and_one_that_varies_is_a_line():
    t = np.array([0.0, 1.0, 2.0])
    held = Measurement("a", t, np.array([0.0, 2.0, 1.0]), 0.0, np.ones(3, bool), sample_time=1.0, held=True)
    mean, more = sampled(held, 0.5, 1.0, 3)
    assert mean == pytest.approx([1.0, 1.5, 1.0])
    assert more == pytest.approx([2.0 - 1.0, 2.5 - 1.5**2, 0.0])
    line = replace(held, held=False)
    assert sampled(line, 0.4, 0.2, 1)[0] == pytest.approx([1.0])


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(-3.0, 8.0))
def test_means_of_an_input_that_holds_are_its_integral_whatever_its_times(seed, samples, begin):
    rng = np.random.default_rng(seed)
    t, value = np.sort(rng.uniform(0.0, 5.0, samples)), rng.normal(size=samples)
    held = Measurement("a", t, value, 0.0, np.ones(samples, bool), sample_time=1.0, held=True)
    mean, more = sampled(held, begin, 0.07, 80)
    edges = begin + 0.07 * np.arange(81)
    corners = np.unique(np.concatenate([edges, t]))
    at = value[np.maximum(np.searchsorted(t, 0.5 * (corners[1:] + corners[:-1])) - 1, 0)]
    whole = [
        np.diff(np.interp(edges, corners, np.concatenate([[0.0], np.cumsum(v * np.diff(corners))])))
        for v in (at, at * np.abs(at))
    ]
    assert mean * 0.07 == pytest.approx(whole[0], abs=1e-9)
    assert (more + mean * np.abs(mean)) * 0.07 == pytest.approx(whole[1], abs=1e-9)


@pytest.mark.parametrize("holds", [True, False])
def test_an_input_from_no_time_at_all_is_no_number(holds):
    m = Measurement("a", np.arange(3.0), np.ones(3), 0.0, np.ones(3, bool), sample_time=1.0, held=holds)
    assert np.isnan(sampled(m, np.nan, 0.1, 5)[0]).all()


@pytest.mark.parametrize("every", [1, 3])
def test_means_over_some_steps_are_a_convolution(every):
    columns = np.random.default_rng(0).normal(size=(23, 2))
    whole = convolve1d(columns, slope_weights(4), axis=0, mode="constant")
    assert averaged(columns, 4, every) == pytest.approx(whole[::every], abs=1e-12)
