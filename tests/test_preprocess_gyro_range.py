"""A gyro at the end of its range whose values scatter about the limit: set aside as the heading tells, and no other."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from preprocess_samples import Imperfect, sampled, truth_of

from ingest.log import Source
from preprocess.gyro_range import within_range
from preprocess.raw import Raw
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials

NOISE = 0.003
SENSORS = {
    "position": Imperfect(5.0, 0.02),
    "heading": Imperfect(10.0, 0.005),
    "yaw_rate": Imperfect(20.0, 0.0),
}


def trials_of(limit, offset=0.0, logs=2):
    """Trials of zigzags whose gyro is limited, to both sides of an offset, before its noise comes."""
    truths = [truth_of("usv", "zigzag", 80.0, seed=k) for k in range(logs)]
    each = [sampled(truth, seed=k, **SENSORS) for k, truth in enumerate(truths)]
    runs = []
    for k, made in enumerate(each):
        gyro = made.log.tables["yaw_rate"].clip(offset - limit, offset + limit)
        noisy = gyro + np.random.default_rng(k).normal(0.0, NOISE, gyro.shape)
        log = replace(made.log, tables={**made.log.tables, "yaw_rate": noisy})
        runs.append(LoggedRun(f"log{k}", log, "identify"))
    return truths, make_trials(runs, each[0].vessel, each[0].inputs, each[0].sensors, by_response=False)


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_rates_that_scatter_about_a_limit_are_set_aside_where_the_heading_turns_faster(offset):
    limit = 0.6 * np.abs(truth_of("usv", "zigzag", 80.0).r).max()
    truths, trials = trials_of(limit, offset)
    for truth, trial in zip(truths, trials, strict=True):
        gyro = trial.measurements["yaw_rate"]
        r = np.interp(gyro.t, truth.t, truth.r)
        beyond = np.abs(r - offset) > limit
        assert beyond.sum() > 200
        assert not gyro.good[beyond].any()
        assert gyro.good[np.abs(r - offset) < limit - 8.0 * NOISE].mean() > 0.99
        inside = (trial.states["t"] > 3.0) & (trial.states["t"] < truth.t[-1] - 3.0)
        off = (trial.states["r"] - np.interp(trial.states["t"], truth.t, truth.r))[inside]
        assert np.sqrt(np.mean(off**2)) < 0.02
        assert any("saturated" in words for words in trial.findings)


def test_a_gyro_that_is_never_beyond_its_range_is_believed_to_its_greatest_rate():
    for trial in trials_of(np.inf)[1]:
        assert "saturated" not in trial.measurements["yaw_rate"].reasons


def raw_of(quantity, t, value):
    source = Source(quantity, quantity, {"value": "value"}, "")
    return Raw(quantity, t, value, np.zeros(len(t), dtype=bool), source)


@given(
    st.integers(0, 10_000),
    st.floats(0.7, 1.3),
    st.floats(-0.1, 0.1),
    st.floats(0.0, 1.0),
    st.sampled_from(["steady", "sine", "square"]),
)
@example(seed=1437, scale=0.71875, offset=0.0, late=1.0, kind="square")
@settings(max_examples=60, deadline=None)
def test_scale_offset_and_delay_of_a_gyro_are_no_end_of_its_range(seed, scale, offset, late, kind):
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 240.0, 0.1)
    swing = np.sin(2.0 * np.pi * t / rng.uniform(8.0, 40.0))
    r = 0.2 * {"steady": np.ones(len(t)), "sine": swing, "square": np.tanh(6.0 * swing)}[kind]
    psi = np.interp(t - late, t, np.cumsum(r) * 0.1) + rng.normal(0.0, 0.02, len(t))
    gyro = scale * r + offset + rng.normal(0.0, NOISE, len(t))
    log = {"heading": raw_of("heading", t, np.mod(psi, 2.0 * np.pi)), "yaw_rate": raw_of("yaw_rate", t, gyro)}
    (found,) = within_range([log])
    assert not np.isfinite(found["yaw_rate"].reach).any()


def test_logs_without_a_gyro_or_a_heading_pass_unchanged():
    t = np.arange(0.0, 60.0, 0.1)
    alone = {"yaw_rate": raw_of("yaw_rate", t, np.sin(t))}
    assert within_range([alone, {}]) == [alone, {}]
