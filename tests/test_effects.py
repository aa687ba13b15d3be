"""Every effect does what its definition says, wherever it acts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from identification_samples import MOTORS, PROPELLER, RUDDER, structure_of
from test_kernel import FIRST, STEP, STEPS, parameters_of, stretch_of

from identify.acting import actuators_of
from identify.drive import drive
from identify.effect import Active, Variant
from identify.effects import EFFECTS
from identify.effects.propulsion import THRUST_AMONG_MANY
from identify.predict import run, shown
from identify.report_fit import fitted_effect
from identify.stretch import SUBSTEPS
from identify.structure import null_parameters
from validate.candidates import candidates

FINE = STEP / SUBSTEPS
#: The contract's table: name, and the names of what is reported.
CONTRACT = {
    "current": {"speed", "direction"}, "wind": {"cx", "cy", "cn"}, "actuator_lag": {"time_constant"},
    "actuator_delay": {"delay"}, "actuator_rate_limit": {"rate"}, "actuator_deadband": {"width"},
    "actuator_offset": {"offset"}, "input_wiring": set(), "thrust_asymmetry": {"ratio"},
    "propeller_walk": {"sway", "yaw"}, "thrust_fade": {"rate"}, "thrust_loss_with_speed": {"coefficient"},
    "quadratic_damping": {"u", "v", "r"}, "turning_resistance": {"vr", "rr", "dd"},
    "port_starboard_asymmetry": {"sway", "yaw"}, "heading_bias": {"bias"}, "gyro_bias": {"bias", "scale"},
    "antenna_offset": {"x", "y"}, "clock_offset": {"offset"}, "mass_change": {"ratio"},
    "roll_coupling": {"frequency", "damping", "sway", "yaw"}, "shallow_water": {"factor"},
    "waves": {"frequency", "u", "v", "r"},
}  # fmt: skip
#: What the library has besides: terms by which a declared model may be too simple.
BESIDES = {
    "linear_damping": {"u", "v", "r"}, "rudder_flow": {"sway", "yaw"},
    "cross_terms": {f"{axis}_{term}" for axis in ("sway", "yaw") for term in ("uv", "ur", "vr", "rv")},
}  # fmt: skip
KNOWN = CONTRACT | BESIDES


def effect_named(name, **wanted):
    found = [e for e in EFFECTS if e.name == name]
    return next(e for e in found if all(bool(getattr(e, k)) == v for k, v in wanted.items()))


ALL = ("position", "heading", "yaw_rate")


def with_effect(name, values, variant=None, model="modulus", inputs=MOTORS, streams=ALL, **wanted):
    """A structure with one effect at given values, on coefficients that keep the vessel in range."""
    plain = structure_of(model, inputs, streams=streams)
    structure = plain.with_effect(Active(effect_named(name, **wanted), variant or Variant()))
    p = np.concatenate([parameters_of(plain), np.zeros(len(structure.slots) - len(plain.slots))])
    for k, slot in enumerate(structure.slots):
        if slot.effect == 0:
            p[k] = values[slot.name]
    return structure, p, plain, p[: len(plain.slots)]


def states_of(structure, p, stretch, first=FIRST):
    still = first.copy()
    still[6:] = 0.0
    return run(structure, drive(structure, p, stretch), stretch, still)


def actuator_of(structure, p, stretch, name):
    values = [structure.values(p, e) for e in range(len(structure.actives))]
    return actuators_of(structure, p, values, stretch)[name]


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: f"{e.name}-{e.place}")
def test_every_effect_says_what_it_is_and_where_it_comes_from(effect):
    assert effect.source
    assert effect.equation
    assert effect.sentence.endswith(".")
    assert effect.check.endswith(".")
    assert effect.name in KNOWN
    for parameter in effect.parameters:
        assert parameter.unit
        assert parameter.scale > 0
        assert parameter.bounds[0] <= parameter.null <= parameter.bounds[1]
    assert not set(effect.reported) - KNOWN[effect.name] - {"speed", "direction"}


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: f"{e.name}-{e.place}")
def test_what_is_reported_is_what_the_contract_names_with_units(effect):
    model = "blanke" if effect.name == "linear_damping" else "linear"
    motors = (*MOTORS, replace(MOTORS[0], name="middle")) if effect is THRUST_AMONG_MANY else MOTORS
    structure = structure_of(model, (RUDDER, PROPELLER, *motors), wind_logged=effect.parameters == ())
    variants = effect.variants(structure.setting)
    assert variants
    active = Active(effect, variants[0])
    wider = structure.with_effect(active)
    p = null_parameters(wider)
    made, _ = fitted_effect(wider, p, np.eye(len(p)), 0)
    names = {e.name for e in made.parameters}
    expected = KNOWN[effect.name] | ({"speed", "direction"} if effect.air else set())
    assert names <= expected
    assert names or effect.name == "input_wiring"
    assert all(e.unit for e in made.parameters)


def test_the_library_is_the_contracts_and_terms_of_models():
    assert {e.name for e in EFFECTS} == set(KNOWN) - {"waves"}


LACKING = [
    ("zhu2019", "cross_terms", {"sway_uv", "sway_ur", "sway_rv", "yaw_uv", "yaw_ur", "yaw_rv"}),
    ("blanke", "cross_terms", {"sway_rv", "yaw_rv"}),
    ("cybership2", "cross_terms", set()),
    ("taylor3", "cross_terms", set()),
    ("nomoto1", "cross_terms", set()),
    ("zhu2019", "rudder_flow", {"sway", "yaw"}),
    ("taylor3", "rudder_flow", set()),
    ("nomoto1", "rudder_flow", set()),
    ("blanke", "linear_damping", {"u", "v", "r"}),
    ("zhu2019", "linear_damping", set()),
    ("abkowitz", "linear_damping", set()),
]


@pytest.mark.parametrize(("model", "name", "lacks"), LACKING)
def test_only_terms_that_a_model_lacks_are_candidates(model, name, lacks):
    structure = structure_of(model, (RUDDER, PROPELLER))
    found = effect_named(name).variants(structure.setting)
    slots = [s for v in found for s in structure.with_effect(Active(effect_named(name), v)).slots]
    assert {s.name for s in slots if s.effect == 0} == lacks


@pytest.mark.parametrize(
    ("model", "term"), [("zhu2019", "δU²"), ("blanke", "δU²"), ("cybership2", "δ"), ("modulus", "δ")]
)
def test_a_rudder_gets_the_flow_that_its_model_lacks(model, term):
    structure = structure_of(model, (RUDDER, PROPELLER)).with_effect(Active(effect_named("rudder_flow")))
    assert {t.text for t in structure.table.terms} >= {term}


@pytest.mark.parametrize("held", [False, True], ids=["lines", "held"])
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: f"{e.name}-{e.place}")
def test_at_its_null_an_effect_changes_nothing(effect, held):
    structure = structure_of("modulus", (RUDDER, PROPELLER, *MOTORS), wind_logged=effect.parameters == ())
    stretch = stretch_of((RUDDER, PROPELLER, *MOTORS))
    stretch = replace(
        stretch, inputs={n: replace(m, held=held, t=m.t + 0.0071) for n, m in stretch.inputs.items()}
    )
    p = parameters_of(structure)
    for variant in effect.variants(structure.setting):
        if effect.rewire:
            continue
        wider = structure.with_effect(Active(effect, variant))
        q = np.concatenate([p, null_parameters(wider)[len(p) :]])
        assert np.allclose(
            states_of(wider, q, stretch)[:, :6], states_of(structure, p, stretch)[:, :6], atol=1e-12
        )


def test_a_delay_moves_the_input_and_nothing_else():
    structure, p, plain, q = with_effect("actuator_delay", {"delay": 0.25}, Variant("left"))
    stretch = stretch_of(MOTORS)
    late, prompt = actuator_of(structure, p, stretch, "left"), actuator_of(plain, q, stretch, "left")
    shift = round(0.25 / FINE)
    assert np.allclose(late[shift:], prompt[:-shift], atol=1e-9)
    same = [actuator_of(s, x, stretch, "right") for s, x in ((structure, p), (plain, q))]
    assert np.array_equal(*same)


def test_an_offset_adds():
    structure, p, plain, q = with_effect("actuator_offset", {"offset": 0.07}, Variant("right"))
    stretch = stretch_of(MOTORS)
    both = [actuator_of(s, x, stretch, "right") for s, x in ((structure, p), (plain, q))]
    assert np.allclose(both[0] - both[1], 0.07)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"swapped": ("left", "right")}, lambda a, b: (b, a)),
        ({"reversed": ("left",)}, lambda a, b: (-a, b)),
        ({"swapped": ("left", "right"), "reversed": ("left", "right")}, lambda a, b: (-b, -a)),
    ],
)
def test_wiring_exchanges_and_reverses(options, expected):
    structure, p, plain, q = with_effect("input_wiring", {}, Variant(options=options))
    stretch = stretch_of(MOTORS)
    was = [actuator_of(plain, q, stretch, n) for n in ("left", "right")]
    now = [actuator_of(structure, p, stretch, n) for n in ("left", "right")]
    assert np.allclose(now, expected(*was))


def test_asymmetry_scales_one_thrust_and_fade_all_of_them():
    stretch = stretch_of(MOTORS)
    structure, p, plain, q = with_effect("thrust_asymmetry", {"ratio": 0.7}, Variant("left"))
    for name, ratio in (("left", 0.7), ("right", 1.0)):
        pair = [actuator_of(s, x, stretch, f"thrust {name}") for s, x in ((structure, p), (plain, q))]
        assert np.allclose(pair[0], ratio * pair[1])
    structure, p, plain, q = with_effect("thrust_fade", {"rate": 0.01})
    time = stretch.campaign_time + FINE * (np.arange(STEPS * SUBSTEPS) + 0.5)
    for name in ("left", "right"):
        pair = [actuator_of(s, x, stretch, f"thrust {name}") for s, x in ((structure, p), (plain, q))]
        assert np.allclose(pair[0], (1 - 0.01 * time) * pair[1])


def test_a_current_carries_the_vessel_and_nothing_else():
    """Seen from the water, a vessel in a current moves as one in still water does."""
    structure, p, plain, q = with_effect("current", {"north": 0.3, "east": -0.2})
    stretch = stretch_of(MOTORS)
    moved, still = states_of(structure, p, stretch), states_of(plain, q, stretch)
    t = STEP * np.arange(STEPS + 1)
    assert np.allclose(moved[:, 2:6], still[:, 2:6], atol=1e-12)
    assert np.allclose(moved[:, 0] - still[:, 0], 0.3 * t, atol=1e-9)
    assert np.allclose(moved[:, 1] - still[:, 1], -0.2 * t, atol=1e-9)


def test_current_flows_to_and_wind_comes_from():
    for name, values, wanted in (("current", (0.0, 0.5), math.pi / 2), ("wind", (0.0, -4.0), math.pi / 2)):
        effect = effect_named(name, report=True)
        first, second = (q.name for q in effect.parameters)
        said = effect.report(dict(zip((first, second), values, strict=True)))
        assert said["direction"] == pytest.approx(wanted)
        assert said["speed"] == pytest.approx(abs(values[1]))


def test_wind_pushes_by_its_relative_speed():
    values = {"north": 4.0, "east": 1.0, "cx": 0.01, "cy": 0.02, "cn": 0.03}
    structure, p, plain, q = with_effect("wind", values, air=True)
    h = 1e-4
    stretch = replace(stretch_of(MOTORS), wind=np.zeros((STEPS, 2)), steps=STEPS, h=h)
    first = FIRST.copy()
    psi, u, v = first[2:5]
    wx = 4.0 * math.cos(psi) + math.sin(psi) - u
    wy = -4.0 * math.sin(psi) + math.cos(psi) - v
    air = math.hypot(wx, wy)
    moved, still = states_of(structure, p, stretch, first), states_of(plain, q, stretch, first)
    rate = (moved[1, 3:6] - still[1, 3:6]) / h
    assert rate == pytest.approx([0.01 * air * wx, 0.02 * air * wy, 0.03 * air * wy], rel=1e-3)


TERMS = {
    "propeller_walk": ("n", {"sway": 1e-3, "yaw": -2e-3},
                       lambda u, v, r, n, d: (0, 1e-3 * n * abs(n), -2e-3 * n * abs(n))),
    "thrust_loss_with_speed": (None, {"coefficient": 0.01}, lambda u, v, r, n, d: (-0.01 * abs(n) * u, 0, 0)),
    "quadratic_damping": (None, {"u": -0.1, "v": -0.2, "r": -0.3},
                          lambda u, v, r, n, d: (-0.1 * u * abs(u), -0.2 * v * abs(v), -0.3 * r * abs(r))),
    "turning_resistance": (None, {"dd": -0.4, "rr": 0.2, "vr": 0.3},
                           lambda u, v, r, n, d: (-0.4 * d * d + 0.2 * r * r + 0.3 * v * r, 0, 0)),
    "port_starboard_asymmetry": (None, {"sway": 0.05, "yaw": -0.06}, lambda u, v, r, n, d: (0, 0.05, -0.06)),
}  # fmt: skip


@pytest.mark.parametrize("name", TERMS)
def test_effects_that_add_terms_add_just_those(name):
    which, values, expected = TERMS[name]
    model = "linear" if name == "quadratic_damping" else "zhu2019"
    structure, p, plain, q = with_effect(
        name, values, Variant(which), model=model, inputs=(RUDDER, PROPELLER)
    )
    h = 1e-4
    stretch = replace(stretch_of((RUDDER, PROPELLER)), h=h, steps=2)
    moved, still = states_of(structure, p, stretch), states_of(plain, q, stretch)
    u, v, r = FIRST[3:6]
    n, d = (actuator_of(plain, q, stretch, x)[0] for x in ("n", "rudder"))
    rate = (moved[1, 3:6] - still[1, 3:6]) / h
    assert rate == pytest.approx(list(expected(u, v, r, n, d)), rel=1e-2, abs=1e-6)


def test_damping_gives_only_what_the_model_lacks():
    effect = effect_named("quadratic_damping")
    assert not effect.variants(structure_of("modulus", MOTORS).setting)
    assert set(effect.terms(structure_of("linear", MOTORS).setting, Variant())) == {"u", "v", "r"}


def test_roll_is_an_oscillator_driven_by_the_turn():
    values = {"frequency": 2.0, "damping": 0.1, "sway": 0.0, "yaw": 0.0}
    structure, p, _, _ = with_effect("roll_coupling", values)
    states = states_of(structure, p, stretch_of(MOTORS))
    drive_ = states[:, 3] * states[:, 5]
    angle, rate = 0.0, 0.0
    fine = np.interp(np.arange(0, STEPS * STEP, 1e-3), STEP * np.arange(STEPS + 1), drive_)
    for force in fine:
        rate += 1e-3 * (force - 4.0 * angle - 0.4 * rate)
        angle += 1e-3 * rate
    assert states[-1, 6] == pytest.approx(angle, abs=2e-3 * np.abs(states[:, 6]).max() + 1e-5)


def test_a_roll_that_answers_nothing_more_than_a_steady_turn_is_none():
    """What is left of waves wants a roll that hardly swings: its damping would have to be past the bound."""
    (damping,) = (x for x in effect_named("roll_coupling").parameters if x.name == "damping")
    most, w = damping.bounds[1], np.linspace(0.0, 2.0, 401)
    answer = 1.0 / np.abs(1.0 - w**2 + 2j * most * w)
    assert answer.max() < 1.01 * answer[0]
    assert most > 0.6, "tanks and bilge keels damp a roll by half of the critical at most"


def shown_states(name, values, variant=None, streams=ALL, **wanted):
    """What sensors show with the effect, and without it, of the very same true motion."""
    structure, p, plain, q = with_effect(name, values, variant, streams=streams, **wanted)
    stretch = stretch_of(MOTORS)
    true = states_of(plain, q, stretch)
    return (
        shown(structure, drive(structure, p, stretch), stretch, true.copy()),
        shown(plain, drive(plain, q, stretch), stretch, true.copy()),
    )


def test_a_compass_bias_turns_heading_and_body_velocities():
    wrong, right = shown_states("heading_bias", {"bias": 0.1})
    assert np.allclose(wrong[:, 2] - right[:, 2], 0.1)
    assert np.allclose(wrong[:, :2], right[:, :2])
    north_wrong, north_right = (a[:, 3] * np.cos(a[:, 2]) - a[:, 4] * np.sin(a[:, 2]) for a in (wrong, right))
    assert np.allclose(north_wrong, north_right, atol=1e-12)


def test_a_gyro_has_scale_and_bias():
    wrong, right = shown_states("gyro_bias", {"bias": 0.01, "scale": 1.1})
    assert np.allclose(wrong[:, 5], 1.1 * right[:, 5] + 0.01)
    assert np.allclose(wrong[:, :5], right[:, :5])


def test_an_antenna_elsewhere_moves_the_position_with_the_heading():
    wrong, right = shown_states("antenna_offset", {"x": 0.4, "y": -0.2})
    psi = right[:, 2]
    assert np.allclose(wrong[:, 0] - right[:, 0], 0.4 * np.cos(psi) + 0.2 * np.sin(psi))
    assert np.allclose(wrong[:, 1] - right[:, 1], 0.4 * np.sin(psi) - 0.2 * np.cos(psi))


@pytest.mark.parametrize(
    ("stream", "late"), [("position", (0,)), ("heading", (2, 5)), ("yaw_rate", (5,))]
)  # where no gyro tells the turning, the smoothed rate is the compass' own
def test_a_late_clock_shows_what_was(stream, late):
    streams = ("position", "heading") if stream == "heading" else ("position", "heading", "yaw_rate")
    variant = Variant(options={"stream": stream})
    wrong, right = shown_states("clock_offset", {"offset": 0.2}, variant, streams, input_delay=False)
    assert np.allclose(wrong[2:, late], right[:-2, late], atol=1e-9)
    others = [c for c in (0, 2, 5) if c not in late]
    assert np.allclose(wrong[:, others], right[:, others])


def test_late_input_stamps_are_actuators_ahead_of_the_log():
    variant = Variant(options={"stream": "inputs"})
    structure, p, plain, q = with_effect("clock_offset", {"offset": 0.25}, variant, input_delay=True)
    stretch, shift = stretch_of(MOTORS), round(0.25 / FINE)
    for name in ("left", "right"):
        ahead, logged = actuator_of(structure, p, stretch, name), actuator_of(plain, q, stretch, name)
        assert np.allclose(ahead[:-shift], logged[shift:], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "values", "form", "roles"),
    [
        ("mass_change", {"ratio": 1.25}, {}, {"inertial": 1.0, "hull": 0.8, "thrust": 0.8}),
        ("mass_change", {"ratio": 1.25}, {"form": "whole"}, {"inertial": 0.8, "hull": 0.8, "thrust": 0.8}),
        ("shallow_water", {"factor": 1.5}, {}, {"inertial": 1.0, "hull": 1.5, "thrust": 1.0}),
    ],
)
def test_loading_acts_in_its_logs_alone(name, values, form, roles):
    structure, p, plain, q = with_effect(name, values, Variant(options={"logs": ("b",), **form}))
    stretch = stretch_of(MOTORS)
    same = drive(structure, p, stretch).coefficients
    assert np.array_equal(same, drive(plain, q, stretch).coefficients)
    changed = drive(structure, p, replace(stretch, name="b")).coefficients
    for term, a, b in zip(structure.table.terms, changed, same, strict=True):
        assert a == pytest.approx(roles[term.role] * b)


def test_an_antenna_is_looked_for_within_the_vessels_length_across_it_too():
    """Who takes forward for starboard errs across the vessel by as much as along it; no more is a place for a mast."""
    structure, _, _, _ = with_effect("antenna_offset", {"x": 0.1, "y": 0.0})
    vessel = structure.vessel
    bounds = {s.name: s.parameter.bounds for s in structure.slots if s.effect == 0}
    for k, name in enumerate("xy"):
        low, high = (b + vessel.antenna[k] for b in bounds[name])
        assert low == -high
        assert vessel.length <= high < vessel.length + 1.0


@pytest.mark.parametrize("inputs, ways", [(MOTORS, {None, "left", "right"}), ((RUDDER, PROPELLER), {"n"})])
def test_thrusters_walk_as_propellers_do(inputs, ways):
    every = candidates(structure_of("modulus", inputs))
    assert {a.variant.input for a in every if a.effect.name == "propeller_walk"} == ways
