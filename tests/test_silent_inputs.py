"""Where the inputs' messages are lost for seconds, no prediction goes on; where nothing can be missed, it does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import trials_of

from identify.base_fit import fit_from_scratch
from identify.on_change import sampled_evenly
from identify.prepare import prepare
from identify.silent_inputs import AFTERWARDS, known_inputs_alone
from ingest.errors import NotIdentifiable

LOST = ((12.0, 15.5), (31.0, 33.0), (47.0, 51.0))


@pytest.fixture(scope="module")
def trials():
    return trials_of("catamaran", ("random", "random", "zigzag"), 60.0, 5, validate=0)[1]


def silent(trial, lost, only=None):
    """The trial with its inputs, or one of them, not logged between some times."""

    def heard(name, m):
        gone = np.any([(m.t > a) & (m.t < b) for a, b in lost], axis=0) & (only in (None, name))
        return replace(m, t=m.t[~gone], value=m.value[~gone], good=m.good[~gone])

    return replace(trial, inputs={n: heard(n, m) for n, m in trial.inputs.items()})


def test_lost_orders_end_a_stretch_and_the_fit_is_at_the_noise(trials):
    lossy = [silent(t, LOST) for t in trials]
    cut, said = known_inputs_alone(lossy)
    for t in cut[:2]:
        assert len(t.segments) == 1 + len(LOST)
        ends = [b for _, b in t.segments[:-1]]
        assert ends == pytest.approx([a for a, _ in LOST], abs=0.11)
        assert [a for a, _ in t.segments[1:]] == pytest.approx([b + AFTERWARDS for _, b in LOST], abs=0.11)
    assert "silent for up to 4" in said[0] and "at 3 places" in said[0]
    ready = prepare(lossy, "modulus")
    assert any("silent" in note for note in ready.notes)
    assert fit_from_scratch(ready.structure, ready.identify).chi2_per_dof < 1.2
    whole = prepare(trials, "modulus")
    bridged = tuple(replace(s, inputs=lossy[k].inputs) for k, s in enumerate(whole.identify))
    assert fit_from_scratch(whole.structure, bridged).chi2_per_dof > 3.0


def test_what_comes_before_the_first_order_and_after_the_last_is_left_out(trials):
    cut, said = known_inputs_alone([silent(t, ((-1.0, 6.0), (54.0, 61.0))) for t in trials])
    assert len(said) == len(trials)
    for t in cut:
        ((begin, end),) = t.segments
        assert (begin, end) == pytest.approx((6.0 + AFTERWARDS, 54.0), abs=0.11)


def test_logs_of_which_nothing_is_left_are_said_to_have_silent_inputs(trials):
    with pytest.raises(NotIdentifiable, match=r"unbroken stretch .* an input is silent for up to 56 s"):
        prepare([silent(t, ((-1.0, 56.0),)) for t in trials], "modulus")


def test_nothing_ends_where_nothing_is_missed(trials):
    for some in (
        trials,
        [silent(t, ((20.0, 20.4),)) for t in trials],  # a lost message or two
        [
            silent(t, [(x, x + 0.8) for x in np.arange(2.0, 58.0, 1.0)]) for t in trials
        ],  # a logger that pauses
    ):
        cut, said = known_inputs_alone(some)
        assert not said
        assert [t.segments for t in cut] == [t.segments for t in some]


def test_an_input_that_holds_throughout_is_missed_by_nobody(trials):
    """One motor stands still for the whole of all logs: its silence hides nothing."""
    still = [
        replace(
            t,
            inputs={
                **t.inputs,
                "left": replace(t.inputs["left"], value=np.full(len(t.inputs["left"].t), 0.5)),
            },
        )
        for t in trials
    ]
    assert not known_inputs_alone([silent(t, LOST, "left") for t in still])[1]
    assert known_inputs_alone([silent(t, LOST, "right") for t in still])[1]


def test_what_is_entered_at_its_changes_is_not_silent_between_them(trials):
    """A step at a time, and nothing until the next: that is known, and not missed."""
    rng = np.random.default_rng(2)

    def orders(m):
        t = np.cumsum(rng.uniform(2.0, 9.0, 12))
        t = t[t < 58.0]
        return replace(m, t=np.r_[0.0, t], value=rng.uniform(-1, 1, len(t) + 1), good=np.ones(len(t) + 1, bool),
                       held=True, sample_time=float(np.median(np.diff(t))))  # fmt: skip

    ordered = [replace(t, inputs={n: orders(m) for n, m in t.inputs.items()}) for t in trials]
    assert sampled_evenly(ordered) == ()
    assert not known_inputs_alone(ordered)[1]
