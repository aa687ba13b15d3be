"""Where a slack linkage is as a stretch begins: what the input did before, or the first seconds, tell."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active, Variant
from identify.effects.actuators import ACTUATOR_DEADBAND
from identify.predict import free_run
from identify.prepare import prepare
from validate.unseen_begins import begun_in

WIDTH, CUT = 0.12, 21.0


@cache
def fitted_and_unseen():
    """A fit that knows of slack in the rudder, and an unseen log that is looked at from ``CUT`` seconds on."""
    slack = Effect("actuator_deadband", {"width": WIDTH}, "rudder", options={"form": "play"})
    _, trials = trials_of("usv", ("zigzag", "random", "zigzag", "circle"), 75.0, 6, (slack,))
    unseen = next(t for t in trials if t.role == "validate")
    later = replace(unseen, segments=((CUT, unseen.segments[0][1]),))
    prepared = prepare([*(t for t in trials if t.role == "identify"), later], "modulus")
    play = Active(ACTUATOR_DEADBAND, Variant("rudder", {"form": "play"}))
    structure = prepared.structure.with_effect(play)
    p = np.array([WIDTH if s.name == "width" else 0.0 for s in structure.slots])
    return fit_from_scratch(structure, prepared.identify, p), prepared.validate


def forgotten(stretch):
    """A stretch of a log in which nobody wrote down what the inputs did before it."""
    kept = {n: replace(m, good=m.good & (m.t >= stretch.start)) for n, m in stretch.inputs.items()}
    return replace(stretch, inputs=kept)


def misfit(fitted, stretch):
    """Free-running error of the yaw rate, rad/s, root mean square."""
    error = free_run(fitted.solution.structure, fitted.solution.p, stretch)[:, 5] - stretch.states[:, 5]
    return float(np.sqrt(np.mean(error**2)))


def begun_at(fitted, stretch, place):
    [active] = fitted.solution.structure.actives
    structure = replace(fitted.solution.structure, actives=(replace(active, begin={stretch.name: place}),))
    return replace(fitted, solution=replace(fitted.solution, structure=structure))


@pytest.mark.parametrize("place", [-1.0, 1.0])
def test_what_the_input_did_before_a_stretch_tells_where_the_slack_is(place):
    fitted, [stretch] = fitted_and_unseen()
    assert stretch.start >= CUT
    assert len(stretch.before("rudder", stretch.start).told) == 2
    assert (
        misfit(begun_at(fitted, stretch, place), stretch) < 0.012
    )  # the states' noise and the end of a transient


def test_where_nothing_is_known_of_before_the_first_seconds_tell():
    fitted, [stretch] = fitted_and_unseen()
    unknown = forgotten(stretch)
    assert misfit(begun_at(fitted, unknown, 0.0), unknown) > 0.025
    assert misfit(begun_in(fitted, [unknown]), unknown) < 0.012


def test_logs_that_were_fitted_keep_their_begin():
    fitted, _ = fitted_and_unseen()
    assert begun_in(fitted, fitted.problem.stretches) is fitted
