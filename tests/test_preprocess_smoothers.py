"""The papers' observers in place of the smoother: what the trials then carry, and how sure they are of it."""

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled, truth_of

from identify.fit_with import fit_with
from identify.prepare import prepare
from identify.stretch import stretches_of
from ingest.errors import CampaignError
from preprocess.eso import Observer, observe
from preprocess.eso_motion import error_covariances
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.vessel import Smoothing
from seatrial import load_campaign

SENSORS = {
    "position": Imperfect(5.0, 0.02, 0.2, 0.1, 0.03),
    "heading": Imperfect(10.0, 0.01, 0.2, 0.1, 0.03),
    "yaw_rate": Imperfect(20.0, 0.003, 0.2, 0.1),
}


@pytest.fixture(scope="module")
def made():
    return sampled(truth_of("usv", "zigzag", 90.0), **SENSORS)


def trial_by(made, smoothing):
    run = LoggedRun("a", made.log, "identify")
    return make_trials([run], made.vessel, made.inputs, made.sensors, smoothing=smoothing, by_response=False)[
        0
    ]


def said_by(trial):
    """What the history says of the observer."""
    (step,) = [s for s in trial.history if s.action == "observe"]
    return step.arguments


def standardised(trial, truth, name):
    s = trial.states
    inside = ((s["t"] > 5.0) & (s["t"] < truth.t[-1] - 2.0)).to_numpy()
    of = getattr(truth, name) if len(name) == 1 else np.gradient(getattr(truth, name[1:]), truth.t)
    error = s[name].to_numpy() - np.interp(s["t"], truth.t, of)
    return error[inside], (error / s[f"sigma_{name}"].to_numpy())[inside]


@pytest.fixture(scope="module")
def default(made):
    return trial_by(made, None)


@pytest.mark.parametrize("smoother", ["eso", "ekf"])
def test_an_observer_is_worse_than_the_smoother_and_says_by_how_much(made, default, smoother):
    trial = trial_by(made, Smoothing(smoother))
    assert list(trial.states.columns) == list(default.states.columns)
    assert said_by(trial)["smoother"] == smoother
    for name in ("u", "v", "r", "du", "dv", "dr"):
        error, shares = standardised(trial, made.truth, name)
        smooth, _ = standardised(default, made.truth, name)
        assert np.std(error) > np.std(smooth)
        assert 0.25 < np.sqrt(np.mean(shares**2)) < 1.6, name
    assert np.std(standardised(trial, made.truth, "v")[0]) < 0.12


def test_the_default_is_the_smoother(made, default):
    np.testing.assert_array_equal(trial_by(made, Smoothing()).states, default.states)
    assert all(s.action != "observe" for s in default.history)


def test_a_bandwidth_is_taken_as_given(made):
    slow, fast = (trial_by(made, Smoothing("eso", w)) for w in (0.3, 20.0))
    assert set(said_by(slow)["bandwidth"].values()) == {0.3}
    assert np.nanstd(np.diff(fast.states["u"])) > 5.0 * np.nanstd(np.diff(slow.states["u"]))
    # what has not been caught up with is slow, and noise quick
    late, _ = standardised(slow, made.truth, "r")
    noisy, _ = standardised(fast, made.truth, "r")
    assert np.std(late) > np.std(noisy)


@pytest.mark.parametrize("order", [0, 1])
def test_the_error_of_an_observer_is_as_its_equations_say(order):
    rng, step, observer = np.random.default_rng(order), 0.02, Observer(1.5)
    t = np.arange(0.0, 800.0, step)
    noise = rng.normal(0.0, 1.0, len(t))
    seen = observe(observer, t, noise)[2000:]
    expected = step * np.diag(error_covariances(observer, order)[0])
    np.testing.assert_allclose(np.var(seen, axis=0), expected, rtol=0.2)
    jerk = rng.normal(0.0, 1.0 / np.sqrt(step), len(t))
    chain = [np.cumsum(jerk) * step]
    for _ in range(2 - order):
        chain.append(np.cumsum(chain[-1]) * step)
    count = 3 - order
    behind = observe(observer, t, chain[-1])[2000:, :count] - np.column_stack(chain[::-1])[2000:]
    expected = np.diag(error_covariances(observer, order)[1])[:count]
    np.testing.assert_allclose(np.var(behind, axis=0), expected, rtol=0.35)


def test_a_regression_is_made_of_the_chosen_motion_and_output_error_of_the_samples(made, default):
    observed = trial_by(made, Smoothing("ekf"))
    mine, theirs = (stretches_of(t, 0.1)[0] for t in (observed, default))
    assert np.std(mine.states[:, 4] - theirs.states[:, 4]) > 0.01
    np.testing.assert_array_equal(mine.samples.value, theirs.samples.value)
    gains = [fit_with(prepare([t], "blanke"), "ls").solution.p for t in (observed, default)]
    assert np.abs(gains[0] - gains[1]).max() > 0.01


CAMPAIGN = """[vessel]
name = "boat"
length = 1.0
beam = 0.3
[inputs.motor]
kind = "thruster"
signal = "x"
unit = "N"
{table}
[[log]]
path = "a.csv"
"""


def written(folder, table):
    (folder / "a.csv").write_text("t,x\n0,0\n")
    (folder / "campaign.toml").write_text(CAMPAIGN.format(table=table))
    return folder


def test_a_campaign_chooses_the_smoother(tmp_path):
    assert load_campaign(written(tmp_path, "")).smoothing == Smoothing()
    table = '[preprocess]\nsmoother = "eso"\nbandwidth = 2.0'
    assert load_campaign(written(tmp_path, table)).smoothing == Smoothing("eso", 2.0)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('smoother = "esO"', "rts.*eso.*ekf"),
        ("bandwidth = 2.0", "bandwidth with smoother"),
        ("bandwith = 2.0", "bandwidth"),
        ('smoother = "eso"\nbandwidth = 0.0', "bandwidth"),
    ],
)
def test_a_smoother_that_is_none_is_said(tmp_path, table, said):
    with pytest.raises(CampaignError, match=said):
        load_campaign(written(tmp_path, f"[preprocess]\n{table}"))
