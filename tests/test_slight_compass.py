"""Headings that are slowly off by no more than any compass's: known so, and no structure; larger ones are."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from drifting_samples import fitted_to_drifts
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.kernel import HEADING
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.report_fit import compass_words
from identify.wander import drifts_shown, wander_shown, with_drifts
from validate.other_logs import on_other_logs
from validate.slight_compass import ANY_COMPASS, GROWN, LASTING, with_slight_compass_known
from validate.wander import with_wander_anew

NOISE = 0.001
EXACT = replace(Suite(), heading=Sensor(10.0, NOISE), shared_attitude=False)


@cache
def fitted():
    made = trials_of("catamaran", ("zigzag", "random", "zigzag10"), 90.0, 5, validate=0, suite=EXACT)[1]
    return fit_declared(prepare(made, "modulus"))


@cache
def drifting(size):
    """The same logs with headings that are slowly off by a size, rad, fitted again."""
    return fitted_to_drifts(fitted(), HEADING, size / NOISE, LASTING, 1)


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
