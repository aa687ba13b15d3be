"""Standard manoeuvres: the rebuilt model, the measures against exact turns, uncertainty, the command."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from identification_samples import BOAT, MOTORS, PROPELLER, RUDDER, structure_of
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from identify.effect import Active
from identify.effects import EFFECTS
from identify.fit import Estimated, Fit
from identify.report_fit import fitted_effect
from identify.simulate import Order, parse_order, rebuild, simulate
from identify.simulate.drawn import draw
from identify.simulate.measures import crossing, imo_limits
from identify.simulate.plant import corners
from identify.structure import null_parameters
from identify.term import unit_of
from ingest.errors import UsageError
from seatrial.cli.app import make_app
from validate.report.model_file import write_model

BLANKE = {
    ("u", "|u|u"): -0.05, ("u", "vr"): 1.2, ("u", "r²"): -0.02, ("u", "|n|n"): 5e-4, ("u", "δ²"): -0.01,
    ("v", "ur"): -0.5, ("v", "uv"): -0.8, ("v", "|v|v"): -2.0, ("v", "δ"): 0.03,
    ("r", "ur"): -2.0, ("r", "uv"): 1.0, ("r", "|v|r"): -0.5, ("r", "δ"): -0.5,
}  # fmt: skip


def fit_of(coefficients, model, inputs, spread=0.0, effects=(), **options):
    own = tuple(
        Estimated(dof, f"{dof} {text}", value, spread * abs(value), unit_of(text, dof), term=text)
        for (dof, text), value in coefficients.items()
    )
    variance = [e.stderr**2 for e in (*own, *(q for f in effects for q in f.parameters))]
    return Fit(
        model, BOAT, inputs, "output_error", "auto", 0, own, tuple(effects), np.diag(variance), 1.0, "", "",
        **options,
    )  # fmt: skip


def blanke(spread=0.0, **options):
    return fit_of(
        BLANKE, "blanke", (RUDDER, PROPELLER), spread, **({"typical_inputs": {"n": 12.0}} | options)
    )


def reference_circle(helm):
    """Advance, transfer, tactical diameter of the same equations by solve_ivp (helm in the log's own sign)."""
    c = BLANKE
    speed = math.sqrt(c["u", "|n|n"] * 144.0 / -c["u", "|u|u"])

    def rhs(_, z):
        psi, u, v, r = z[2:]
        du = c["u", "|u|u"] * abs(u) * u + c["u", "vr"] * v * r + c["u", "r²"] * r * r
        du += c["u", "|n|n"] * 144.0 + c["u", "δ²"] * helm**2
        dv = c["v", "ur"] * u * r + c["v", "uv"] * u * v + c["v", "|v|v"] * abs(v) * v + c["v", "δ"] * helm
        dr = c["r", "ur"] * u * r + c["r", "uv"] * u * v + c["r", "|v|r"] * abs(v) * r + c["r", "δ"] * helm
        return [u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi), r, du, dv, dr]

    done = solve_ivp(rhs, (0, 120), [0, 0, 0, speed, 0, 0], rtol=1e-9, atol=1e-10, dense_output=True)
    t = np.linspace(0, 120, 120_001)
    z = done.sol(t)
    quarter, half = (t[np.argmax(z[2] >= a)] for a in (np.pi / 2, np.pi))
    return done.sol(quarter)[0], done.sol(quarter)[1], done.sol(half)[1], speed


def test_a_turning_circle_is_that_of_the_same_equations():
    found = simulate(blanke(), Order("circle", math.radians(35), samples=0))
    advance, transfer, diameter, speed = reference_circle(
        -math.radians(35)
    )  # this rudder turns to port if positive
    assert found.speed == pytest.approx(speed, rel=1e-6)
    assert found["advance"].value == pytest.approx(advance, rel=1e-3)
    assert found["transfer"].value == pytest.approx(transfer, rel=2e-3)
    assert found["tactical_diameter"].value == pytest.approx(diameter, rel=1e-3)
    assert found["steady_yaw_rate"].value > 0
    assert found.inputs["rudder"][5] == pytest.approx(-math.radians(35))


def test_port_is_the_mirror_of_starboard():
    right, left = (simulate(blanke(), Order("circle", 0.6, side=s, samples=0)) for s in (1, -1))
    assert left["tactical_diameter"].value == pytest.approx(right["tactical_diameter"].value, rel=1e-9)
    assert np.allclose(left.states[:, 1], -right.states[:, 1], atol=1e-9)


def test_a_zigzag_turns_its_helm_when_the_heading_is_reached():
    found = simulate(blanke(), replace(parse_order("zigzag 20/15"), samples=0))
    psi, helm = np.degrees(found.states[:, 2]), -np.degrees(found.inputs["rudder"])
    switches = np.nonzero(np.diff(helm))[0] + 1
    assert set(np.round(np.abs(helm), 6)) == {20.0}
    assert np.allclose(np.abs(psi[switches]), 15.0, atol=0.5)
    assert helm[0] > 0 > helm[switches[0]]
    first = found["first_overshoot"]
    second = psi[
        (found.t > found["first_execute_time"].value) & (found.t < found["second_execute_time"].value)
    ]
    assert math.degrees(first.value) == pytest.approx(second.max() - 15.0, abs=0.05)
    assert found["period"].value > found["second_execute_time"].value - found["first_execute_time"].value


def test_nomoto_follows_its_own_equation():
    gain, time = 0.8, 2.5
    coefficients = {("r", "r"): -1 / time, ("r", "δ"): gain / time}
    fit = fit_of(coefficients, "nomoto1", (RUDDER, PROPELLER))
    found = simulate(fit, Order("circle", 0.3, speed=1.0, samples=0))
    t = found.t
    assert np.allclose(found.states[:, 2], gain * 0.3 * (t - time * (1 - np.exp(-t / time))), atol=1e-6)
    assert np.allclose(found.states[:, 3], 1.0)
    assert any("no surge equation" in n for n in found.notes)
    with pytest.raises(UsageError, match="no surge equation"):
        simulate(fit, "stopping")


def test_a_stop_is_that_of_quadratic_resistance():
    coefficients = {("u", "|u|u"): -0.1, ("u", "|n|n"): 1e-3}
    fit = fit_of(coefficients, "blanke", (RUDDER, PROPELLER), typical_inputs={"n": 10.0})
    found = simulate(fit, Order("stopping", samples=0))
    assert found.speed == pytest.approx(1.0)
    # u̇ = −0.1 u² − 0.1: time arctan(1)/0.1, reach ln(2)/0.2
    assert found["stopping_time"].value == pytest.approx(math.atan(1.0) / 0.1, rel=1e-3)
    assert found["track_reach"].value == pytest.approx(math.log(2.0) / 0.2, rel=1e-3)
    assert found["track_reach"].limit == pytest.approx(15 * BOAT.length)


def test_an_unstable_vessel_shows_a_loop_and_a_stable_one_none():
    loop = {("r", "r"): 0.15, ("r", "r³"): -4.0, ("r", "δ"): 0.1}
    unstable = simulate(
        fit_of(loop, "nomoto_nonlinear", (RUDDER,)), Order("spiral", 0.4, speed=1.0, samples=0)
    )
    assert unstable["loop_height"].value == pytest.approx(2 * math.sqrt(0.15 / 4.0), rel=0.02)
    assert unstable["loop_width"].value > 0.02
    stable = simulate(
        fit_of(loop | {("r", "r"): -0.5}, "nomoto_nonlinear", (RUDDER,)),
        Order("spiral", 0.4, speed=1.0, samples=0),
    )
    assert stable["loop_height"].value < 1e-3
    assert stable["loop_width"].value < 1e-2


def test_uncertainty_is_that_of_the_parameters():
    gain, time = 0.8, 2.5
    coefficients = {("r", "r"): -1 / time, ("r", "δ"): gain / time}
    fit = fit_of(coefficients, "nomoto1", (RUDDER,), spread=0.02)
    found = simulate(fit, Order("circle", 0.3, speed=1.0, samples=300), seed=1)
    rate = found["steady_yaw_rate"]
    expected = gain * 0.3 * math.hypot(0.02, 0.02)  # r = K δ, K a quotient of two with 2 % each
    assert rate.stderr == pytest.approx(expected, rel=0.15)
    assert rate.low < rate.value < rate.high
    assert rate.high - rate.low == pytest.approx(2 * 1.96 * expected, rel=0.2)
    again = simulate(fit, Order("circle", 0.3, speed=1.0, samples=300), seed=1)
    assert again["advance"].stderr == found["advance"].stderr


def test_a_draw_at_its_bound_takes_along_what_it_is_tied_to():
    """Of thrust and constant only the sum is known, and thrust cannot push backwards."""
    rebuilt = rebuild(blanke())
    names = [s.name for s in rebuilt.structure.slots]
    thrust, other = names.index("X_|n|n"), names.index("Y_delta")
    tied = np.zeros_like(rebuilt.covariance)
    size = 3.0 * rebuilt.p[thrust]
    tied[np.ix_([thrust, other], [thrust, other])] = size**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    drawn = draw(replace(rebuilt, covariance=tied), 200, 0)
    assert drawn[:, thrust].min() == 0.0
    assert np.mean(drawn[:, thrust] == 0.0) > 0.2
    total = rebuilt.p[thrust] + rebuilt.p[other]
    assert drawn[:, thrust] + drawn[:, other] == pytest.approx(np.full(200, total), abs=1e-6 * size)


def test_draws_that_fail_are_counted():
    fit = fit_of({("r", "r"): -0.05, ("r", "δ"): 0.4}, "nomoto1", (RUDDER,), spread=6.0)
    found = simulate(fit, Order("circle", 0.3, speed=1.0, samples=60))
    assert 0.1 < found.failed < 0.9
    assert any("draws" in n for n in found.notes)


def test_thrusters_steer_by_their_difference():
    coefficients = {
        ("u", "u"): -0.5, ("u", "T:thruster"): 2.0, ("v", "v"): -1.0, ("v", "ur"): -0.5, ("r", "r"): -1.0,
        ("r", "N:thruster"): 6.0,
    }  # fmt: skip
    fit = fit_of(coefficients, "modulus", MOTORS, typical_inputs={"left": 0.5, "right": 0.5})
    found = simulate(fit, Order("circle", math.radians(35), samples=0))
    assert found["steady_yaw_rate"].value > 0
    assert found.inputs["left"][3] == pytest.approx(1.0)
    assert found.inputs["right"][3] == pytest.approx(0.0)
    assert any("35° to starboard is left 1, right 0 (ahead: left 0.5, right 0.5" in n for n in found.notes)


def test_a_thruster_gives_no_more_than_its_calibration_and_the_command_ahead_is_said():
    coefficients = {("u", "u"): -0.5, ("u", "T:thruster"): 2.0, ("r", "r"): -1.0, ("r", "N:thruster"): 6.0}
    calibrated = tuple(replace(m, pwm=(1100.0, 1500.0, 1900.0), value=(-1.0, 0.0, 1.0)) for m in MOTORS)
    fit = fit_of(coefficients, "modulus", calibrated, typical_inputs={"left": 0.0, "right": 0.0})
    found = simulate(fit, Order("zigzag", math.radians(35) / 2, samples=0))
    assert {found.inputs["left"].max(), found.inputs["right"].max()} == {1.0}
    assert found.inputs["right"][3] == pytest.approx(0.5)
    assert any("No thrust ahead is typical of the logs" in n for n in found.notes)


def test_a_speed_that_is_asked_for_is_held():
    found = simulate(blanke(), Order("zigzag", 0.01, 0.005, speed=0.8, samples=0))
    assert found.states[:20, 3] == pytest.approx(0.8, rel=1e-3)
    nothing = simulate(blanke(typical_inputs={}), "zigzag 10/10")
    assert any("No speed was given" in n for n in nothing.notes)


def test_a_helm_takes_its_time():
    t, helm, _ = corners([(0.0, 0.4, 1.0), (1.0, -0.4, 1.0)], 0.2)
    assert np.interp([0.5, 1.0, 2.0, 2.9, 4.0], t, helm) == pytest.approx(
        [0.1, 0.2, 0.0, -0.18, -0.4], abs=1e-4
    )
    slow = simulate(blanke(), Order("zigzag", samples=0, helm_rate=0.1))
    fast = simulate(blanke(), Order("zigzag", samples=0))
    assert slow["first_overshoot"].value > 1.2 * fast["first_overshoot"].value


def test_a_helm_may_be_late():
    prompt, late = (simulate(blanke(), Order("zigzag", samples=0, helm_delay=s)) for s in (0.0, 0.4))
    assert late["first_execute_time"].value == pytest.approx(prompt["first_execute_time"].value + 0.4)
    assert late["first_overshoot"].value > prompt["first_overshoot"].value
    with pytest.raises(UsageError, match="before it is asked"):
        simulate(blanke(), Order("zigzag", samples=0, helm_delay=-1.0))


CASES = [
    ("current", {"north": 0.1, "east": -0.3}),
    ("wind", {"north": -3.0, "east": 1.0, "cx": 0.01, "cy": 0.02, "cn": -0.01}),
    ("actuator_lag", {"time_constant": 0.7}),
    ("actuator_deadband", {"width": 0.03}),
    ("thrust_fade", {"rate": 1e-4}),
    ("quadratic_damping", {"u": -0.1, "v": -0.5, "r": -0.4}),
    ("clock_offset", {"offset": 0.2}),
    ("mass_change", {"ratio": 1.2}),
    ("roll_coupling", {"frequency": 2.0, "damping": 0.1, "sway": 0.3, "yaw": 0.2}),
]


@pytest.mark.parametrize("which", range(2))
@pytest.mark.parametrize(("name", "values"), CASES)
def test_a_model_with_an_effect_comes_back_as_it_was(name, values, which):
    """Through what is reported and back: the same parameters and the same covariance in the coordinates searched."""
    structure = structure_of("linear", (RUDDER, PROPELLER))
    actives = [
        Active(e, v)
        for e in EFFECTS
        if e.name == name
        for v in e.variants(structure.setting)
        if set(values)
        == {q.name for q in e.parameters} | set(e.terms(structure.setting, v) if e.terms else ())
    ]
    active = actives[which % len(actives)]
    structure = structure.with_effect(active)
    p = null_parameters(structure)
    rng = np.random.default_rng(0)
    for k, slot in enumerate(structure.slots):
        p[k] = values[slot.name] if slot.effect == 0 else rng.uniform(0.1, 1.0)
    root = rng.standard_normal((len(p), len(p))) * 0.01
    covariance = root @ root.T
    effect, jacobian = fitted_effect(structure, p, covariance, 0)
    own = [k for k, s in enumerate(structure.slots) if s.effect < 0]
    rows = np.vstack([np.eye(len(p))[own], jacobian])
    slots = [structure.slots[k] for k in own]
    coefficients = tuple(
        Estimated(s.term.dof, s.name, x, 0.1, "", term=s.term.text)
        for s, x in zip(slots, p[own], strict=True)
    )
    fit = Fit(
        "linear",
        BOAT,
        (RUDDER, PROPELLER),
        "",
        "",
        0,
        coefficients,
        (effect,),
        rows @ covariance @ rows.T,
        1.0,
        "",
        "",
    )
    back = rebuild(fit)
    assert [(s.name, s.effect) for s in back.structure.slots] == [(s.name, s.effect) for s in structure.slots]
    assert back.structure.actives[0].effect is active.effect
    assert back.p == pytest.approx(p, rel=1e-9, abs=1e-12)
    assert np.allclose(back.covariance, covariance, rtol=1e-3, atol=1e-7)


def test_weather_and_sensors_are_left_out_unless_asked_for():
    structure = structure_of("linear", (RUDDER, PROPELLER))
    current = next(e for e in EFFECTS if e.name == "current")
    with_it = structure.with_effect(Active(current))
    p = null_parameters(with_it)
    p[-2:] = 0.0, 0.2
    effect, _ = fitted_effect(with_it, p, np.eye(len(p)) * 1e-6, 0)
    fit = fit_of(BLANKE, "blanke", (RUDDER, PROPELLER), effects=(effect,), typical_inputs={"n": 12.0})
    calm = simulate(fit, Order("circle", 0.6, samples=0))
    kept = simulate(fit, Order("circle", 0.6, samples=0, conditions=True))
    assert any("current" in n for n in calm.notes)
    drift = kept.states[len(calm.t) - 1, 1] - calm.states[-1, 1]
    assert drift == pytest.approx(0.2 * calm.t[-1], rel=0.05)


def test_terms_about_a_speed_need_that_speed():
    coefficients = {("u", "Δu"): -0.2, ("r", "r"): -0.5, ("r", "δU²"): 0.4}
    with pytest.raises(UsageError, match="about which speed"):
        simulate(fit_of(coefficients, "abkowitz", (RUDDER, PROPELLER)), "circle")
    found = simulate(
        fit_of(coefficients, "abkowitz", (RUDDER, PROPELLER), u0=1.1), Order("circle", speed=1.0, samples=0)
    )
    assert found.states[-1, 3] > 1.05


@pytest.mark.parametrize(
    ("text", "kind", "helm", "heading", "side"),
    [
        ("zigzag", "zigzag", 20, 20, 1), ("zigzag 10/5 port", "zigzag", 10, 5, -1),
        ("zigzag10/10", "zigzag", 10, 10, 1),
        ("circle", "circle", 35, 35, 1), ("turning circle 20", "circle", 20, 20, 1), ("stopping", "stopping", 0, 0, 1),
        ("Spiral 15", "spiral", 15, 15, 1),
    ],
)  # fmt: skip
def test_orders_as_people_write_them(text, kind, helm, heading, side):
    order = parse_order(text)
    assert (order.kind, order.side) == (kind, side)
    assert order.helm == pytest.approx(math.radians(helm))
    assert order.heading == pytest.approx(math.radians(heading))


@pytest.mark.parametrize("text", ["zigzg 20/20", "", "circle sixty", "20/20", "zigzag 0/0"])
def test_other_orders_are_refused(text):
    with pytest.raises(UsageError, match="manoeuvre"):
        simulate(blanke(), text)


def test_a_vessel_without_a_helm_cannot_turn():
    fit = fit_of({("u", "|u|u"): -0.1, ("u", "|n|n"): 1e-3}, "blanke", (PROPELLER,))
    with pytest.raises(UsageError, match="steers"):
        simulate(fit, "circle")


def test_limits_of_imo():
    assert imo_limits("circle", math.radians(35), 100.0, 8.0) == {
        "advance": 450.0,
        "tactical_diameter": 500.0,
    }
    small = imo_limits("zigzag", math.radians(10), 100.0, 5.0)  # L/V = 20 s
    assert math.degrees(small["first_overshoot"]) == pytest.approx(15.0)
    assert math.degrees(small["second_overshoot"]) == pytest.approx(32.5)
    assert imo_limits("spiral", 0.4, 100.0, 5.0) == {}


def test_crossings_are_interpolated():
    t = np.arange(5.0)
    assert crossing(t, np.array([0, 1, 3, 2, 5.0]), 2.0) == pytest.approx(1.5)
    assert crossing(t, np.array([0, 1, 3, 1, 5.0]), 2.0, after=2.5) == pytest.approx(3.25)
    assert math.isnan(crossing(t, np.zeros(5), 1.0))


def test_the_command_prints_and_draws(tmp_path):
    model = tmp_path / "model.json"
    write_model(blanke(spread=0.01), model)
    shown = CliRunner().invoke(
        make_app(), ["simulate", str(model), "circle 35", "--samples", "20", "--out", str(tmp_path / "a.svg")]
    )
    assert shown.exit_code == 0, shown.output
    assert "tactical diameter" in shown.output
    assert (tmp_path / "a.svg").stat().st_size > 1000
    data = CliRunner().invoke(
        make_app(), ["simulate", str(model), "zigzag 20/20", "--samples", "20", "--speed", "1", "--json"]
    )
    (found,) = json.loads(data.output)
    overshoot = next(m for m in found["measures"] if m["name"] == "first_overshoot")
    assert overshoot["unit"] == "rad"
    assert overshoot["low"] < overshoot["value"] < overshoot["high"]


def test_the_public_function_is_a_function():
    import seatrial

    assert seatrial.simulate is simulate
