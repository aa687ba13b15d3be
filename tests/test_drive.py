"""What drives a stretch, and how it changes with the parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import MOTORS, PROPELLER, RUDDER, structure_of
from test_kernel import stretch_of

from identify.directions import all_directions, directions
from identify.drive import drive, drives
from identify.effect import Active, Variant
from identify.effects.actuators import ACTUATOR_DEADBAND, ACTUATOR_LAG, ACTUATOR_OFFSET, ACTUATOR_RATE_LIMIT
from identify.effects.sensors import HEADING_BIAS, MASS_CHANGE
from identify.effects.water_and_air import CURRENT
from identify.kernel import CHANNEL
from identify.predict import accelerations_at
from identify.regression import regressors, regressors_along
from identify.steady import moved
from identify.structure import null_parameters
from identify.term import FACTORS


def test_a_lead_of_the_inputs_moves_the_channels_as_the_inputs_change():
    """What the directions say of a lead, summed over time, is what the inputs changed by."""
    structure, stretch = (
        replace(structure_of("modulus"), input_lead=(0.0, 0.05)),
        stretch_of((RUDDER, PROPELLER)),
    )
    p = null_parameters(structure)
    here = drive(structure, p, stretch)
    ways = directions(structure, p, stretch, here)
    lead = list(structure.general).index(len(structure.slots) - 1)
    up, down = (
        drive(structure, p + np.where(np.arange(len(p)) == len(p) - 1, x, 0.0), stretch)
        for x in (0.02, -0.02)
    )
    slope = (up.channels - down.channels) / 0.04
    assert np.abs(slope).max() > 0.1
    for column, (place, which) in zip(ways.values.T, ways.driven, strict=True):
        if which == lead:
            true = np.cumsum(slope[:, place - CHANNEL]) * stretch.h
            assert np.cumsum(column) * stretch.h == pytest.approx(true, abs=0.02 * np.ptp(true))


@pytest.mark.parametrize(
    ("effect", "options", "size"),
    [
        (ACTUATOR_LAG, {}, 0.4),
        (ACTUATOR_LAG, {}, 0.0),
        (ACTUATOR_RATE_LIMIT, {}, 0.8),
        (ACTUATOR_OFFSET, {}, 0.03),
        (ACTUATOR_DEADBAND, {"form": "neutral", "shape": "shifted"}, 0.1),
        (ACTUATOR_DEADBAND, {"form": "neutral"}, None),
    ],
)  # fmt: skip
def test_what_acts_on_an_input_moves_its_channels_as_a_difference_says(effect, options, size):
    """Beside what acts on another input; from a bound as well, and about a value of the input that it passes."""
    structure = structure_of("modulus", MOTORS)
    for other in (Active(ACTUATOR_OFFSET, Variant("right")), Active(effect, Variant("left", options))):
        structure = structure.with_effect(other)
    stretch, p = stretch_of(MOTORS), null_parameters(structure)
    k = next(k for k, s in enumerate(structure.slots) if s.effect == 1)
    p[k] = np.abs(stretch.inputs["left"].value).min() if size is None else size
    here = drive(structure, p, stretch)
    ways = directions(structure, p, stretch, here)
    ends = [moved(structure, p, k, x) for x in (1.0, -1.0)]
    one, other = (drive(structure, q, stretch) for q in ends)
    for found, name in ((ways.values, "channels"), (ways.slopes, "slopes")):
        true = (getattr(one, name) - getattr(other, name)) / (ends[0][k] - ends[1][k])
        mine = np.zeros_like(true)
        for column, (place, g) in zip(found.T, ways.driven, strict=True):
            if structure.general[g] == k:
                mine[:, place - CHANNEL] = column
        assert np.abs(true).max() > 0.0
        assert np.linalg.norm(mine - true) < 0.02 * np.linalg.norm(true)


@pytest.mark.parametrize("options", [{"form": "neutral"}, {"form": "neutral", "shape": "shifted"}])
def test_what_stands_at_its_upper_bound_has_derivatives(options):
    structure = structure_of("modulus", MOTORS, extents={"left": (0.7, 1.0)})
    structure = structure.with_effect(Active(ACTUATOR_DEADBAND, Variant("left", options)))
    stretch, p = stretch_of(MOTORS), null_parameters(structure)
    k = next(k for k, s in enumerate(structure.slots) if s.effect == 0)
    p[k] = structure.slots[k].parameter.bounds[1]
    assert np.isfinite(p[k]) and moved(structure, p, k, 1.0)[k] == p[k]
    ways = directions(structure, p, stretch, drive(structure, p, stretch))
    assert np.isfinite(ways.values).all() and np.isfinite(ways.slopes).all()


def with_speed(**options):
    """Abkowitz's model about a speed that is found, with terms of a size, and a drive of it."""
    structure = structure_of("abkowitz", u0=0.7, **options)
    p = null_parameters(structure)
    p[structure.simple] = np.linspace(-0.3, 0.1, len(structure.simple))
    return structure, p, stretch_of((RUDDER, PROPELLER))


def test_a_speed_that_is_found_moves_what_is_measured_from_it():
    structure, p, stretch = with_speed(u0_found=True)
    k = [s.name for s in structure.slots].index("u0")
    here = drive(structure, p, stretch)
    ways = directions(structure, p, stretch, here)
    state = np.array([0.0, 0.0, 0.3, 0.9, 0.1, 0.05, 0.0, 0.0])

    def at(value):
        moved = np.where(np.arange(len(p)) == k, value, p)
        return accelerations_at(structure, drive(structure, moved, stretch), state, 0)[:3]

    (place,) = (i for i, (_, g) in enumerate(ways.driven) if structure.general[g] == k)
    assert ways.driven[place, 0] == FACTORS.index("Δu")
    assert (ways.values[:, place] == -1.0).all()
    assert np.abs(at(0.71) - at(0.69)).max() > 1e-3


def test_a_speed_that_is_known_is_no_parameter_and_gives_the_same():
    (found, p, stretch), (known, q, _) = with_speed(u0_found=True), with_speed()
    assert len(p) == len(q) + 1 and not known.u0_is_free and known.u0_at(q) == 0.7
    a, b = (drive(s, x, stretch) for s, x in ((found, p), (known, q)))
    assert a.u0 == b.u0 == 0.7
    assert np.array_equal(regressors(found, p, stretch), regressors(known, q, stretch))
    assert not structure_of("blanke", u0_found=True).u0_is_free


def test_a_load_in_one_log_is_in_that_log_alone():
    """Logs are evaluated together, and what is the same in all of them once: not what one of them has alone."""
    structure = structure_of("modulus")
    for active in (
        Active(CURRENT),
        Active(MASS_CHANGE, Variant(options={"logs": ("b",)})),
        Active(HEADING_BIAS),
    ):
        structure = structure.with_effect(active)
    p = null_parameters(structure) + np.linspace(0.01, 0.02, len(structure.slots))
    stretches = [replace(stretch_of((RUDDER, PROPELLER), seed), name=n) for seed, n in enumerate("aba")]
    here = drives(structure, p, stretches)
    light, loaded, light_too = (d.coefficients for d in here)
    ratio = structure.values(p, 1)["ratio"]
    assert np.array_equal(light, light_too)
    assert np.count_nonzero(loaded != light) > 3 and loaded[0] == pytest.approx(light[0] / ratio)
    for stretch, d, ways in zip(stretches, here, all_directions(structure, p, stretches, here), strict=True):
        assert np.array_equal(d.channels, drive(structure, p, stretch).channels)
        for g, k in enumerate(structure.general):
            ends = [drive(structure, p + x * (np.arange(len(p)) == k), stretch) for x in (1e-5, -1e-5)]
            for name, found in (("coefficients", ways.coefficients[g]), ("current", ways.current[:, g]),
                                ("sensor", ways.sensor[:, g])):  # fmt: skip
                by_difference = (getattr(ends[0], name) - getattr(ends[1], name)) / 2e-5
                assert found == pytest.approx(by_difference, abs=1e-4 * max(1.0, np.abs(found).max()))


def test_regressors_along_a_stretchs_own_motion_are_those_of_the_stretch():
    structure, stretch = structure_of("modulus"), stretch_of((RUDDER, PROPELLER))
    p = null_parameters(structure)
    d = drive(structure, p, stretch)
    along = regressors_along(structure, d, d.channels, stretch.states)
    assert np.array_equal(along, regressors(structure, p, stretch))
