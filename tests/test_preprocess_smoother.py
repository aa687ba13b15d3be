"""The smoother against a dense oracle, the truth, and itself with the truth's noise levels."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from preprocess_samples import Imperfect, at, sampled, truth_of

from preprocess.chains import Stream, assemble, variances
from preprocess.descent import minimum
from preprocess.kalman import Rows, cost, smooth
from preprocess.likelihood import costs
from preprocess.run_of_log import LoggedRun
from preprocess.smoother import smooth_chain
from preprocess.trials import make_trials


def rows_of(t, order, value, sigma):
    n = len(t)
    fresh = np.zeros(n, bool)
    fresh[0] = True
    return Rows(t, np.asarray(order, np.int64), value[:, None], np.full(n, sigma**2), fresh, np.ones(n))


def dense(t, order, value, sigma, q, prior):
    """The same posterior by one large Gaussian: mean, covariance, -2 log likelihood."""
    n = len(t)
    cov = np.zeros((3 * n, 3 * n))
    state = np.diag(prior)
    for i in range(n):
        if i:
            d = t[i] - t[i - 1]
            f = np.array([[1, d, d * d / 2], [0, 1, d], [0, 0, 1]])
            noise = q * np.array(
                [[d**5 / 20, d**4 / 8, d**3 / 6], [d**4 / 8, d**3 / 3, d**2 / 2], [d**3 / 6, d**2 / 2, d]]
            )
            state = f @ state @ f.T + noise
            cov[3 * i : 3 * i + 3, : 3 * i] = f @ cov[3 * i - 3 : 3 * i, : 3 * i]
            cov[: 3 * i, 3 * i : 3 * i + 3] = cov[3 * i : 3 * i + 3, : 3 * i].T
        cov[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = state
    mean = np.tile([value[np.flatnonzero(np.array(order) == 0)[0]], 0.0, 0.0], n)
    for i in range(1, n):
        mean[3 * i] = mean[0]
    used = [i for i in range(n) if order[i] >= 0]
    h = np.zeros((len(used), 3 * n))
    for k, i in enumerate(used):
        h[k, 3 * i + order[i]] = 1.0
    s = h @ cov @ h.T + sigma**2 * np.eye(len(used))
    e = value[used] - h @ mean
    gain = cov @ h.T @ np.linalg.inv(s)
    likelihood = np.linalg.slogdet(s)[1] + e @ np.linalg.solve(s, e)
    return (mean + gain @ e).reshape(n, 3), cov - gain @ h @ cov, likelihood


@pytest.fixture
def chain():
    rng = np.random.default_rng(4)
    t = np.sort(rng.uniform(0.0, 6.0, 25))
    t[7] = t[6]  # two sensors at one time
    order = rng.choice([0, 0, 1, -1], 25)
    order[0] = 0
    return t, list(order), np.where(order == 0, np.sin(t), np.cos(t)) + rng.normal(0.0, 0.1, 25)


def test_smoother_is_the_dense_posterior(chain):
    t, order, value = chain
    prior = np.array([4.0, 2.0, 1.0])
    out = smooth(rows_of(t, order, value, 0.1), 0.5, prior)
    mean, covariance, likelihood = dense(t, order, value, 0.1, 0.5, prior)
    np.testing.assert_allclose(out.mean[:, :, 0], mean, atol=1e-8)
    blocks = np.array([covariance[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(len(t))])
    np.testing.assert_allclose(out.covariance, blocks, atol=1e-8)
    assert cost(rows_of(t, order, value, 0.1), 0.5, prior) == pytest.approx(likelihood, rel=1e-9)


def test_deletion_residual_is_the_smoother_without_the_sample(chain):
    t, order, value = chain
    prior, k = np.array([4.0, 2.0, 1.0]), 10
    order[k] = 0
    out = smooth(rows_of(t, order, value, 0.1), 0.5, prior)
    without = [*order[:k], -1, *order[k + 1 :]]
    left = smooth(rows_of(t, without, value, 0.1), 0.5, prior)
    assert out.deletion[k, 0] == pytest.approx(value[k] - left.mean[k, 0, 0], abs=1e-9)
    assert out.deletion_variance[k] == pytest.approx(left.covariance[k, 0, 0] + 0.01, rel=1e-9)


def rmse(trial, truth, name):
    states = trial.states.dropna()
    if name.startswith("d"):
        reference = np.interp(states["t"], truth.t, np.gradient(getattr(truth, name[1:]), truth.t))
    else:
        reference = at(truth, states["t"], name)
    return float(np.sqrt(np.mean((states[name] - reference) ** 2)))


SENSORS = {
    "position": Imperfect(5.0, 0.02, lost=0.1),
    "heading": Imperfect(10.0, 0.01),
    "yaw_rate": Imperfect(20.0, 0.003),
}


def trial_of(vessel="usv", manoeuvre="zigzag", seed=0, antenna=(0.0, 0.0), **sensors):
    truth = truth_of(vessel, manoeuvre, 120.0, seed)
    made = sampled(truth, seed, antenna=antenna, **(sensors or SENSORS))
    (trial,) = make_trials(
        [LoggedRun("a.csv", made.log, "identify")], made.vessel, made.inputs, made.sensors, by_response=False
    )
    return truth, trial


@pytest.mark.parametrize("vessel", ["usv", "catamaran", "tanker"])
def test_noise_levels_are_recovered(vessel):
    _, trial = trial_of(vessel)
    for name, sensor in SENSORS.items():
        assert trial.measurements[name].sigma == pytest.approx(sensor.sigma, rel=0.12), name


@pytest.mark.parametrize("vessel", ["usv", "tanker"])
def test_estimated_levels_cost_little_against_given_ones(vessel):
    truth, trial = trial_of(vessel)
    segments, wanted = trial.segments, trial.states["t"].to_numpy()

    def streams(names):
        for order, name in enumerate(names):
            m = trial.measurements[name]
            value = m.value if m.value.ndim == 2 else m.value[:, None]
            everything = np.ones(len(m.t), bool)
            yield Stream(name, m.t, value, order, everything, everything, sigma=SENSORS[name].sigma)

    given = smooth_chain(tuple(streams(["heading", "yaw_rate"])), segments, wanted)
    reference = at(truth, wanted, "r")
    inside = np.isfinite(given.mean[:, 1, 0])
    best = np.sqrt(np.mean((given.mean[inside, 1, 0] - reference[inside]) ** 2))
    assert rmse(trial, truth, "r") < 1.10 * best


def test_velocities_are_close_and_honest_about_their_error():
    truth, trial = trial_of()
    assert rmse(trial, truth, "u") < 0.03
    assert rmse(trial, truth, "v") < 0.03
    assert rmse(trial, truth, "r") < 0.002
    for name in ("u", "v", "r"):
        error = trial.states[name] - at(truth, trial.states["t"], name)
        within = (np.abs(error) < 2.5 * trial.states[f"sigma_{name}"]).mean()
        assert within > 0.9, name


def test_antenna_is_moved_to_the_origin():
    truth, trial = trial_of(antenna=(1.2, -0.5))
    assert rmse(trial, truth, "v") < 0.03
    assert rmse(trial, truth, "x") < 0.02


def test_works_on_positions_and_heading_alone_and_says_what_is_missing():
    truth, trial = trial_of(position=Imperfect(5.0, 0.02), heading=Imperfect(10.0, 0.01))
    assert rmse(trial, truth, "r") < 0.02
    assert any("yaw rate" in f for f in trial.findings)


def test_velocity_sensor_helps():
    plain = rmse(*trial_of(position=Imperfect(5.0, 0.2), heading=Imperfect(10.0, 0.005))[::-1], "u")
    more = {
        "position": Imperfect(5.0, 0.2),
        "heading": Imperfect(10.0, 0.005),
        "velocity": Imperfect(5.0, 0.02),
    }
    assert rmse(*trial_of(**more)[::-1], "u") < 0.5 * plain


def test_accelerations_are_the_derivatives_of_the_body_velocities():
    truth, trial = trial_of("usv")
    for name in ("du", "dv", "dr"):
        spread = np.std(np.gradient(getattr(truth, name[1:]), truth.t))
        assert rmse(trial, truth, name) < 0.6 * spread, name


def test_blank_rows_change_nothing():
    t = np.arange(0.0, 10.0, 0.5)
    value = np.sin(t)[:, None]
    everything = np.ones(len(t), bool)
    stream = (Stream("heading", t, value, 0, everything, everything, sigma=0.1),)
    prior = np.ones(3)
    few, many = (assemble(stream, ((0.0, 10.0),), w) for w in (t, np.arange(0.0, 9.5, 0.1)))
    outs = []
    for a in (few, many):
        rows = Rows(
            a.rows.t,
            a.rows.order,
            a.rows.value,
            variances(a.stream, np.array([0.1])),
            a.rows.fresh,
            a.rows.scale,
        )
        outs.append(smooth(rows, 0.3, prior).mean[a.stream == 0])
    np.testing.assert_allclose(outs[0], outs[1], atol=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(1, 19))
@settings(max_examples=20, deadline=None)
def test_likelihoods_abreast_are_those_of_one_after_the_other(seed, count):
    rng = np.random.default_rng(seed)
    n = 120
    t, fresh = np.sort(rng.uniform(0.0, 30.0, n)), rng.random(n) < 0.03
    fresh[0] = True
    value = np.cumsum(rng.normal(size=(n, 2)), axis=0)
    rows = Rows(t, rng.integers(-1, 3, n), value, rng.uniform(0.1, 1.0, n), fresh, np.ones(n))
    q, prior = np.exp(rng.normal(size=count)), np.array([1e4, 1e2, 1e2])
    variance, scale = rng.uniform(0.01, 2.0, (n, count)), rng.uniform(0.1, 9.0, (n, count))
    single = [
        cost(replace(rows, variance=variance[:, k], scale=scale[:, k]), float(q[k]), prior)
        for k in range(count)
    ]
    assert costs(rows, q, prior, variance, scale) == pytest.approx(np.array(single), rel=1e-9)
    alike = [cost(rows, float(x), prior) for x in q]
    assert costs(rows, q, prior) == pytest.approx(np.array(alike), rel=1e-9)


def test_the_least_of_a_curved_valley_is_found_from_afar():
    def valley(x):
        return 100.0 * (x[:, 1] - 0.3 * x[:, 0] ** 2) ** 2 + 20.0 * (x[:, 0] - 2.0) ** 2

    value, x = minimum(valley, np.array([-3.0, 5.0]))
    assert value < 0.01
    assert x == pytest.approx([2.0, 1.2], abs=0.03)


def test_a_long_log_that_turns_steadily_but_for_two_short_steps_is_not_smoothed_to_a_straight_line():
    """Levels are estimated on blocks of a long log, and neither step is in one of them."""
    rng = np.random.default_rng(8)
    duration = 760.0
    fine = np.arange(0.0, duration, 0.01)
    rate = np.interp(
        fine, [0.0, 72.0, 90.0, 480.0, 495.0, duration], [0.0, 0.0, -0.028, -0.028, -0.015, -0.015]
    )
    angle = np.cumsum(rate) * 0.01

    def stream(name, hertz, order, signal, noise):
        t = np.arange(0.0, duration - 0.1, 1.0 / hertz)
        value = np.interp(t, fine, signal) + rng.normal(0.0, noise, len(t))
        used = np.ones(len(t), bool)
        return Stream(name, t, value[:, None], order, used, used)

    streams = (
        stream("heading", 10.0, 0, angle, 0.004),
        stream("yaw_rate", 20.0, 1, rate, 0.0008),
    )
    wanted = np.arange(1.0, duration - 1.0, 1.0)
    found = smooth_chain(streams, ((0.0, duration - 0.2),), wanted)
    off = found.mean[:, 1, 0] - np.interp(wanted, fine, rate)
    assert np.sqrt(np.mean(off**2)) < 2e-4
    assert np.abs(found.mean[:, 0, 0] - np.interp(wanted, fine, angle)).max() < 0.01
