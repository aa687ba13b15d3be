"""Headings that are slowly off by no more than any compass's: known so, and no structure; larger ones are."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of
from scipy.signal import lfilter

from fixtures.sensors import Sensor, Suite
from identify.base_fit import window_length
from identify.first_states import first_states
from identify.fitted import Fitted
from identify.kernel import HEADING
from identify.noise import calibrated
from identify.output_error import solve
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.report_fit import compass_words
from identify.wander import drifts_shown, wander_shown, with_drifts
from identify.windows import cut
from validate.other_logs import on_other_logs
from validate.slight_compass import ANY_COMPASS, GROWN, LASTING, with_slight_compass_known
from validate.wander import with_wander_anew

EXACT = replace(Suite(), heading=Sensor(10.0, 0.001), shared_attitude=False)


@cache
def fitted():
    made = trials_of("catamaran", ("zigzag", "random", "zigzag10"), 90.0, 5, validate=0, suite=EXACT)[1]
    return fit_declared(prepare(made, "modulus"))


@cache
def drifting(size, seed=1):
    """The same logs with headings that are slowly off, fitted again."""
    found, rng = fitted(), np.random.default_rng(seed)
    stretches = tuple(replace(s, samples=drifted(s.samples, size, rng)) for s in found.problem.stretches)
    structure = found.solution.structure
    problem = cut(stretches, window_length(structure.vessel.length)).weighted_as(found.problem)
    solution = solve(problem, structure, found.solution.p, first_states(problem), found.prior, budget=8)
    for _ in range(2):
        problem = calibrated(problem, solution)
        solution = solve(problem, structure, solution.p, solution.first, found.prior, budget=5)
    return Fitted(problem, found.prior, solution)


def drifted(samples, size, rng):
    mine = samples.kind == HEADING
    keep = np.exp(-np.median(np.diff(samples.t[mine])) / LASTING)
    steps = rng.standard_normal(mine.sum()) * np.sqrt(1.0 - keep**2)
    steps[0] /= np.sqrt(1.0 - keep**2)
    value = samples.value.copy()
    value[mine, 0] += size * lfilter([1.0], [1.0, -keep], steps)
    return replace(samples, value=value)


def test_headings_that_err_by_chance_are_left_as_they_are():
    assert with_slight_compass_known(fitted()) is fitted()


@pytest.mark.parametrize("degrees", [0.1, 0.15])
def test_headings_as_slowly_off_as_any_compass_are_no_structure(degrees):
    without = drifting(np.radians(degrees))
    known = with_slight_compass_known(without)
    assert without.is_off
    assert not known.is_off
    (drift,) = drifts_shown(known.problem)
    assert drift.kind == HEADING
    assert ANY_COMPASS[0] / GROWN < drift.size < GROWN * ANY_COMPASS[-1]
    assert "any compass" in compass_words(drifts_shown(known.problem))[0]
    assert wander_shown(known.problem) is None  # that is the position's
    assert with_wander_anew(known) is known


def test_headings_that_are_farther_off_are_a_matter_for_the_diagnosis():
    for degrees in (0.6, 1.5):
        far = drifting(np.radians(degrees))
        assert with_slight_compass_known(far) is far


def test_other_logs_of_the_same_compass_are_as_slowly_off():
    known = with_slight_compass_known(drifting(np.radians(0.1)))
    other = on_other_logs(known, with_drifts(known.problem.stretches, ())[:1])
    assert drifts_shown(other.problem) == drifts_shown(known.problem)
