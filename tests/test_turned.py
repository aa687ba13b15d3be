"""Thrusters that turn push where they point."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.turned import turned

place = st.tuples(st.floats(-20, 20), st.floats(-20, 20))


@given(st.integers(0, 40), st.integers(0, 2**32 - 1), place)
def test_a_turned_force_is_what_cosine_and_sine_make_of_it(n, seed, where):
    rng = np.random.default_rng(seed)
    force, angle = rng.normal(size=n), rng.uniform(-50, 50, n)
    along, across = force * np.cos(angle), force * np.sin(angle)
    expected = np.array([along, across, where[0] * across - where[1] * along])
    assert turned(force, angle, where) == pytest.approx(expected, abs=1e-11)
