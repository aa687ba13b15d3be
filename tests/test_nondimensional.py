"""The prime system both ways."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import PROPELLER, RUDDER

from identify.fit import Estimated
from identify.models import MODELS, terms_for
from identify.nondimensional import dimensions, from_prime, scale_factors, to_prime, unit_size
from identify.simulate import Order, simulate
from identify.term import unit_of
from preprocess.vessel import Vessel

SIZES = st.floats(0.1, 300.0)


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("1", (0, 0)),
        ("m/s²", (1, -2)),
        ("1/m", (-1, 0)),
        ("s²/m³", (-3, 2)),
        ("1/(m·s²)", (-1, -2)),
        ("1/m/s²", (-1, -2)),
        ("m·s", (1, 1)),
    ],
)
def test_dimensions_of_units(unit, powers):
    assert dimensions(unit) == powers


def test_other_units_are_refused():
    with pytest.raises(ValueError, match="kg"):
        dimensions("kg/m")


def test_the_prime_of_an_acceleration_and_of_a_damping():
    assert unit_size("m/s²", 7.0, 1.2) == pytest.approx(1.2**2 / 7.0)
    assert unit_size("1/s", 7.0, 1.2) == pytest.approx(1.2 / 7.0)
    assert unit_size("1/m", 7.0, 1.2) == pytest.approx(1 / 7.0)
    assert unit_size("1", 7.0, 1.2) == 1.0


@cache
def coefficients_of_all_models():
    """Equation, name and unit of every kind of coefficient, once."""
    terms = [t for m in MODELS for t in terms_for(m, Vessel("a", 1.0, 0.5), (RUDDER, PROPELLER))[0]]
    return tuple({t.text + t.dof: (t.dof, t.name, unit_of(t.text, t.dof)) for t in terms}.values())


@given(SIZES, st.floats(0.1, 20.0), st.floats(-5, 5))
def test_there_and_back(length, speed, value):
    units = [unit for _, _, unit in coefficients_of_all_models()]
    own = [Estimated(dof, name, value, 0.1, unit) for dof, name, unit in coefficients_of_all_models()]
    prime = to_prime(own, length, speed)
    assert {p.unit for p in prime} == {"1"}
    for back, before in zip(from_prime(prime, units, length, speed), own, strict=True):
        assert back.value == pytest.approx(before.value, rel=1e-12)
        assert back.stderr == pytest.approx(before.stderr, rel=1e-12)
        assert back.unit == before.unit
    factors = scale_factors(units, length, speed)
    assert np.allclose([p.value for p in prime], factors * value)


def test_a_larger_ship_of_the_same_prime_coefficients_turns_in_the_same_lengths():
    from test_simulate import BLANKE, fit_of

    small = fit_of({k: v for k, v in BLANKE.items() if k[1] != "|n|n"}, "blanke", (RUDDER,))
    turn = Order("circle", math.radians(35), speed=1.0, samples=0)
    units = [c.unit for c in small.coefficients]
    prime = to_prime(small.coefficients, small.vessel.length, 1.0)
    scale = 9.0
    large = fit_of({}, "blanke", (RUDDER,))
    length, speed = scale * small.vessel.length, math.sqrt(scale)
    large = type(large)(**vars(large) | {
        "coefficients": from_prime(prime, units, length, speed), "vessel": Vessel("large", length, 4.0),
        "covariance": np.zeros((len(units), len(units))),
    })  # fmt: skip
    first = simulate(small, turn)
    second = simulate(large, Order("circle", math.radians(35), speed=speed, samples=0))
    # without thrust both lose a little speed over the step before the helm is put over
    for name in ("advance", "transfer", "tactical_diameter"):
        assert second[name].value == pytest.approx(scale * first[name].value, rel=8e-3)
    assert second["time_to_90"].value == pytest.approx(math.sqrt(scale) * first["time_to_90"].value, rel=8e-3)
