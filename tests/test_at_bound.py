"""Effects whose value ended where it can go no further."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from identify.effect import Parameter
from validate.judgement import at_bound

FACTOR = Parameter("factor", "1", 0.1, (1.0, 10.0), null=1.0)
DAMPING = Parameter("u", "1/s", 0.1, (-5.0, 0.0))


def fit(parameter, value, coefficient=-1, effect=0, count=1):
    slot = SimpleNamespace(effect=effect, coefficient=coefficient, parameter=parameter)
    structure = SimpleNamespace(slots=[slot], actives=("effect",) * count)
    return SimpleNamespace(solution=SimpleNamespace(structure=structure, p=[value]))


@pytest.mark.parametrize(("value", "ended"), [(1.0, True), (1.4, False), (10.0, True)])
def test_water_that_is_no_shallower_than_elsewhere_is_no_shallow_water(value, ended):
    """In its coupled form the couplings alone would stand for it."""
    assert at_bound(fit(FACTOR, value)) == ended


@pytest.mark.parametrize(("value", "ended"), [(0.0, False), (-1.0, False), (-5.0, True)])
def test_one_of_several_coefficients_may_be_nothing(value, ended):
    assert at_bound(fit(DAMPING, value, coefficient=3)) == ended


def test_only_the_effect_that_is_asked_about_counts():
    assert not at_bound(fit(FACTOR, 1.0, effect=1, count=2), 0)
    assert at_bound(fit(FACTOR, 1.0, effect=1, count=2), 1)
    assert not at_bound(fit(FACTOR, 1.0, effect=-1))
    assert not at_bound(fit(FACTOR, 1.0, effect=-1, count=0))


def test_what_was_taken_before_may_be_driven_to_its_bound_by_what_is_looked_at_now():
    """A roll that stood for a slow rudder damps as much as it may once the rudder is slow."""
    assert not at_bound(fit(DAMPING, -5.0, effect=0, count=2))
    assert at_bound(fit(DAMPING, -5.0, effect=1, count=2))
