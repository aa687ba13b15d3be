"""Logs of which nothing can be used: left out of the identification, and the error where none is left."""

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import trials_of

from identify.prepare import prepare
from identify.usable import usable, why_none
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


def with_reasons(trial, **reasons):
    """A log whose samples of position were all set aside for some reasons."""
    position = trial.measurements["position"]
    none = replace(position, good=np.zeros(len(position.t), bool), reasons=reasons)
    return replace(trial, measurements={**trial.measurements, "position": none}, segments=())


def test_what_was_set_aside_is_said_with_its_cure_where_no_stretch_is_left(trials):
    bare = [with_reasons(t, repeated=200, outlier=3) for t in trials]
    with pytest.raises(NotIdentifiable) as caught:
        prepare(bare, "linear")
    n = len(trials[0].measurements["position"].t)
    said = f"01-zigzag: {n} of {n} samples of position were set aside (200 repeated, 3 outliers): the vessel"
    assert f"{said} hardly moves" in str(caught.value)
    assert "heading were" not in str(caught.value)
    assert "hardly moves" not in why_none([with_reasons(trials[0], outlier=200)])


def slowed(trial, times):
    """A log whose times were read in a unit that is so many times too large."""
    sensors = {
        k: replace(m, t=times * m.t, sample_time=times * m.sample_time) for k, m in trial.measurements.items()
    }
    states = trial.states.assign(t=times * trial.states["t"])
    for rate in ("u", "v", "r"):
        states[rate] = states[rate] / times
    return replace(
        trial,
        measurements=sensors,
        states=states,
        segments=tuple((times * a, times * b) for a, b in trial.segments),
    )


def test_times_in_another_unit_are_said_before_anything_is_fitted(trials):
    with pytest.raises(NotIdentifiable, match=r"01-zigzag has a position every .* s .*t_ms") as caught:
        usable([slowed(t, 1000.0) for t in trials])
    assert "idle" in str(caught.value)


def test_a_vessel_that_moves_or_is_sampled_often_is_used(trials):
    rare = [slowed(t, 1000.0) for t in trials]
    sailing = [replace(t, states=s.states) for t, s in zip(rare, trials, strict=True)]
    idle = [replace(t, states=s.states) for t, s in zip(trials, rare, strict=True)]
    for some in (sailing, idle, [trials[0], *rare[1:]]):
        assert len(usable(some)) == len(trials)
