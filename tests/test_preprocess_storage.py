"""Trials as files, and back."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from preprocess_samples import Imperfect, assert_same_trial, sampled, truth_of

from preprocess.restore import read_trial, read_trials
from preprocess.run_of_log import LoggedRun
from preprocess.storage import write_folder, write_trial, write_trials
from preprocess.trials import make_trials

SENSORS = {
    "position": Imperfect(5.0, 0.02, outliers=0.02),
    "heading": Imperfect(10.0, 0.01),
    "velocity": Imperfect(2.0, 0.05),
}


@pytest.fixture(scope="module")
def parts():
    """One log, of which the last third validates."""
    made = sampled(truth_of("usv", "zigzag", 60.0), **SENSORS)
    log = replace(made.log, utc_ns=1_778_749_200_000_000_000)
    return make_trials([LoggedRun("logs/a.csv", log, None)], made.vessel, made.inputs, made.sensors)


def test_the_trials_of_a_log_are_written_and_read_back_equal(parts, tmp_path):
    (path,) = write_folder(parts, tmp_path / "trial", {"logs/a.csv": "a.csv"})
    assert path == tmp_path / "trial" / "a.csv.parquet"
    back = read_trials(path)
    assert [p.role for p in back] == ["identify", "validate"]
    for one, other in zip(back, parts, strict=True):
        assert_same_trial(one, other)
    with pytest.raises(ValueError, match="expected one trial, found 2"):
        read_trial(path)


def test_one_row_per_time_and_every_input_in_each(parts, tmp_path):
    write_trials(parts, tmp_path / "a.parquet")
    table = pd.read_parquet(tmp_path / "a.parquet")
    assert table["t"].is_unique and table["t"].is_monotonic_increasing
    assert set(table["role"]) == {"identify", "validate"}
    assert (table["utc_ns"] - table["utc_ns"][0] == np.rint((table["t"] - table["t"][0]) * 1e9)).all()
    sampled_rows = table["position_measured_good"].notna()
    assert sampled_rows.sum() == sum(len(p.measurements["position"].t) for p in parts)
    inside = table["t"].between(parts[0].inputs["a0"].t[0], parts[0].inputs["a0"].t[-1])
    assert table.loc[inside, "a0"].notna().all()


def test_parts_that_share_their_inputs_and_samples_that_weigh_differently(parts, tmp_path):
    whole, t = parts[0], parts[0].states["t"].to_numpy()
    still = np.where(t < 20.0, 0.0, whole.states["u"])
    position = whole.measurements["position"]
    weighed = replace(position, weight=np.linspace(0.5, 2.0, len(position.t)))
    trial = replace(
        whole,
        states=whole.states.assign(u=still, v=0.0, r=0.0),
        measurements={**whole.measurements, "position": weighed},
        inputs={k: replace(m, value=np.where(m.t < 30.0, 0.0, m.value)) for k, m in whole.inputs.items()},
    )
    low, high = (float(x) for x in trial.segments[0])
    cut = [
        replace(trial, states=trial.states[(t >= a) & (t < b)], segments=((a, b),), measurements={
            k: replace(m, t=m.t[use], value=m.value[use], good=m.good[use],
                       weight=None if m.weight is None else m.weight[use])
            for k, m in trial.measurements.items() for use in [(m.t >= a) & (m.t < b)]})
        for a, b in ((low, 15.0), (15.0, high))
    ]  # fmt: skip
    write_trials(cut, tmp_path / "a.parquet")
    for one, other in zip(read_trials(tmp_path / "a.parquet"), cut, strict=True):
        assert_same_trial(one, other)
    with pytest.raises(ValueError, match="overlap"):
        write_trials([*cut, trial], tmp_path / "a.parquet")


def test_a_trial_without_a_sample_inside_is_read_back(parts, tmp_path):
    empty = replace(parts[0], states=parts[0].states[:0], segments=())
    write_trial(empty, tmp_path / "a.parquet")
    assert_same_trial(read_trial(tmp_path / "a.parquet"), empty)


def test_another_parquet_file_is_no_trial(tmp_path):
    pd.DataFrame({"a": [1]}).to_parquet(tmp_path / "x.parquet")
    with pytest.raises(ValueError, match=r"seatrial\.trial/1"):
        read_trial(tmp_path / "x.parquet")
