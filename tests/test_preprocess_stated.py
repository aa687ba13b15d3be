"""What receivers state of their accuracy: followed where it is true, to any factor, and not where it says nothing."""

from dataclasses import replace

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled, truth_of

from ingest.log import Source
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials

LEVELS = np.array([0.02, 0.3])


def poor_at_times(factor=3.0, column="accuracy", lie=False, seed=0):
    """A log whose position is 15 times worse at times (below trees), with what the receiver states of it."""
    truth = truth_of("usv", "zigzag", 120.0, seed)
    sensors = {"heading": Imperfect(10.0, 0.01), "yaw_rate": Imperfect(10.0, 0.003)}
    made = sampled(truth, seed, position=Imperfect(5.0, 0.0), **sensors)
    table, rng = made.log.tables["position"], np.random.default_rng(seed + 9)
    t = table.index.to_numpy() * 1e-9
    poor = (np.mod(t, 20.0) > 12.0).astype(int)
    table += LEVELS[poor][:, None] * rng.standard_normal((len(t), 2))
    stated = LEVELS[rng.permutation(poor) if lie else poor] * factor
    source = Source(
        "position", "position", {"north": "north", "east": "east"}, "m", None, 50.0, {column: column}
    )
    log = replace(
        made.log, sources=(source,), tables={**made.log.tables, "position": table.assign(**{column: stated})}
    )
    sensors = {k: v for k, v in made.sensors.items() if k != "position"}
    (trial,) = make_trials(
        [LoggedRun("a", log, "identify")], made.vessel, made.inputs, sensors, by_response=False
    )
    return trial, truth


def error(trial, truth, name):
    s = trial.states
    inside = (s["t"] > 3.0) & (s["t"] < 117.0)
    return float(np.sqrt(np.mean((s[name] - np.interp(s["t"], truth.t, getattr(truth, name)))[inside] ** 2)))


def power(trial):
    (step,) = [s for s in trial.history if s.action == "stated_accuracy"]
    return step.arguments["power"]


@pytest.fixture(scope="module")
def unheard():
    return poor_at_times(column="unknown_column")


@pytest.mark.parametrize("column", ["accuracy", "hdop"])
def test_a_true_word_is_followed_to_any_factor(unheard, column):
    trial, truth = poor_at_times(3.0, column)
    assert power(trial) == 1.0
    assert any("states of their accuracy" in f for f in trial.findings)
    rms = np.sqrt(np.mean(LEVELS[[0, 0, 0, 1, 1]] ** 2))
    assert trial.measurements["position"].sigma == pytest.approx(rms, rel=0.1)
    m = trial.measurements["position"]
    found = m.sigma * np.sqrt(m.weight)
    poor = np.mod(m.t, 20.0) > 12.0
    assert np.median(found[poor]) == pytest.approx(LEVELS[1], rel=0.15)
    assert np.median(found[~poor]) == pytest.approx(LEVELS[0], rel=0.15)
    for name in ("u", "v"):
        assert error(trial, truth, name) < 0.85 * error(*unheard, name)


def test_a_word_that_says_nothing_is_not_heard(unheard):
    trial, truth = poor_at_times(lie=True)
    assert power(trial) == 0.0
    assert trial.measurements["position"].weight is None
    for name in ("u", "v"):
        assert error(trial, truth, name) == pytest.approx(error(*unheard, name))


def test_the_same_word_for_all_samples_is_no_word():
    truth = truth_of("usv", "zigzag", 40.0)
    made = sampled(truth, position=Imperfect(5.0, 0.02), heading=Imperfect(10.0, 0.01))
    table = made.log.tables["position"].assign(hdop=0.8)
    source = Source(
        "position", "position", {"north": "north", "east": "east"}, "m", None, 50.0, {"hdop": "hdop"}
    )
    log = replace(made.log, sources=(source,), tables={**made.log.tables, "position": table})
    sensors = {k: v for k, v in made.sensors.items() if k != "position"}
    (trial,) = make_trials(
        [LoggedRun("a", log, "identify")], made.vessel, made.inputs, sensors, by_response=False
    )
    assert not [s for s in trial.history if s.action == "stated_accuracy"]
