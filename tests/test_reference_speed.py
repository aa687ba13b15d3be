"""The speed that a model is about: where the search for it begins, and where it stands in a fit that was read back."""

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import BOAT, PROPELLER, RUDDER, structure_of
from test_kernel import stretch_of

from identify.fit import Estimated, Fit
from identify.reference_speed import with_speed_from_motion
from identify.simulate.rebuild import rebuild
from identify.term import unit_of

STEPS, STEP = 600, 0.1


def run_up_to(speed):
    """A stretch of a vessel that gains the speed at which it keeps itself, turning to and fro."""
    t = STEP * np.arange(STEPS + 1)
    v, r = 0.1 * np.sin(0.7 * t), 0.3 * np.cos(0.4 * t)
    u = np.full(STEPS + 1, 0.3)
    for k in range(STEPS):
        over = u[k] - speed
        u[k + 1] = u[k] + STEP * (-0.1 * over - 0.05 * over * np.hypot(u[k], v[k]) + 0.8 * v[k] * r[k])
    states = np.column_stack([t, t, 0.75 * np.sin(0.4 * t), u, v, r])
    return replace(stretch_of((RUDDER, PROPELLER)), steps=STEPS, states=states, wind=np.zeros((STEPS, 2)))


@pytest.mark.parametrize("speed", [1.0, 1.4])
def test_the_search_begins_at_the_speed_that_the_vessel_keeps(speed):
    structure = structure_of("abkowitz", u0=0.9 * speed, u0_found=True)
    found = with_speed_from_motion(structure, [run_up_to(speed)])
    assert found.u0 == pytest.approx(speed, rel=0.02)
    known = structure_of("abkowitz", u0=0.9 * speed)
    assert with_speed_from_motion(known, [run_up_to(speed)]) is known


@pytest.mark.parametrize("seed", range(6))
def test_another_zero_of_the_resistance_is_not_the_speed_that_the_vessel_keeps(seed):
    """A resistance that vanishes at 0.7 m/s as well as at 1.4: from both the same, and only one was kept."""
    stretch, u = run_up_to(1.4), np.full(STEPS + 1, 1.05)
    for k in range(STEPS):
        u[k + 1] = u[k] - STEP * 0.3 * (u[k] - 1.4) * (u[k] - 0.7)
    states = np.column_stack([stretch.states[:, :3], u, stretch.states[:, 4:] * 1e-3])
    noise = 5e-3 * np.random.default_rng(seed).standard_normal(len(u))
    states[:, 3] += noise
    structure = structure_of("abkowitz", u0=1.25, u0_found=True)
    found = with_speed_from_motion(structure, [replace(stretch, states=states)])
    assert found.u0 == pytest.approx(1.4, rel=0.03)


def test_a_speed_that_was_found_is_a_parameter_of_the_fit_that_is_read_back():
    own = {("u", "Δu"): -0.2, ("r", "r"): -0.5, ("r", "δU²"): 0.4}
    terms = [Estimated(d, f"{d} {x}", c, 0.01, unit_of(x, d), term=x) for (d, x), c in own.items()]
    coefficients = (*terms, Estimated("", "u0", 1.1, 0.02, "m/s"))
    covariance = np.diag([c.stderr**2 for c in coefficients])
    fit = Fit("abkowitz", BOAT, (RUDDER, PROPELLER), "output_error", "auto", 0, coefficients, (), covariance, 1.0,
              "", "", u0=1.1)  # fmt: skip
    again = rebuild(fit)
    assert again.structure.u0_at(again.p) == 1.1
    assert len(again.p) == len(again.structure.slots) == len(coefficients)
    assert again.covariance[-1, -1] == pytest.approx(0.02**2)
