"""A declared model that lacks terms: these are found, and what is missing besides."""

from __future__ import annotations

import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.prepare import prepare
from validate.loop import search


@pytest.mark.slow
def test_a_compass_that_is_off_is_found_beside_the_rudders_flow():
    """A patrol boat's rudder forces do not ask for the speed; the declared model's grow with its square."""
    bias = Effect("heading_bias", {"bias": -0.07})
    _, trials = trials_of("patrol", ("zigzag", "random"), 36.0, 5, (bias,), validate=0)
    prepared = prepare(trials, "cybership2")
    outcome = search(prepared)
    fitted = outcome.fitted
    structure = fitted.solution.structure
    assert {s.active.label for s in outcome.standing} == {"rudder_flow", "heading_bias"}
    place = next(k for k, a in enumerate(structure.actives) if a.label == "heading_bias")
    assert structure.values(fitted.solution.p, place)["bias"] == pytest.approx(-0.07, abs=0.003)
    assert fitted.chi2_per_dof < 1.3
