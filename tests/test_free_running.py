"""Free runs over whole logs: what waves that are known do to them is no error of the model."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from identify.free_running import less_waves
from identify.swell import Swell

SWELL = Swell(1.7, 0.1, (0.05, 0.08, 0.02))


def stretch(swell):
    return SimpleNamespace(h=0.1, swell=swell)


def errors(size):
    """Errors (3000, 3) that swing with the waves, on top of one that stays."""
    t = 0.1 * np.arange(3000)
    return np.column_stack([size + np.sin(1.7 * t + phase) for phase in (0.0, 1.0, 2.0)])


def test_what_swings_with_known_waves_is_no_error_of_a_free_run_and_what_stays_is():
    left = less_waves(errors(0.2), stretch(SWELL))
    assert np.mean(left**2) < 1.2 * 0.2**2
    assert np.allclose(left.mean(axis=0), 0.2, atol=0.02)


def test_where_no_waves_are_known_errors_stay_as_they_are():
    assert np.array_equal(less_waves(errors(0.2), stretch(None)), errors(0.2))
