"""A wind that nothing measured: what is known of winds keeps its speed from running away."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effects.water_and_air import SAILED_IN
from identify.prepare import prepare
from validate.candidates import candidates, screen
from validate.judgement import at_bound
from validate.look_alikes import blows
from validate.refits import begun_at, converges, refit

SPEED, FROM = 6.0, 0.8


@cache
def blown():
    values = {
        "speed": SPEED,
        "direction": FROM,
        "cx": 0.002,
        "cy": 0.003,
        "cn": 0.0005,
        "gust": 0.0,
        "veer": 0.0,
    }
    _, trials = trials_of("usv", ("zigzag", "circle", "random"), 70.0, 6, (Effect("wind", values),))
    prepared = prepare(trials, "modulus")
    wind = next(a for a in candidates(prepared.structure) if a.effect.name == "wind")
    structure = prepared.structure.with_effect(wind)
    p = np.array([s.parameter.null for s in structure.slots])
    for k, slot in enumerate(structure.slots):
        if slot.name in ("north", "east") and slot.effect >= 0:
            p[k] = -4.0
    return fit_from_scratch(structure, prepared.identify, p)


def test_a_wind_is_found_from_where_it_comes_and_not_at_a_bound():
    fitted = blown()
    values = fitted.solution.structure.values(fitted.solution.p, 0)
    assert fitted.chi2_per_dof < 1.1
    assert not at_bound(fitted)
    comes_from = np.arctan2(-values["east"], -values["north"])
    assert comes_from == pytest.approx(FROM, abs=0.1)
    assert np.hypot(values["north"], values["east"]) < 2.5 * SAILED_IN
    assert values["cx"] > 0 and values["cy"] > 0  # it pushes the way it blows


def test_a_light_wind_is_looked_for_where_it_comes_from_and_not_where_it_would_have_to_pull():
    """To first order one from the other side that pulls would do as well; and without forces no wind says anything."""
    light = {"speed": 8.0, "direction": FROM, "cx": 4e-5, "cy": 6e-5, "cn": 1e-5, "gust": 0.0, "veer": 0.0}
    _, trials = trials_of(
        "usv", ("zigzag", "circle", "random"), 70.0, 6, (Effect("wind", light),), validate=0
    )
    prepared = prepare(trials, "modulus")
    base = fit_from_scratch(prepared.structure, prepared.identify)
    assert converges(base)
    [looked_at] = screen(base, [a for a in candidates(prepared.structure) if a.effect.name == "wind"])
    start = looked_at.active.effect.report(dict(zip(("north", "east"), looked_at.unmoved[-2:], strict=True)))
    assert np.cos(start["direction"] - FROM) > 0.5
    fitted = refit(base, looked_at)
    values = fitted.solution.structure.values(fitted.solution.p, 0)
    assert base.solution.total - fitted.solution.total > 250.0
    assert np.arctan2(-values["east"], -values["north"]) == pytest.approx(FROM, abs=0.1)


def test_a_wind_of_no_speed_is_damping_by_another_name():
    fitted = blown()
    assert blows(fitted)
    slots = fitted.solution.structure.slots
    calm = np.array([s.effect >= 0 and s.name in ("north", "east") for s in slots])
    assert not blows(begun_at(fitted, np.where(calm, 1e-3, fitted.solution.p), 0))
