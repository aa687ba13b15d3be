"""A measure that is not reached has a reason: how far the vessel came in the time that it was given."""

from __future__ import annotations

import math

import numpy as np
import pytest
from identification_samples import PROPELLER, RUDDER
from test_simulate import blanke, fit_of

from identify.simulate import Order, simulate

#: Turns by less than a hundredth of a degree per second and degree of helm.
SLUGGISH = {("r", "r"): -1.0, ("r", "δ"): 0.004}


def reasons(found):
    return [note for note in found.notes if note.startswith("Not reached")]


@pytest.mark.parametrize("kind", ["zigzag", "circle"])
def test_a_helm_that_hardly_turns_the_vessel_is_the_reason(kind):
    order = Order(kind, math.radians(20), math.radians(10), speed=1.0, samples=0)
    found = simulate(fit_of(SLUGGISH, "nomoto1", (RUDDER,)), order)
    (why,) = reasons(found)
    came, wanted = np.degrees(found.states[-1, 2]), {"zigzag": 10, "circle": 360}[kind]
    assert f"the heading came to {came:.3g}° of {wanted}°" in why
    assert "the vessel makes 1 m/s" in why


def test_a_zigzag_says_which_order_it_did_not_follow():
    """With a constant that turns to starboard as fast as the helm turns to port."""
    constant = {("r", "r"): -1.0, ("r", "δ"): 0.1, ("r", "r³"): 0.0, ("r", "1"): 0.1 * math.radians(21)}
    fit = fit_of(constant, "nomoto_nonlinear", (RUDDER,))
    found = simulate(fit, Order("zigzag", math.radians(20), math.radians(10), speed=1.0, samples=0))
    assert math.isfinite(found["first_execute_time"].value)
    assert math.isnan(found["second_execute_time"].value)
    assert "after the second order of the helm" in reasons(found)[0]


def test_a_stop_that_leaves_way_says_how_much():
    coefficients = {("u", "|u|u"): -0.001, ("u", "|n|n"): 0.0}
    fit = fit_of(coefficients, "blanke", (RUDDER, PROPELLER), typical_inputs={"n": 10.0})
    found = simulate(fit, Order("stopping", speed=1.0, samples=0))
    assert f"the vessel makes {found.states[-1, 3]:.3g} m/s ahead" in reasons(found)[0]


def test_a_spiral_to_one_side_alone_has_a_loop_without_width():
    constant = {("r", "r"): -1.0, ("r", "δ"): 0.1, ("r", "r³"): 0.0, ("r", "1"): 0.1}
    found = simulate(
        fit_of(constant, "nomoto_nonlinear", (RUDDER,)), Order("spiral", 0.4, speed=1.0, samples=0)
    )
    assert math.isnan(found["loop_width"].value)
    assert "keeps to one side" in reasons(found)[0]


@pytest.mark.parametrize("kind", ["zigzag", "circle", "stopping", "spiral"])
def test_what_is_reached_needs_no_reason(kind):
    found = simulate(blanke(), Order(kind, 0.6, samples=0))
    assert all(math.isfinite(m.value) for m in found.measures)
    assert reasons(found) == []
