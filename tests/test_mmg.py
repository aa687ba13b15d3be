"""The model ``mmg`` on manoeuvres of KVLCC2 simulated apart from the program: parameters, limits, particulars."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest

from benchmarks.papers.kvlcc2 import REVOLUTIONS, RUDDER_RATE, SPEED, accelerations
from identify import flow, flow_behind
from identify.free_running import free_running_misfit
from identify.mmg import inertia_of
from identify.physical import physical
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.report_fit import make_fit
from identify.simulate.rebuild import rebuild
from ingest.errors import UsageError
from preprocess.trial import Measurement, Trial
from preprocess.vessel import Input, Vessel

UNIT = 0.5 * 1000.0 * 7.0**2 * 0.46
TANKER = Vessel(
    "KVLCC2", 7.0, 1.27, draught=0.46, mass=3270.0, yaw_inertia=3270.0 * 1.75**2, centre_of_gravity=(0.25, 0.0),
    added_mass=(0.022 * UNIT, 0.223 * UNIT, 0.011 * UNIT * 49.0),
    propeller={"diameter": 0.216, "k0": 0.2931, "k1": -0.2753, "k2": -0.1385},
    rudder={"area": 0.0539, "height": 0.345, "eta": 0.626, "lift_slope": 2.747},
)  # fmt: skip
INPUTS = (Input("rudder", "rudder", position=(-3.5, 0.0)), Input("n", "propeller", position=(-3.4, 0.0)))

#: Yasukawa and Yoshimura 2015, tables 3 and 4, for the model of 7 m.
PUBLISHED = {
    "R_0'": 0.022, "X_vv'": -0.040, "X_vr'": 0.002, "X_rr'": 0.011, "X_vvvv'": 0.771, "Y_v'": -0.315, "Y_R'": 0.083,
    "Y_vvv'": -1.607, "Y_vvr'": 0.379, "Y_vrr'": -0.391, "Y_rrr'": 0.008, "N_v'": -0.137, "N_R'": -0.049,
    "N_vvv'": -0.030, "N_vvr'": -0.294, "N_vrr'": 0.055, "N_rrr'": -0.013, "t_P": 0.220, "t_R": 0.387, "a_H": 0.312,
    "x_H'": -0.464,
}  # fmt: skip
FLOW = {
    "w_P0": 0.35, "C_2plus": 1.6, "C_2minus": 1.1, "epsilon": 1.09, "kappa": 0.5, "gamma_Rplus": 0.640,
    "gamma_Rminus": 0.395, "l_R": -0.710,
}  # fmt: skip


def zigzag(angle_deg):
    angle = np.radians(angle_deg)

    def order(t, heading, before):
        return -angle if heading > angle else (angle if heading < -angle or t == 0 else before)

    return order


def circle(angle_deg):
    return lambda t, heading, before: np.radians(angle_deg) if t > 3.0 else 0.0


def steady(t):
    return REVOLUTIONS


def stepped(t):
    return REVOLUTIONS * (1.0 + 0.15 * np.sign(np.sin(2.0 * np.pi * t / 60.0)))


def sailed(order, revolutions, duration, h=0.05):
    """Times, states (n, 6), rudder and revolutions (n, 2) of a manoeuvre, by the fourth-order rule."""

    def rates(x, delta, n):
        c, s = np.cos(x[2]), np.sin(x[2])
        forces = accelerations(x[3], x[4], x[5], delta, n)
        return np.array([x[3] * c - x[4] * s, x[3] * s + x[4] * c, x[5], *forces])

    t = h * np.arange(round(duration / h) + 1)
    states, inputs = np.empty((len(t), 6)), np.empty((len(t), 2))
    x, delta, wanted = np.array([0.0, 0.0, 0.0, SPEED, 0.0, 0.0]), 0.0, 0.0
    for k, now in enumerate(t):
        states[k], inputs[k] = x, (delta, revolutions(now))
        wanted = order(now, x[2], wanted)
        after = min(max(wanted, delta - RUDDER_RATE * h), delta + RUDDER_RATE * h)
        n0, n1, middle = revolutions(now), revolutions(now + h), 0.5 * (delta + after)
        k1 = rates(x, delta, n0)
        k2 = rates(x + h / 2 * k1, middle, 0.5 * (n0 + n1))
        k3 = rates(x + h / 2 * k2, middle, 0.5 * (n0 + n1))
        x, delta = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(x + h * k3, after, n1)), after
    return t, states, inputs


def trial(name, role, order, revolutions, duration, seed, sign=1.0):
    t, states, inputs = sailed(order, revolutions, duration)
    rng, seen = np.random.default_rng(seed), slice(None, None, 2)
    at, truth = t[seen], states[seen]

    def measured(stream, value, sigma):
        noisy = value + sigma * rng.standard_normal(value.shape)
        return Measurement(stream, at, noisy, sigma, np.ones(len(at), bool), sample_time=0.1)

    measurements = {
        "position": measured("position", truth[:, :2], 0.01),
        "heading": measured("heading", truth[:, 2], 0.002),
        "yaw_rate": measured("yaw_rate", truth[:, 5], 0.0005),
    }
    columns = {"t": at}
    noise = {"x": 0.005, "y": 0.005, "psi": 0.001, "u": 0.003, "v": 0.003, "r": 0.0003}
    for j, (column, sigma) in enumerate(noise.items()):
        columns[column] = truth[:, j] + sigma * rng.standard_normal(len(at))
        columns[f"sigma_{column}"] = np.full(len(at), sigma)
    logged = {
        i.name: Measurement(i.name, t, f * inputs[:, k], 0.0, np.ones(len(t), bool), sample_time=0.01)
        for k, (i, f) in enumerate(zip(INPUTS, (sign, 1.0), strict=True))
    }
    span = ((0.0, float(at[-1])),)
    return Trial(name, role, TANKER, INPUTS, measurements, logged, pd.DataFrame(columns), span, 0.0)


MANOEUVRES = (
    ("zigzag 10", "identify", zigzag(10), steady, 200.0), ("zigzag 20", "identify", zigzag(20), stepped, 200.0),
    ("zigzag 30", "identify", zigzag(30), steady, 200.0), ("circle 35", "identify", circle(35), stepped, 200.0),
    ("circle -35", "identify", circle(-35), stepped, 200.0), ("circle -15", "identify", circle(-15), steady, 150.0),
    ("zigzag 25", "validate", zigzag(25), steady, 200.0),
)  # fmt: skip


@cache
def fitted():
    prepared = prepare([trial(*m, seed) for seed, m in enumerate(MANOEUVRES)], "mmg")
    found = fit_declared(prepared)
    return prepared, found, make_fit(prepared, found, estimator="output_error", optimiser="x", seed=0)


def test_the_published_derivatives_come_back_within_their_errors():
    _, found, fit = fitted()
    own = {d.name: d for d in physical(fit)}
    assert found.chi2_per_dof == pytest.approx(1.0, abs=0.03)
    assert own.keys() == PUBLISHED.keys()
    z = np.array([(own[n].value - v) / own[n].stderr for n, v in PUBLISHED.items()])
    assert np.abs(z).max() < 3.5
    assert np.sqrt(np.mean(z**2)) < 1.6
    for name, share in {
        "R_0'": 0.02,
        "Y_v'": 0.03,
        "N_v'": 0.02,
        "N_R'": 0.02,
        "t_P": 0.02,
        "x_H'": 0.1,
    }.items():
        assert own[name].value == pytest.approx(PUBLISHED[name], rel=share), name


def test_the_flow_behind_the_hull_comes_back_where_the_data_can_give_it():
    _, _, fit = fitted()
    own = {c.name: c for c in fit.coefficients if not c.dof}
    assert own.keys() == FLOW.keys()
    for name, value in FLOW.items():
        assert abs(own[name].value - value) < 3.5 * own[name].stderr, name
    assert {n for n, c in own.items() if not c.identifiable} == {
        "epsilon"
    }  # shared with the rudder's own gains
    assert "beforehand" in own["epsilon"].reason
    assert own["kappa"].stderr < 0.01


def test_the_report_says_what_the_data_cannot_give():
    _, _, fit = fitted()
    said = " ".join(fit.notes)
    assert "R_0' = 0.02" in said
    assert "not from these data: epsilon." in said
    assert "Standard errors above half of the value" in said


def test_an_unseen_zigzag_is_predicted():
    prepared, found, _ = fitted()
    unseen = replace(found, problem=replace(found.problem, stretches=prepared.validate))
    assert free_running_misfit(unseen) < 1e-3


def test_a_fit_is_rebuilt_with_its_flow():
    _, found, fit = fitted()
    again = rebuild(fit)
    n = len(fit.coefficients)
    assert [s.name for s in again.structure.slots] == [s.name for s in found.solution.structure.slots][:n]
    assert np.array_equal(again.p, found.solution.p[:n])
    assert again.structure.model.fixed == found.solution.structure.model.fixed


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sense_of_the_rudder_is_that_of_the_log(sign):
    log = trial("a", "identify", zigzag(20), steady, 60.0, 0, sign)
    assert prepare([log], "mmg").structure.vessel.rudder["sign"] == sign


def test_missing_particulars_are_all_named():
    log = trial("a", "identify", zigzag(20), steady, 10.0, 0)
    bare = replace(TANKER, mass=None, propeller={"diameter": 0.2}, rudder={})
    with pytest.raises(UsageError) as caught:
        prepare([replace(log, vessel=bare)], "mmg")
    for part in ("[vessel] mass", "[vessel.propeller] k0", "[vessel.rudder] area", "[vessel.rudder] height"):
        assert part in str(caught.value)
    assert "diameter," not in str(caught.value).split(": ")[1]


def test_a_particular_that_is_not_known_is_an_error():
    with pytest.raises(UsageError, match=r"\[vessel.rudder\] hight is not known; there are height"):
        flow.constants_of(replace(TANKER, rudder={**TANKER.rudder, "hight": 1.0}), INPUTS)


def test_added_masses_by_regression_are_near_the_published_ones():
    usual = inertia_of(replace(TANKER, added_mass=None))
    own = inertia_of(TANKER)
    assert usual.m_y == pytest.approx(own.m_y, rel=0.2)
    assert usual.i_z == pytest.approx(own.i_z, rel=0.1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_derivatives_of_the_flow_are_exact(sign):
    constants = flow.constants_of(replace(TANKER, rudder={**TANKER.rudder, "sign": sign}), INPUTS)
    place, at = np.arange(4, 4 + flow.PLACES).astype(np.uint64), 4 + flow.PLACES
    rng = np.random.default_rng(0)

    def results(q):
        full = np.concatenate([q, np.zeros(flow.ROOM)])
        flow_behind.flow(full, place, constants, at)
        return full[at:].reshape(3, flow.COLUMNS)

    for _ in range(50):
        state = [1.0, rng.uniform(0.3, 1.5), rng.normal(0, 0.2), rng.normal(0, 0.1)]
        q = np.array([*state, rng.normal(0, 0.4), rng.uniform(5, 15), *FLOW.values()])
        found = results(q)[:, 1:]
        for column, j in enumerate((1, 2, 3, *range(4, 4 + flow.PLACES))):
            step = np.zeros(len(q))
            step[j] = 1e-6
            slope = (results(q + step)[:, 0] - results(q - step)[:, 0]) / 2e-6
            assert np.allclose(found[:, column], slope, rtol=1e-5, atol=1e-7)
