"""What rounded inputs may have done to a vessel's motion is no effect of the model's; what is more stays one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from identify.structure import null_parameters
from preprocess.trial import Measurement
from validate import sure
from validate.candidates import candidates
from validate.rounding import Scale, common_step, done_by_rounding, scale_of
from validate.sure import _beyond

#: Step of a propeller's speed, rad/s, between two of which its 23.4 rad/s lie.
STEP = 0.36


def rounded(measured: Measurement, step: float, last: bool) -> Measurement:
    """Speeds of a propeller that hunts a little, in whole steps; in the last log rounded up, in the others down."""
    hunting = measured.value + 0.5 * np.sin(0.7 * measured.t) * (measured.value != 23.4)
    to_whole = np.ceil if last else np.floor
    return replace(measured, value=step * to_whole(hunting / step))


def shallow_in_the_last(truth, step):
    """A fit with shallow water in the last log, of logs whose propeller's speed was rounded."""
    _, trials = trials_of("usv", ("circle", "zigzag", "random", "circle"), 60.0, 5, truth, validate=0)
    trials = tuple(
        replace(t, inputs={**t.inputs, "propeller": rounded(t.inputs["propeller"], step, t is trials[-1])})
        for t in trials
    )
    prepared = prepare(trials, "modulus")
    label = f"shallow_water ({prepared.identify[-1].name})"
    structure = prepared.structure.with_effect(
        next(a for a in candidates(prepared.structure) if a.label == label)
    )
    return fit_from_scratch(structure, prepared.identify, null_parameters(structure), rounds=1)


def stretches_with(values):
    _, trials = trials_of("usv", ("circle",), 20.0, 5, (), validate=0)
    (stretch,) = prepare(trials, "modulus").identify
    n = stretch.inputs["propeller"]
    return [
        replace(stretch, inputs={**stretch.inputs, "propeller": replace(n, value=np.resize(v, len(n.t)))})
        for v in values
    ]


def test_the_step_is_what_all_values_of_all_logs_are_multiples_of():
    scale = scale_of("propeller", stretches_with([[3.0, 5.0, 63.0], [3.5, 9.0, 13.0]]))
    assert scale == Scale(3.0, 0.5, 121)


def test_steps_ahead_and_astern_may_differ():
    ahead, astern = 0.25 * np.arange(0, 60, 3), -0.1 * np.array([0, 7, 40, 45, 61])
    scale = scale_of("propeller", stretches_with([ahead, astern]))
    assert scale.step == pytest.approx(0.1)


@given(
    step=st.floats(0.001, 10.0),
    multiples=st.lists(st.integers(-400, 400), min_size=30, max_size=60, unique=True),
    zero=st.floats(-100.0, 100.0),
)
def test_a_common_step_is_found_from_any_values(step, multiples, zero):
    steps = np.diff(np.sort(zero + step * np.array(multiples)))
    found = common_step(steps, 1e-4 * steps.sum())
    assert found == pytest.approx(step * np.gcd.reduce(np.diff(np.sort(multiples))), rel=1e-6)


@pytest.mark.parametrize(
    "values", [[4.0], [-1.0, 0.0, 0.5, 1.0], np.random.default_rng(0).normal(size=100_000)]
)
def test_what_never_changes_or_was_chosen_or_is_logged_finely_is_not_rounded(values):
    assert scale_of("propeller", stretches_with([values, values])) is None


def test_the_same_value_is_off_by_half_a_step_always_the_same_way():
    (stretch,) = stretches_with([[1.0, 1.5, 2.0, 4.0]])
    scale = Scale(1.0, 0.5, 7)
    off = scale.off(stretch.inputs["propeller"], 3).value - stretch.inputs["propeller"].value
    assert np.abs(off) == pytest.approx(0.25)
    assert all(len(np.unique(off[k::4].round(9))) == 1 for k in range(4))
    assert len({tuple(scale.off(stretch.inputs["propeller"], draw).value[:4]) for draw in range(8)}) > 1


def test_coarser_steps_do_more():
    fine, coarse = (done_by_rounding(shallow_in_the_last((), step)) for step in (STEP / 8.0, STEP))
    assert 0.0 < 10.0 * fine < coarse


@pytest.mark.parametrize(("evidence", "sure_of_it"), [(500.0, False), (2000.0, True)])
def test_what_rounding_may_have_done_is_no_shallow_water_short_of_overwhelming_evidence(
    monkeypatch, evidence, sure_of_it
):
    fitted = shallow_in_the_last((), STEP)
    monkeypatch.setattr(sure, "evidence", lambda *_: evidence)
    assert (_beyond(fitted, np.eye(len(fitted.solution.p)), 0) > 0.0) is sure_of_it


def test_what_is_more_than_rounding_needs_no_more_evidence(monkeypatch):
    truth = Effect("shallow_water", {"factor": 1.4}, None, {"logs": (3,)})
    fitted = shallow_in_the_last((truth,), STEP)
    monkeypatch.setattr(sure, "evidence", lambda *_: 150.0)
    assert _beyond(fitted, np.eye(len(fitted.solution.p)), 0) > 0.0


def test_a_channel_that_is_off_by_chance_is_not_held_against_an_effect(monkeypatch):
    """A surge that hardly moves is worse with the effect by more than the yaw rate is better, and says nothing."""
    truth = Effect("shallow_water", {"factor": 1.4}, None, {"logs": (3,)})
    fitted = shallow_in_the_last((truth,), STEP)
    errors = {True: np.array([0.5, 0.0, 0.0]), False: np.array([0.4, 0.0, 0.05])}
    monkeypatch.setattr(sure, "free_running_errors", lambda f: errors[bool(f.solution.structure.actives)])
    monkeypatch.setattr(sure, "evidence", lambda *_: 150.0)
    assert _beyond(fitted, np.eye(len(fitted.solution.p)), 0) > 0.0
