"""Logs of which nothing can be used: left out of the identification, and the error where none is left."""

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import trials_of

from identify.prepare import prepare
from ingest.errors import NotIdentifiable
from validate.tables import prediction_tables


@pytest.fixture(scope="module")
def trials():
    return trials_of("usv", ("zigzag", "random", "zigzag"), duration=30.0, seed=3, validate=1)[1]


def without_stretch(trial):
    """A log that is too short, or one gap; what it says of its sensors is worth nothing."""
    wild = {k: replace(m, sigma=1e3 * m.sigma) for k, m in trial.measurements.items()}
    return replace(trial, segments=(), measurements=wild)


def test_a_log_without_a_stretch_says_nothing_of_the_sensors(trials):
    first, second, last = trials
    with_it = prepare((first, without_stretch(second), last), "linear")
    alone = prepare((first, last), "linear")
    assert with_it.digest == alone.digest
    assert (with_it.identify[0].samples.sigma == alone.identify[0].samples.sigma).all()


def silent(trial):
    """A log whose inputs have no number at all."""
    none = np.empty(0)
    inputs = {k: replace(m, t=none, value=none, good=none.astype(bool)) for k, m in trial.inputs.items()}
    return replace(trial, inputs=inputs, segments=())


def test_inputs_that_say_nothing_are_named_where_no_other_log_is_left(trials):
    with pytest.raises(NotIdentifiable, match=r"can be used: 01-zigzag: \w+ \(signal '.*'\) has no number"):
        prepare([silent(t) for t in trials], "linear")


def test_the_table_of_a_log_without_inputs_is_empty_there(trials):
    (table,) = prediction_tables([silent(trials[0])], [], "uvr", [], []).values()
    assert table["x"].notna().all()
    assert table[list(trials[0].inputs)].isna().all(axis=None)


@pytest.mark.filterwarnings("error")
def test_no_stretch_at_all_is_said_without_a_warning(trials):
    bare = [t.states.assign(u=float("nan"), r=float("nan")) for t in trials]
    with pytest.raises(NotIdentifiable, match="unbroken stretch of five seconds"):
        prepare([replace(without_stretch(t), states=s) for t, s in zip(trials, bare, strict=True)], "linear")
