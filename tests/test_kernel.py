"""The compiled rollout: against scipy, its sensitivities against differences, a population against single runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import MOTORS, PROPELLER, RUDDER, structure_of
from numba import njit
from scipy.integrate import solve_ivp

from identify import kernel, tangents
from identify.aligned import LINE, places, zeros
from identify.angles import cosine_and_sine
from identify.compiled import along_of
from identify.directions import directions
from identify.drive import drive
from identify.effect import Active, Variant
from identify.effects import ACTUATOR_LAG, CURRENT, EFFECTS, ROLL_COUPLING, THRUST_FADE, WIND_UNSEEN
from identify.flow import PARAMETERS
from identify.lanes import Compared, Driven, misfits_in_lanes, population_in_lanes
from identify.models import MODELS
from identify.predict import run
from identify.simd import load, store
from identify.stretch import Samples, Stretch
from identify.tangents import padded, run_for
from identify.term import factors_of
from preprocess.trial import Measurement

STEPS, STEP = 60, 0.1
NOTHING = Samples(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 2)), np.zeros(0))


def stretch_of(inputs, seed=0):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, STEPS * STEP, 0.25)
    size = {"rudder": 0.4, "propeller": 6.0, "thruster": 0.7}
    logged = {
        i.name: Measurement(
            i.name,
            t,
            size[i.kind] * (0.3 + rng.uniform(-1, 1, len(t))),
            0.0,
            np.ones(len(t), bool),
            held=True,
        )
        for i in inputs
    }
    wind = rng.normal(0, 2.0, (STEPS, 2))
    return Stretch(
        "a",
        "identify",
        0.0,
        5.0,
        STEP,
        STEPS,
        logged,
        np.zeros((STEPS + 1, 6)),
        np.zeros((STEPS + 1, 3)),
        wind,
        NOTHING,
    )


def parameters_of(structure, seed=1):
    """Coefficients that keep the vessel in range: damping, and a little of everything else."""
    rng = np.random.default_rng(seed)
    p = np.array(
        [s.parameter.null if s.coefficient < 0 else 0.05 * rng.standard_normal() for s in structure.slots]
    )
    for k, slot in enumerate(structure.slots):
        if slot.term is not None and slot.term.text in ("u", "v", "r", "Δu"):
            p[k] = -0.6
        elif slot.parameter.bounds[0] == 0.0 and slot.term is not None:
            p[k] = 0.02
    return p


FIRST = np.array([1.0, -2.0, 0.7, 0.9, 0.1, -0.15, 0.02, -0.01])


def sensitivities(structure, p, stretch, first):
    """States, and their derivatives along the first state and all parameters, as the compiled code carries them."""
    table, d = structure.table, drive(structure, p, stretch)
    along, _ = along_of(structure, directions(structure, p, stretch, d), d)
    found = run_for(table.tape, STEPS, padded(kernel.NX + len(p) + 1), d.channels.shape[1])
    done = tangents.sensitivities(
        first, 0, STEPS, STEP, structure.model.discrete, d.channels, d.slopes, d.wind, d.current, structure.u0,
        table.tape.steps, table.tape.rows(d.coefficients), along, found,
    )  # fmt: skip
    assert done == STEPS
    return found.states, found.s[:, :, : kernel.NX + len(p)]


def final(structure, p, stretch, first):
    return run(structure, drive(structure, p, stretch), stretch, first)[-1]


def differences(structure, p, stretch, first):
    """Derivatives of the last state by central differences, along the kernel's directions."""
    columns = []
    for j in range(8):
        step = np.zeros(8)
        step[j] = 1e-6
        columns.append(
            (final(structure, p, stretch, first + step) - final(structure, p, stretch, first - step)) / 2e-6
        )
    for k in range(len(p)):
        # as far as a drive's own differences go: within a sub-step the thrust of a switch is not linear in its time
        size = 1e-6 if structure.slots[k].coefficient >= 0 else 0.02 * structure.slots[k].parameter.scale
        up, down = p.copy(), p.copy()
        up[k] += size
        down[k] -= size
        columns.append(
            (final(structure, up, stretch, first) - final(structure, down, stretch, first)) / (2 * size)
        )
    return np.column_stack(columns)


def assert_same_slopes(structure, p, stretch, first, tolerance=2e-5):
    states, s = sensitivities(structure, p, stretch, first)
    assert np.allclose(states[-1], final(structure, p, stretch, first), atol=1e-12)
    expected = differences(structure, p, stretch, first)
    scale = np.abs(expected).max(axis=0) + 1e-6
    assert np.max(np.abs(s[-1] - expected) / scale) < tolerance


@pytest.mark.parametrize("model", [m.name for m in MODELS])
def test_sensitivities_are_those_of_the_scheme_for_every_model(model):
    structure = structure_of(model)
    first = FIRST.copy()
    if not any(t.dof in ("e1", "e2") for t in structure.table.terms):
        first[6:] = 0.0
    assert_same_slopes(structure, parameters_of(structure), stretch_of((RUDDER, PROPELLER)), first)


MOVING = {
    "current": ((Active(CURRENT), {"north": 0.2, "east": -0.1}),),
    "wind": ((Active(WIND_UNSEEN), {"north": 3.0, "east": 2.0, "cx": 0.01, "cy": 0.02, "cn": -0.01}),),
    "wind in a current": (
        (Active(WIND_UNSEEN), {"north": 3.0, "east": 2.0, "cx": 0.01, "cy": 0.02, "cn": -0.01}),
        (Active(CURRENT), {"north": 0.2, "east": -0.1}),
    ),
    "lag": ((Active(ACTUATOR_LAG, Variant("left")), {"time_constant": 0.6}),),
    "fade": ((Active(THRUST_FADE), {"rate": 2e-3}),),
    "roll": ((Active(ROLL_COUPLING), {"frequency": 2.0, "damping": 0.2, "sway": 0.5, "yaw": -0.3}),),
    "delay": (
        (Active(next(e for e in EFFECTS if e.name == "actuator_delay"), Variant("right")), {"delay": 0.37}),
    ),
    "asymmetry": (
        (Active(next(e for e in EFFECTS if e.name == "thrust_asymmetry"), Variant("left")), {"ratio": 0.8}),
    ),
}


@pytest.mark.parametrize("what", MOVING)
def test_sensitivities_along_channels_current_wind_and_states_of_their_own(what):
    structure = structure_of("modulus", MOTORS)
    for active, _ in MOVING[what]:
        structure = structure.with_effect(active)
    p = parameters_of(structure)
    for e, (_, values) in enumerate(MOVING[what]):
        for k, slot in enumerate(structure.slots):
            if slot.effect == e and slot.name in values:
                p[k] = values[slot.name]
    assert_same_slopes(structure, p, stretch_of(MOTORS), FIRST, tolerance=2e-3)


def paper_flow(structure, at):
    """Thrust and rudder force per mass as Yasukawa and Yoshimura 2015 write them (eqs. 12-27)."""
    vessel = structure.vessel
    screw, rudder, length = vessel.propeller, vessel.rudder, vessel.length
    d, area, aspect = screw["diameter"], rudder["area"], rudder["height"] ** 2 / rudder["area"]
    speed = np.hypot(at["u"], at["v"])
    beta, turn = np.arctan2(-at["v"], at["u"]), at["r"] * length / speed
    beta_p, beta_r = beta + 0.48 * turn, beta - at["=l_R"] * turn
    c2 = at["=C_2plus"] if beta_p > 0 else at["=C_2minus"]
    wake = 1 - (1 - at["=w_P0"]) * (1 + (1 - np.exp(-2.0 * abs(beta_p))) * (c2 - 1))
    n, delta = at["n"], at["δ"]
    advance = at["u"] * (1 - wake) / (n * d)
    k_t = screw["k0"] + screw["k1"] * advance + screw["k2"] * advance**2
    eta, kappa = d / rudder["height"], at["=kappa"]
    race = 1 + kappa * (np.sqrt(1 + 8 * k_t / (np.pi * advance**2)) - 1)
    u_r = at["=epsilon"] * at["u"] * (1 - wake) * np.sqrt(eta * race**2 + 1 - eta)
    v_r = speed * (at["=gamma_Rplus"] if beta_r > 0 else at["=gamma_Rminus"]) * beta_r
    lift = 6.13 * aspect / (2.25 + aspect)
    normal = 500.0 * area * (u_r**2 + v_r**2) * lift * np.sin(delta - np.arctan2(v_r, u_r)) / vessel.mass
    thrust = 1000.0 * n**2 * d**4 * k_t / vessel.mass
    return {"T_P": thrust, "F_Nsinδ": normal * np.sin(delta), "F_Ncosδ": normal * np.cos(delta)}


def plain_derivative(structure, p, z, channels, wind, current):
    """The model's derivative written out term by term, with nothing compiled: what everything else is held against."""
    _, _, psi, u, v, r, e1, e2 = z
    c, s = np.cos(psi), np.sin(psi)
    wn, we = wind - current
    wx, wy = wn * c + we * s - u, -wn * s + we * c - v
    air, speed = np.hypot(wx, wy), np.hypot(u, v)
    values = {
        "1": 1.0, "u": u, "v": v, "r": r, "|u|": abs(u), "|v|": abs(v), "|r|": abs(r), "U": speed,
        "Δu": u - structure.u0, "/U": 1.0 / max(speed, 1e-3), "e1": e1, "e2": e2, "Vwx": air * wx, "Vwy": air * wy,
    } | dict(zip(structure.table.channels, channels, strict=True))  # fmt: skip
    if structure.model.flow:
        values |= paper_flow(structure, values)
    f = dict.fromkeys(("u", "v", "r", "e1", "e2"), 0.0)
    for term, coefficient in zip(structure.table.terms, p, strict=True):
        f[term.dof] += coefficient * np.prod([values[x] for x in factors_of(term.text)])
    return np.array([u * c - v * s + current[0], u * s + v * c + current[1], r, *f.values()])


@pytest.mark.parametrize("model", [m.name for m in MODELS])
def test_compiled_accelerations_are_those_of_the_terms(model):
    structure = structure_of(model).with_effect(Active(WIND_UNSEEN)).with_effect(Active(ROLL_COUPLING))
    table, rng = structure.table, np.random.default_rng(3)
    current, wind = np.array([0.1, -0.2]), np.array([3.0, 2.0])
    for z in rng.standard_normal((5, 8)):
        coefficients, channels = (
            rng.standard_normal(len(table.terms)),
            rng.standard_normal(len(table.channels)),
        )
        if structure.model.flow:  # ahead, and the race faster than the ship
            own = {q.name: q for q in PARAMETERS}
            usual = [own[c[1:]].usual if c[1:] in own else 0.0 for c in table.channels]
            z[3], channels = 0.5 + abs(z[3]), np.array(usual) + 0.05 * channels
            channels[table.channels.index("n")] = 60.0
        found = kernel.accelerations_at(table.tape, z, channels, wind, current, structure.u0, coefficients)
        expected = plain_derivative(structure, coefficients, z, channels, wind, current)
        assert np.allclose(found, expected[3:], rtol=1e-12, atol=1e-12)


def test_a_rollout_is_that_of_solve_ivp():
    structure = structure_of("cybership2")
    p, stretch = parameters_of(structure), stretch_of((RUDDER, PROPELLER))
    d = drive(structure, p, stretch)
    first = FIRST.copy()
    first[6:] = 0.0
    z, still = first.copy(), np.zeros(2)
    for k in range(STEPS):  # step by step: an input jumps where a step ends

        def rhs(t, z, k=k):
            channels = d.channels[k] + (2.0 * t / STEP - 1.0) * d.slopes[k]
            return plain_derivative(structure, d.coefficients, z, channels, d.wind[k], still)

        z = solve_ivp(rhs, (0.0, STEP), z, rtol=1e-9, atol=1e-11).y[:, -1]
    assert np.allclose(final(structure, p, stretch, first), z, atol=2e-6)


def test_an_independent_right_hand_side_gives_the_same_derivative():
    structure = structure_of("blanke")
    p = np.random.default_rng(4).standard_normal(len(structure.slots))
    u, v, r, delta, n = 1.1, -0.2, 0.3, 0.25, 5.0
    own = {s.name: x for s, x in zip(structure.slots, p, strict=True)}
    names = structure.table.channels
    values = {"δ": delta, "|δ|": delta, "|n|n": n * n, "|n|": n, "−": -1.0}
    row = np.array([values.get(c, 0.0) for c in names])
    z = np.array([0, 0, 0.4, u, v, r, 0, 0])
    f, current = np.empty(8), np.array([0.1, -0.2])
    tape = structure.table.tape
    kernel.derivative(
        z, 0, 0.0, row[None], np.zeros((1, len(row))), np.zeros(2), current, 0.0, tape.steps, tape.rows(p),
        kernel.scratch_for(tape, 1), f,
    )  # fmt: skip
    surge = own["X_|u|u"] * u * u + own["X_vr"] * v * r + own["X_r2"] * r * r + own["X_|n|n"] * n * n
    assert f[3] == pytest.approx(surge + own["X_delta2"] * delta**2 + own["X_1"])
    for letter, place in (("Y", 4), ("N", 5)):
        side = own[f"{letter}_ur"] * u * r + own[f"{letter}_uv"] * u * v + own[f"{letter}_|v|v"] * abs(v) * v
        side += own[f"{letter}_|v|r"] * abs(v) * r + own[f"{letter}_delta"] * delta + own[f"{letter}_1"]
        assert f[place] == pytest.approx(side)
    assert f[0] == pytest.approx(u * np.cos(0.4) - v * np.sin(0.4) + 0.1)
    assert f[1] == pytest.approx(u * np.sin(0.4) + v * np.cos(0.4) - 0.2)
    assert f[2] == r


def test_a_discrete_model_takes_explicit_euler_steps():
    structure = structure_of("zhao2021")
    p, stretch = parameters_of(structure), stretch_of((RUDDER, PROPELLER))
    d, z = drive(structure, p, stretch), FIRST.copy()
    z[6:] = 0.0
    states = run(structure, d, stretch, z)
    for k in range(STEPS):
        z = z + STEP * plain_derivative(structure, d.coefficients, z, d.channels[k], d.wind[k], np.zeros(2))
    assert np.allclose(states[-1], z, atol=1e-12)


@pytest.mark.parametrize("model", [m.name for m in MODELS])
def test_lanes_equal_single_runs(model):
    structure = structure_of(model)
    stretch = stretch_of((RUDDER, PROPELLER))
    members = np.array([parameters_of(structure, seed) for seed in range(11)])
    d = drive(structure, members[0], stretch)
    rows = np.array([drive(structure, m, stretch).coefficients for m in members])
    current, wind = np.array([0.2, -0.1]), stretch.wind
    driven = Driven(FIRST, STEP, structure.model.discrete, d.channels, d.slopes, wind, current, structure.u0)
    found = population_in_lanes(structure.table.tape, driven, rows, workers=2)
    measured, weight = found[3, :, 3:6].copy(), np.array([2.0, 3.0, 5.0])
    compared = Compared(measured, weight, 4.0)
    misfits = misfits_in_lanes(structure.table.tape, driven, rows, compared)
    with np.errstate(invalid="ignore"):
        error = np.minimum(np.nan_to_num(np.abs((found[:, :, 3:6] - measured) * weight), nan=4.0), 4.0)
    assert misfits == pytest.approx(np.sum(error**2, axis=(1, 2)), rel=1e-9)
    assert misfits[3] < 1e-12
    for coefficients, states in zip(rows, found, strict=True):
        alone = run(structure, replace(d, coefficients=coefficients, current=current), stretch, FIRST)
        good = np.isfinite(alone).all(axis=1)
        assert good[:5].all()
        assert np.allclose(states[good], alone[good], rtol=1e-9, atol=1e-9)
        assert not (np.abs(states[~good][:, 3:]).max(axis=1) < 1e3).any()


def test_a_tape_forms_each_product_once():
    table = structure_of("cybership2").table
    tape = table.tape
    distinct = {tuple(sorted(row[row > 0])) for row in table.product}
    assert len(tape.value) == len(table.terms) == 27
    assert len(set(tape.value.tolist())) == len(distinct)
    assert len(tape.steps.left) < len(table.terms)


@pytest.mark.parametrize("turns", [1.0, 300.0])
def test_cosine_and_sine_of_many_angles(turns):
    angles = turns * np.linspace(-7.0, 7.0, 4096)
    cosine, sine = both = np.empty((2, len(angles)))
    cosines_and_sines(angles, *both)
    assert np.abs(cosine - np.cos(angles)).max() < 1e-15 + 1e-16 * turns
    assert np.abs(sine - np.sin(angles)).max() < 1e-15 + 1e-16 * turns


@njit
def cosines_and_sines(angles, cosine, sine):
    for k in range(0, len(angles), 8):
        c, s = cosine_and_sine(load(angles, k))
        store(cosine, k, c)
        store(sine, k, s)


def test_a_run_that_runs_away_says_where():
    structure = structure_of("linear", MOTORS)
    p = np.zeros(len(structure.slots))
    p[next(k for k, s in enumerate(structure.slots) if s.name == "X_u")] = 5.0
    states = run(structure, drive(structure, p, stretch_of(MOTORS)), stretch_of(MOTORS), FIRST)
    assert np.isfinite(states[0]).all()
    assert np.isnan(states[-1]).all()


def test_nothing_is_compiled_again_for_another_model():
    compiled = (kernel.rollout, kernel.derivative, tangents.sensitivities)

    def used():
        return [len(f.signatures) for f in compiled]

    stretch, before = stretch_of((RUDDER, PROPELLER)), None
    for model in [m.name for m in MODELS]:
        structure = structure_of(model)
        p, first = parameters_of(structure), FIRST.copy()
        first[6:] = 0.0
        sensitivities(structure, p, stretch, first)
        final(structure, p, stretch, first)
        before = before or used()
        assert used() == before, model


def test_places_to_work_in_begin_at_a_cache_line():
    for count in range(1, 20):
        found = zeros(count, 3)
        assert found.ctypes.data % LINE == 0
        assert found.shape == (count, 3)
        assert not found.any()


def test_places_in_one_piece_begin_at_cache_lines_and_do_not_share():
    shapes = [(3, 5), (0, 8), (7,), (2, 8, 8)]
    found = places(*shapes)
    assert [x.shape for x in found] == shapes
    assert all(x.ctypes.data % LINE == 0 for x in found if x.size)
    for k, x in enumerate(found, start=1):
        x[...] = k
    assert all((x == k).all() for k, x in enumerate(found, start=1))
