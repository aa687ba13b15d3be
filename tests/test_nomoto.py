"""K and T of the three Nomoto models, from simulated zigzags in which the vessel also drifts and loses speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from identify.base_fit import fit_from_scratch
from identify.drive import drive
from identify.free_running import free_running_misfit
from identify.physical import physical
from identify.predict import relative_errors, run, true_first_state
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.report_fit import make_fit
from identify.structure import null_parameters
from preprocess.trial import Measurement, Trial
from preprocess.vessel import Input, Vessel
from validate.candidates import candidates

RUDDER = Input("rudder", "rudder", position=(-1.5, 0.0))
STEP, WITHIN, GEAR = 0.02, 20, np.radians(20.0)

TRUTH = {
    "nomoto1": {"T": 3.0, "K": 0.5},
    "nomoto2": {"T_1": 6.0, "T_2": 0.8, "T_3": 1.5, "K": 0.4},
    "nomoto_nonlinear": {"T": 3.0, "K": 0.5, "n_3": 2.0},
}
BIAS = 0.01


def turning(model, r, e, delta, rate):
    """Rate of turn's acceleration, and that of the second state of the second-order model."""
    own = TRUTH[model]
    if model == "nomoto2":
        product, total = own["T_1"] * own["T_2"], own["T_1"] + own["T_2"]
        return e, (own["K"] * (delta + own["T_3"] * rate) - r - total * e) / product
    bias = BIAS if model == "nomoto_nonlinear" else 0.0
    return (own["K"] * delta - r - own.get("n_3", 0.0) * r**3 + bias) / own["T"], 0.0


def zigzag(model, angle_deg, duration):
    """Times, states (n, 6) and rudder (n,): yaw by the model, speed and drift by what no Nomoto model knows."""
    angle, wanted = np.radians(angle_deg), np.radians(angle_deg)
    n, g = round(duration / STEP) + 1, STEP / WITHIN
    rows = np.empty((n, 7))
    x = y = psi = r = e = delta = 0.0
    u = 1.5
    for k in range(n):
        v = -0.6 * r
        rows[k] = x, y, psi, u, v, r, delta
        wanted = -angle if psi > angle else (angle if psi < -angle else wanted)
        rate = np.clip(wanted - delta, -GEAR * STEP, GEAR * STEP) / STEP
        for _ in range(WITHIN):
            a, b = turning(model, r, e, delta + 0.5 * g * rate, rate)
            c, d = turning(model, r + 0.5 * g * a, e + 0.5 * g * b, delta + 0.5 * g * rate, rate)
            psi, delta = psi + g * (r + 0.5 * g * a), delta + g * rate
            r, e, u = r + g * c, e + g * d, u + g * (0.3 * (1.5 - u) - 2.0 * r * r)
        x, y = x + STEP * (u * np.cos(psi) - v * np.sin(psi)), y + STEP * (u * np.sin(psi) + v * np.cos(psi))
    return STEP * np.arange(n), rows[:, :6], rows[:, 6]


def trial(model, angle_deg, seed):
    t, truth, rudder = zigzag(model, angle_deg, 120.0)
    rng, seen = np.random.default_rng(seed), slice(None, None, 5)
    at, truth = t[seen], truth[seen]

    def measured(stream, value, sigma):
        noisy = value + sigma * rng.standard_normal(value.shape)
        return Measurement(stream, at, noisy, sigma, np.ones(len(at), bool), sample_time=0.1)

    measurements = {
        "position": measured("position", truth[:, :2], 0.02), "heading": measured("heading", truth[:, 2], 0.004),
        "yaw_rate": measured("yaw_rate", truth[:, 5], 0.002),
    }  # fmt: skip
    columns = {"t": at}
    noise = {"x": 0.01, "y": 0.01, "psi": 0.002, "u": 0.01, "v": 0.01, "r": 0.001}
    for j, (column, sigma) in enumerate(noise.items()):
        columns[column] = truth[:, j] + sigma * rng.standard_normal(len(at))
        columns[f"sigma_{column}"] = np.full(len(at), sigma)
    logged = {"rudder": Measurement("rudder", t, rudder, 0.0, np.ones(len(t), bool), sample_time=0.01)}
    vessel, span = Vessel("boat", 3.0, 0.8), ((0.0, float(at[-1])),)
    return Trial("a", "identify", vessel, (RUDDER,), measurements, logged, pd.DataFrame(columns), span, 0.0)


@pytest.mark.parametrize("model", TRUTH)
def test_time_constants_and_gain_come_back_within_their_errors(model):
    prepared = prepare([trial(model, angle, seed) for seed, angle in enumerate((10, 20))], model)
    found = fit_declared(prepared)
    fit = make_fit(prepared, found, estimator="output_error", optimiser="x", seed=0)
    own = {p.name: p for p in physical(fit)}
    assert found.chi2_per_dof == pytest.approx(1.0, abs=0.05)
    assert own.keys() == TRUTH[model].keys()
    for name, value in TRUTH[model].items():
        assert abs(own[name].value - value) < 3.5 * own[name].stderr, name
        assert own[name].stderr < 0.1 * value, name
    assert own["K"].stderr < 0.01 * own["K"].value
    assert "K = " in " ".join(fit.notes)


def test_the_second_time_is_found_beside_a_delay(monkeypatch):
    """Begun with none, the model's zero stayed on its pole, a delay made up for both, and only the heading knew."""
    monkeypatch.setitem(TRUTH, "nomoto2", {"T_1": 6.0, "T_2": 0.8, "T_3": -0.2, "K": 0.4})
    trials = []
    for seed, angle in enumerate((10, 20)):
        made = trial("nomoto2", angle, seed)
        ordered = {k: replace(m, t=m.t - 1.0) for k, m in made.inputs.items()}
        heading = {k: m for k, m in made.measurements.items() if k != "yaw_rate"}
        trials.append(replace(made, inputs=ordered, measurements=heading))
    prepared = prepare(trials, "nomoto2")
    (late,) = [a for a in candidates(prepared.structure) if a.effect.name == "actuator_delay"]
    structure = prepared.structure.with_effect(late)
    begin = null_parameters(structure)
    begin[[s.name for s in structure.slots].index("delay")] = 0.8
    found = fit_from_scratch(structure, prepared.identify, begin)
    own = dict(zip([s.name for s in structure.slots], found.solution.p, strict=True))
    assert found.chi2_per_dof < 1.0
    assert -1.0 / own["E1_r"] == pytest.approx(6.0 * 0.8, rel=0.1)  # T_1 T_2
    assert own["E1_delta"] / -own["E1_r"] == pytest.approx(0.4, rel=0.02)


def test_a_run_that_begins_in_a_turn_begins_with_the_models_own_state():
    """Begun with none, the windows of a fit at the noise were off by a third of the yaw rate's spread: unexplained."""
    prepared = prepare([trial("nomoto2", 20, 0)], "nomoto2")
    s, [stretch] = fit_declared(prepared).solution, prepared.identify
    here, off = drive(s.structure, s.p, stretch), []
    for begin in range(100, stretch.steps - 50, 50):
        first = true_first_state(s.structure, here, stretch, begin)
        for own in (first[6], 0.0):
            first[6] = own
            ahead = run(s.structure, here, stretch, first, begin, 50)
            off.append(ahead[:, 5] - stretch.states[begin : begin + 51, 5])
    with_it, without = (np.sqrt(np.mean(np.square(off[k::2]))) for k in (0, 1))
    assert with_it < 0.003 < 0.03 < without


def test_a_free_run_answers_for_what_the_model_predicts_alone():
    """Speed and drift, of which a Nomoto model knows nothing, once hid how well it predicts the turning."""
    prepared = prepare([trial("nomoto1", 20, 0)], "nomoto1")
    found = fit_declared(prepared)
    errors = relative_errors(prepared.structure, found.solution.p, prepared.identify[0], np.ones(3))
    assert not errors[:, :2].any()
    assert errors[:, 2].any()
    assert free_running_misfit(found) < 0.01


def test_positions_say_nothing_of_a_model_of_yaw_alone():
    prepared = prepare([trial("nomoto1", 20, 0)], "nomoto1")
    assert prepared.structure.setting.streams == ("heading", "yaw_rate")
    assert set(prepared.identify[0].samples.kind.tolist()) == {1, 2}


def test_every_cause_acts_in_yaw_alone_and_can_be_tried_from_its_null():
    prepared = prepare([trial("nomoto1", 20.0, 0)], "nomoto1")
    (stretch,), found = prepared.identify, candidates(prepared.structure)
    assert {"wind", "quadratic_damping", "actuator_lag"} <= {a.effect.name for a in found}
    assert not {"current", "antenna_offset", "turning_resistance"} & {a.effect.name for a in found}
    for active in found:
        structure = prepared.structure.with_effect(active)
        coefficients = drive(structure, null_parameters(structure), stretch).coefficients
        assert len(coefficients) == len(structure.table.terms)
        assert {t.dof for _, t in structure.free_terms[0]} <= {"r"}
