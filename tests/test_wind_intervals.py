"""A wind that nothing measured is known by the inverse of its speed, and its intervals reach as far as that leads."""

from __future__ import annotations

import numpy as np
import pytest
from identification_samples import PROPELLER, RUDDER, structure_of

from identify.effect import Active, Variant
from identify.effects import EFFECTS
from identify.report_fit import fitted_effect
from identify.structure import null_parameters


@pytest.mark.parametrize(("name", "wide"), [("wind", 1.0 / (1.0 - 1.96 * 0.2)), ("current", 1.0)])
def test_a_winds_speed_is_known_by_its_inverse_and_its_interval_reaches_as_far(name, wide):
    structure = structure_of("linear", (RUDDER, PROPELLER))
    effect = next(e for e in EFFECTS if e.name == name and e.report)
    structure = structure.with_effect(Active(effect, Variant()))
    p = null_parameters(structure)
    places = {s.name: k for k, s in enumerate(structure.slots) if s.effect == 0}
    p[places["north"]] = 4.0
    covariance = np.zeros((len(p), len(p)))
    covariance[places["north"], places["north"]] = 0.8**2
    made, jacobian = fitted_effect(structure, p, covariance, 0)
    speed = next(k for k, e in enumerate(made.parameters) if e.name == "speed")
    assert made.parameters[speed].stderr == pytest.approx(0.8 * wide)
    assert np.sqrt((jacobian @ covariance @ jacobian.T)[speed, speed]) == pytest.approx(0.8)
    covariance *= 100.0  # what says next to nothing of the speed is not said to be worse than that
    assert fitted_effect(structure, p, covariance, 0)[0].parameters[speed].stderr <= 10.0 * 8.0 * 1.001


def test_a_winds_areas_reach_where_the_inverse_of_its_speed_leads_them():
    structure = structure_of("linear", (RUDDER, PROPELLER))
    effect = next(e for e in EFFECTS if e.name == "wind" and e.report)
    structure = structure.with_effect(Active(effect, Variant()))
    p = null_parameters(structure)
    places = {s.name: k for k, s in enumerate(structure.slots) if s.effect == 0}
    p[places["north"]], p[places["cx"]], p[places["cy"]] = 4.0, 1e-3, 2e-3
    along = np.zeros(len(p))  # a push that is known: what doubles the speed leaves a quarter of the area
    along[places["north"]], along[places["cx"]] = 0.2 * 4.0, -0.4 * 1e-3
    covariance = np.outer(along, along)
    covariance[places["cy"], places["cy"]] = 1e-12
    made = {e.name: e for e in fitted_effect(structure, p, covariance, 0)[0].parameters}
    slowest = 1.0 / (1.0 + 1.96 * 0.2)
    assert made["cx"].value + 1.96 * made["cx"].stderr == pytest.approx(1e-3 / slowest**2)
    assert 1e-6 < made["cy"].stderr < 1.5e-6
