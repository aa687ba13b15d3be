"""Orders that are computed and logged at one rate are as old each time: that is no lack of the model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.entry_phases import phases_of
from identify.prepare import prepare

#: A compass and a gyro that are good enough to show some hundredths of a second.
SUITE = Suite(heading=Sensor(10.0, 0.002), yaw_rate=Sensor(10.0, 0.001))
#: How much later than it acts each input is entered in each log, s.
LATE = ((0.01, 0.09), (0.08, 0.03), (0.05, 0.0))


@cache
def sailed():
    ship, trials = trials_of("catamaran", ("zigzag", "random", "zigzag10"), 80.0, 3, (), suite=SUITE)
    trials = [entered(t, each) for t, each in zip(trials, LATE, strict=True)]
    prepared = prepare(trials, ship.model)
    return prepared, fit_from_scratch(prepared.structure, prepared.identify)


def entered(trial, late):
    pairs = zip(trial.inputs.items(), late, strict=True)
    return replace(trial, inputs={k: replace(m, t=m.t + lag) for (k, m), lag in pairs})


def test_inputs_that_are_entered_late_by_another_time_in_each_log_leave_a_clean_campaign_clean():
    _, fitted = sailed()
    assert fitted.problem.unlogged.phased is not None
    assert fitted.chi2_per_dof == pytest.approx(1.0, abs=0.04)
    assert not fitted.is_off


def test_without_it_they_would_not(monkeypatch):
    prepared, _ = sailed()
    monkeypatch.setattr("identify.unlogged._with_phases", lambda _, known, raw=None: known)
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    assert fitted.chi2_per_dof > 1.05


def test_a_shape_is_what_a_delay_of_a_standard_deviation_makes():
    prepared, fitted = sailed()
    s, stretch = fitted.solution, prepared.identify[0]
    shapes = phases_of(s.structure, s.p, stretch, [(0, stretch.steps)])
    assert shapes.count == len(s.structure.inputs)
    name = s.structure.inputs[0].name
    logged, place = stretch.inputs[name], s.structure.table.channels.index("T:thruster")
    thrust = np.abs(logged.value) * logged.value
    inside = logged.t > stretch.start + 1.0
    moved = np.abs(np.diff(thrust))[inside[1:]] * 0.1 / np.sqrt(12.0)
    area = np.abs(shapes.mean[:, 0, place]).sum() * stretch.h
    assert area == pytest.approx(moved.sum(), rel=0.1)
