"""Errors of the position that wander: the smoother beside a dense posterior, and what is found of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled, truth_of
from scipy.linalg import block_diag

from fixtures.vessels import make_vessel
from preprocess import wander
from preprocess.kalman import Rows, cost, smooth
from preprocess.levels import Levels
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.wander_kalman import Wander, smooth_with_wander, wander_cost


def transition(dt, wander, q):
    keep = np.exp(-dt / wander.time)
    f = block_diag([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]], keep)
    noise = q * np.array(
        [
            [dt**5 / 20, dt**4 / 8, dt**3 / 6],
            [dt**4 / 8, dt**3 / 3, dt**2 / 2],
            [dt**3 / 6, dt**2 / 2, dt],
        ]
    )
    return f, block_diag(noise, wander.sigma**2 * (1.0 - keep**2))


def chain(n=25, seed=0):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.1, 0.5, n))
    order = rng.choice([0, 0, 1, -1], n).astype(np.int64)
    order[0] = 0
    value, variance = rng.normal(0.0, 1.0, (n, 2)), rng.uniform(0.1, 0.3, n)
    return Rows(t, order, value, variance, np.arange(n) == 0, np.ones(n))


def test_smoother_is_the_dense_posterior():
    rows, wander, q = chain(), Wander(0.4, 3.0), 0.5
    prior = np.array([4.0, 1.0, 1.0])
    n = len(rows.t)
    first = np.diag([*prior, wander.sigma**2])
    joint, step = np.zeros((4 * n, 4 * n)), np.eye(4 * n)
    joint[:4, :4] = first
    for i in range(1, n):
        f, noise = transition(rows.t[i] - rows.t[i - 1], wander, q)
        step[4 * i : 4 * i + 4] = 0.0
        step[4 * i : 4 * i + 4, : 4 * i] = f @ step[4 * i - 4 : 4 * i, : 4 * i]
        step[4 * i : 4 * i + 4, 4 * i : 4 * i + 4] = np.eye(4)
        joint[4 * i : 4 * i + 4, 4 * i : 4 * i + 4] = noise
    covariance = step @ joint @ step.T
    start = np.zeros((4 * n, 2))
    start[:4] = np.vstack([rows.value[:1], np.zeros((3, 2))])
    mean = step @ start
    h = np.zeros((n, 4 * n))
    for i, o in enumerate(rows.order):
        h[i, 4 * i + max(o, 0)] = 1.0
        h[i, 4 * i + 3] = float(o == 0)
    h, used = h[rows.order >= 0], rows.order >= 0
    s = h @ covariance @ h.T + np.diag(rows.variance[used])
    gain = np.linalg.solve(s, h @ covariance).T
    innovation = rows.value[used] - h @ mean
    expected = (mean + gain @ innovation).reshape(n, 4, 2)
    posterior = covariance - gain @ h @ covariance
    found, spread = smooth_with_wander(rows, q, prior, wander)
    np.testing.assert_allclose(found, expected, atol=1e-8)
    blocks = np.stack([posterior[4 * i : 4 * i + 4, 4 * i : 4 * i + 4] for i in range(n)])
    np.testing.assert_allclose(spread, blocks, atol=1e-8)
    deviance = 2 * np.linalg.slogdet(s)[1] + np.sum(innovation * np.linalg.solve(s, innovation))
    assert wander_cost(rows, q, prior, wander) == pytest.approx(deviance, rel=1e-9)


def test_without_wander_it_is_the_plain_smoother():
    rows, prior = chain(60, 1), np.array([1e-3, 1e-2, 1.0])
    plain = smooth(rows, 0.5, prior)
    found, spread = smooth_with_wander(rows, 0.5, prior, Wander(1e-9, 10.0))
    # the two begin a stretch differently: late in it nothing is left of that
    np.testing.assert_allclose(found[-1, :3], plain.mean[-1], rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(spread[-1, :3, :3], plain.covariance[-1], rtol=1e-3, atol=1e-6)
    assert np.isfinite(cost(rows, 0.5, prior))


def wandering(vessel, manoeuvre, level, seed, **more):
    """A trial of 120 s whose positions wander by ``level`` m rms over 90 s beside 0.02 m of white noise."""
    sensors = {"position": Imperfect(5.0, 0.02), "heading": Imperfect(10.0, 0.01)}
    sensors |= {"yaw_rate": Imperfect(10.0, 0.003)} | more
    made = sampled(truth_of(vessel, manoeuvre, 120.0, seed), seed, **sensors)
    t = made.log.tables["position"].index.to_numpy() * 1e-9
    rng, keep = np.random.default_rng(seed + 50), np.exp(-np.diff(t) / 90.0)
    walk = np.zeros((len(t), 2))
    walk[0] = level * rng.standard_normal(2)
    for i, k in enumerate(keep):
        walk[i + 1] = k * walk[i] + level * np.sqrt(1.0 - k * k) * rng.standard_normal(2)
    made.log.tables["position"] += walk
    run = LoggedRun("a", made.log, "identify")
    return make_trials([run], made.vessel, made.inputs, made.sensors, by_response=False)[0], made.truth


@pytest.mark.parametrize(
    ("vessel", "manoeuvre", "more"),
    [("tanker", "zigzag", {}), ("patrol", "random", {"velocity": Imperfect(5.0, 0.05)})],
)
def test_a_wander_is_found_apart_from_white_noise(vessel, manoeuvre, more):
    error, level = [], 0.03 * make_vessel(vessel).length
    for seed in range(2):
        trial, truth = wandering(vessel, manoeuvre, level, seed, **more)
        m, s = trial.measurements["position"], trial.states
        assert m.sigma == pytest.approx(0.02, rel=0.08)
        # what it does within seconds is known, its level and time only together
        walk = m.wander * np.sqrt(2.0 / m.correlation_time)
        assert walk == pytest.approx(level * np.sqrt(2.0 / 90.0), rel=0.35)
        assert any("wander" in f for f in trial.findings)
        keep = (s["t"] > 5.0) & (s["t"] < 115.0)
        for name in ("u", "v"):
            e = (s[name] - np.interp(s["t"], truth.t, getattr(truth, name))) / s[f"sigma_{name}"]
            error.append(np.mean(e[keep] ** 2))
    assert np.sqrt(np.mean(error)) < 1.4


@pytest.mark.parametrize(("vessel", "manoeuvre"), [("tanker", "zigzag"), ("usv", "random")])
def test_white_noise_is_not_called_a_wander(vessel, manoeuvre):
    for seed in range(2):
        trial, _ = wandering(vessel, manoeuvre, 0.0, seed)
        assert trial.measurements["position"].correlation_time == 0.0
        assert trial.measurements["position"].sigma == pytest.approx(0.02, rel=0.08)


@pytest.mark.parametrize(("size", "there"), [(6e-35, False), (0.01, True)])
def test_a_wander_of_no_size_is_none(monkeypatch, size, there):
    """The search found better levels of the rest instead."""

    def found(rows, stream, prior, start, time):
        sigma = np.log(np.full(len(start) - 1 - (time is not None), 0.02))
        return (0.0, np.r_[0.0, sigma]) if time is None else (-50.0, np.r_[0.0, sigma, np.log(size)])

    monkeypatch.setattr(wander, "_search", found)
    rows = chain()
    stream = np.zeros(len(rows.t), np.int64)
    track = SimpleNamespace(streams=(), drive=None, levels=Levels(1.0, np.array([0.02])), t=rows.t)
    monkeypatch.setattr(wander, "assemble", lambda *_: SimpleNamespace(rows=rows, stream=stream))
    assert (wander.find_wander(track, ((0.0, 10.0),), np.ones(3)) is not None) == there
