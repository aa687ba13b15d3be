"""Logs that nothing was fitted to have a say in what was found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from identification_samples import trials_of

from fixtures.effects import Effect
from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch, fit_states
from identify.fitted import FAR, NEAR
from identify.free_running import FOLLOWS
from identify.prepare import prepare
from identify.sensor_line import SensorLine
from validate import other_logs
from validate.candidates import candidates
from validate.scores import predictions, validation
from validate.unseen import leads_astray, speak_against


def test_logs_speak_against_a_fit_that_runs_away_on_them_and_not_against_the_same_fit():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 5)
    unseen = [replace(t, role="validate") for t in trials[1:]]
    prepared = prepare([trials[0], *unseen], ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, rounds=0)
    assert not speak_against(prepared, fitted, fitted)
    bent = np.where([s.coefficient >= 0 for s in prepared.structure.slots], 0.3, 1.0) * fitted.solution.p
    there = fit_states(fitted.problem, prepared.structure, bent)
    astray = replace(fitted, solution=there)
    assert speak_against(prepared, fitted, astray)
    assert not speak_against(prepared, astray, fitted)
    alone = replace(prepared, validate=())
    assert [leads_astray(alone, fitted, f) for f in (fitted, astray)] == [False, True]
    assert not leads_astray(alone, astray, fitted)


def test_parameters_follow_other_logs_to_the_end(monkeypatch):
    """Where a rich model's valley is long: a search of steps that are worth a quarter comes there too."""
    steps = other_logs.solve
    monkeypatch.setattr(
        other_logs, "solve", lambda *a, budget, **k: steps(*a, budget=max(1, budget // 4), **k)
    )
    monkeypatch.setattr(other_logs, "_begun_anew", lambda *_: [])
    ship, trials = trials_of("usv", ("speed", "zigzag"), 60.0, 5)
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    assert other_logs.with_other_logs(fitted, prepared.validate).chi2_per_dof < 1.1


def late_gyro(wander=0.0):
    """What was prepared of logs whose gyro is 1.2 s late, the declared model's fit and that with the clock."""
    suite = Suite(position=Sensor(5.0, 0.03, wander=wander, wander_time=30.0)) if wander else Suite()
    late = Effect("clock_offset", {"offset": 1.2}, options={"stream": "yaw_rate"})
    ship, trials = trials_of("usv", ("zigzag", "random", "zigzag"), 60.0, 5, (late,), suite=suite, validate=1)
    prepared = prepare(trials, ship.model)
    [clock] = [a for a in candidates(prepared.structure) if a.label == "clock_offset (yaw_rate)"]
    declared = fit_from_scratch(prepared.structure, prepared.identify)
    return prepared, declared, fit_from_scratch(prepared.structure.with_effect(clock), prepared.identify)


def test_free_runs_with_a_late_gyro_are_held_against_what_the_smoothed_motion_has_of_it():
    prepared, declared, after = late_gyro()
    runs = predictions(after.solution.structure, after.solution.p, prepared.validate)
    spread = np.concatenate([s.states[:, 5] for s in (*prepared.identify, *prepared.validate)]).var()
    rate = validation(prepared.structure, prepared.validate, runs).channels["r"]
    assert rate.mse / spread < 0.01
    assert not speak_against(prepared, declared, after)


def test_what_brings_measurements_to_the_noise_is_not_taken_back_for_a_smoothed_motion():
    prepared, declared, after = late_gyro()
    assert after.chi2_per_dof < NEAR < declared.chi2_per_dof
    speaks_only_for_a_smoother(prepared, declared, after)


def test_nor_is_what_comes_near_the_noise_beside_a_receiver_that_wanders():
    """Its white errors are few and its slow ones many: over whole logs the measurements themselves are asked."""
    prepared, declared, after = late_gyro(wander=0.12)
    assert NEAR < after.chi2_per_dof < FAR < declared.chi2_per_dof
    speaks_only_for_a_smoother(prepared, declared, after)


def speaks_only_for_a_smoother(prepared, declared, after):
    """Free runs speak against a fit as if the smoother had followed the gyro; the measurements do not."""
    unseen = tuple(replace(s) for s in prepared.validate)
    for stretch in unseen:
        vars(stretch)["gyro_line"] = SensorLine()  # as if the smoother had followed the gyro
    runs = predictions(after.solution.structure, after.solution.p, unseen)
    rate = validation(prepared.structure, unseen, runs).channels["r"]
    spread = np.concatenate([s.states[:, 5] for s in (*prepared.identify, *unseen)]).var()
    assert rate.mse / spread > FOLLOWS  # free runs alone speak against it
    assert not speak_against(replace(prepared, validate=unseen), declared, after)


def test_far_from_the_noise_effects_must_predict_unseen_logs_better():
    prepared, declared, _ = late_gyro(wander=0.12)
    assert declared.chi2_per_dof > FAR
    assert speak_against(prepared, declared, declared)  # as well is not better
