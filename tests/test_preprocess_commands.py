"""What of an input's samples is no value of the input."""

from __future__ import annotations

import numpy as np
import pytest

from preprocess.commands import LASTING, spikes

STEP = 0.5


def feedback(seed=1, n=400):
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(n)
    return t, 0.3 * np.sin(0.05 * t) + 0.001 * rng.standard_normal(n)


def test_a_single_sample_that_stands_out_is_a_spike():
    t, value = feedback()
    value[100] += 0.3
    assert np.flatnonzero(spikes(t, value, 0.001)).tolist() == [100]


@pytest.mark.parametrize("lasts", [12.0, LASTING * STEP])
def test_one_that_lasts_is_an_order(lasts):
    """A logger that enters orders as they change enters one that is held for long once."""
    t, value = feedback()
    value[100] += 0.3
    t[101:] += lasts - STEP
    assert not spikes(t, value, 0.001).any()
