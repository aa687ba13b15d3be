"""A regression on an observer's motion sees its regressors through the same observer: without that it is biased."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled, table, truth_of

import identify.by_tuning as by_tuning
from identify.fit_with import fit_with
from identify.prepare import prepare
from ingest.errors import CampaignError
from ingest.log import Log
from preprocess.eso import Observer, observe
from preprocess.eso_motion import bandwidths_of
from preprocess.nomoto_eso import NomotoObserver, filter_like_rate, observe_nomoto
from preprocess.nomoto_motion import error_covariances
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.vessel import Input, Sensor, Smoothing, Vessel
from seatrial import load_campaign

K, T = 0.8, 2.5


@pytest.fixture(scope="module")
def log():
    """A vessel that turns as the first-order Nomoto equation says, by steps of its rudder that get quicker."""
    rng, fine = np.random.default_rng(0), np.arange(0.0, 120.0, 0.01)
    delta = 0.3 * np.sign(np.sin(2.0 * np.pi * (0.04 * fine + 0.0012 * fine**2)))
    r = np.zeros(len(fine))
    keep = np.exp(-0.01 / T)
    for k in range(1, len(fine)):
        r[k] = keep * r[k - 1] + (1.0 - keep) * K * delta[k - 1]
    psi = np.cumsum(r) * 0.01
    track = np.cumsum(np.column_stack([np.cos(psi), np.sin(psi)]), axis=0) * 0.01
    t = fine[::10]
    made = {
        "position": track[::10] + rng.normal(0.0, 1e-3, (len(t), 2)),
        "heading": np.mod(psi[::10] + rng.normal(0.0, 3e-4, len(t)), 2.0 * np.pi)[:, None],
    }
    tables = {k: table(t, ("north", "east") if k == "position" else ("value",), v) for k, v in made.items()}
    tables["act"] = table(fine[::2], ("rudder",), delta[::2, None])
    return Log(Path("made.csv"), "csv", tables)


@pytest.fixture(scope="module")
def trial_by(log):
    """Trials of the log by smoother, each made once."""
    return cache(lambda smoothing: made_by(log, smoothing))


def made_by(log, smoothing):
    sensors = {
        "position": Sensor("position", {"north": "position.north", "east": "position.east"}, "m"),
        "heading": Sensor("heading", {"value": "heading.value"}, "rad"),
    }
    rudder = Input("rudder", "rudder", "act.rudder", unit="rad")
    run = LoggedRun("a", log, "identify", manoeuvre="zigzag")
    return make_trials(
        [run], Vessel("boat", 1.0, 0.3), [rudder], sensors, smoothing=smoothing, by_response=False
    )[0]


def fitted(trial, estimator):
    """Gain K and time constant T by regression."""
    fit = fit_with(prepare([trial], "nomoto1"), estimator)
    minus, gain = fit.solution.p[:2]
    return np.array([-gain / minus, -1.0 / minus])


@pytest.mark.parametrize("estimator", ["ls", "weak_form"])
@pytest.mark.parametrize("smoother", ["eso", "nomoto_eso"])
def test_regressors_are_seen_as_the_observer_shows_the_motion(trial_by, monkeypatch, smoother, estimator):
    chosen = trial_by(Smoothing(smoother, 1.5))
    seen = fitted(chosen, estimator)
    np.testing.assert_allclose(seen, [K, T], rtol=0.03)
    monkeypatch.setattr(by_tuning, "as_observed", lambda stretch: (stretch, None))
    plain = fitted(chosen, estimator)
    assert np.abs(plain / [K, T] - 1.0).max() > 0.1


def test_a_smoothers_motion_needs_no_filter(trial_by):
    (stretch,) = prepare([trial_by(None)], "nomoto1").identify
    same, sight = by_tuning.as_observed(stretch)
    assert same is stretch
    assert sight is None


def test_the_five_state_observer_turns_the_trial(trial_by):
    chosen, default = trial_by(Smoothing("nomoto_eso", 6.0)), trial_by(None)
    assert bandwidths_of(chosen.history) == {"nomoto": 6.0}
    for name in ("x", "y"):
        np.testing.assert_array_equal(chosen.states[name], default.states[name])
    assert not np.allclose(chosen.states["r"], default.states["r"], atol=1e-4)
    late = chosen.states["t"] > 5.0
    error = (chosen.states["r"] - default.states["r"])[late]
    assert np.std(error) < 0.1 * np.std(default.states["r"])
    own = trial_by(Smoothing("nomoto_eso"))
    assert np.sqrt(np.mean((error / chosen.states["sigma_r"][late]) ** 2)) < 2.0
    assert bandwidths_of(own.history)["nomoto"] > 1.0


def test_what_the_five_state_observer_shows_is_the_filtered_rate():
    t = np.arange(0.0, 60.0, 0.01)
    r = 0.2 * np.sin(0.7 * t)
    psi = 0.2 / 0.7 * (1.0 - np.cos(0.7 * t))
    shown = observe_nomoto(NomotoObserver(1.2, 0.5), t, psi, 0.0 * t)[:, 1]
    alike = filter_like_rate(1.2, t, r)
    np.testing.assert_allclose(shown[2000:], alike[2000:], atol=1e-5)
    assert np.abs(alike - r)[2000:].max() > 0.02
    np.testing.assert_allclose(filter_like_rate(1.2, t, np.column_stack([r, 2.0 * r]))[:, 1], 2.0 * alike)


def test_the_five_state_observers_error_is_as_its_equations_say():
    rng, step, w = np.random.default_rng(1), 0.02, 1.5
    t = np.arange(0.0, 800.0, step)
    noise = observe_nomoto(NomotoObserver(w, 0.5), t, rng.normal(0.0, 1.0, len(t)), 0.0 * t)[2000:]
    expected = step * np.diag(error_covariances(w)[0])
    np.testing.assert_allclose(np.var(noise[:, [0, 1, 3]], axis=0), expected, rtol=0.2)
    jerk = rng.normal(0.0, 1.0 / np.sqrt(step), len(t))
    chain = [np.cumsum(jerk) * step]
    for _ in range(2):
        chain.append(np.cumsum(chain[-1]) * step)
    seen = observe_nomoto(NomotoObserver(w, 0.5), t, chain[-1], 0.0 * t)
    behind = (seen[:, [0, 1, 3]] - np.column_stack(chain[::-1]))[2000:]
    np.testing.assert_allclose(np.var(behind, axis=0), np.diag(error_covariances(w)[1]), rtol=0.35)


def test_a_velocity_that_goes_round_is_shown_whole():
    """An even turn at an even speed: the observer in earth axes shows too much of it, which is known."""
    made = sampled(
        truth_of("catamaran", "circle", 60.0),
        position=Imperfect(20.0, 1e-5, 0.0),
        heading=Imperfect(20.0, 1e-5, 0.0),
    )
    run = LoggedRun("a", made.log, "identify")
    trial = make_trials(
        [run], made.vessel, made.inputs, made.sensors, smoothing=Smoothing("eso", 3.0), by_response=False
    )[0]
    s = trial.states[trial.states["t"] > 40.0]
    speed = np.hypot(s["u"], s["v"]).mean()
    true = np.hypot(made.truth.u, made.truth.v)[made.truth.t > 40.0].mean()
    r = made.truth.r[-500:].mean()
    raw = observe(Observer(3.0), made.truth.t[::5], np.column_stack([made.truth.x, made.truth.y])[::5])[:, 1]
    assert abs(r) > 0.2
    assert np.hypot(*raw[-200:].T).mean() > 1.015 * true
    assert speed == pytest.approx(true, rel=2e-3)


def test_a_nomoto_observer_needs_a_nomoto_model(tmp_path):
    (tmp_path / "a.csv").write_text("t,x\n0,0\n")
    vessel = '[vessel]\nname = "boat"\nlength = 1.0\nbeam = 0.3\n'
    head = f'{vessel}[inputs.rudder]\nkind = "rudder"\nsignal = "x"\nunit = "rad"\n'
    tail = '[preprocess]\nsmoother = "nomoto_eso"\nbandwidth = 2.0\n[[log]]\npath = "a.csv"\n'
    (tmp_path / "campaign.toml").write_text(f'{head}[model]\nname = "nomoto2"\n{tail}')
    assert load_campaign(tmp_path).smoothing == Smoothing("nomoto_eso", 2.0)
    (tmp_path / "campaign.toml").write_text(head + tail)
    with pytest.raises(CampaignError, match="Nomoto model"):
        load_campaign(tmp_path)
