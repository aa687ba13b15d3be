"""The papers' observers against independent solutions; the weak form against exact integrals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from preprocess_samples import Imperfect, at, sample, truth_of
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from preprocess.ekf import Tuning, filter_motion
from preprocess.eso import Observer, filter_like, observe, tune
from preprocess.linear_observer import run_linear
from preprocess.nomoto_eso import NomotoObserver, filter_rudder, gains, matrices, observe_nomoto
from preprocess.weak_form import bump, quadrature_weights, weak_form

RNG = np.random.default_rng(0)
T = np.sort(RNG.uniform(0.0, 20.0, 800))
Y = np.sin(0.5 * T) + 0.3 * np.sin(1.7 * T)
DY = 0.5 * np.cos(0.5 * T) + 0.51 * np.cos(1.7 * T)


def test_eso_solves_its_equation_at_uneven_times():
    w = 4.0
    a = np.array([[-3 * w, 1, 0], [-3 * w * w, 0, 1], [-(w**3), 0, 0]])
    gain = np.array([3 * w, 3 * w * w, w**3])

    def between(t, x, k):  # the measurement is a line from one sample to the next
        y = Y[k] + (Y[k + 1] - Y[k]) * (t - T[k]) / (T[k + 1] - T[k])
        return a @ x + gain * y

    few = T < 5.0
    solved = [np.array([Y[0], 0.0, 0.0])]
    for k in range(few.sum() - 1):
        step = solve_ivp(between, T[k : k + 2], solved[-1], args=(k,), rtol=1e-8, atol=1e-10)
        solved.append(step.y[:, -1])
    np.testing.assert_allclose(observe(Observer(w), T, Y)[few], solved, atol=1e-6)


def test_the_filtered_derivative_is_what_the_observer_shows():
    t = np.arange(0.0, 40.0, 0.02)
    y, dy = np.sin(0.5 * t) + 0.3 * np.sin(1.7 * t), 0.5 * np.cos(0.5 * t) + 0.51 * np.cos(1.7 * t)
    shown, filtered = observe(Observer(3.0), t, y)[:, 1], filter_like(Observer(3.0), t, dy)
    settled = t > 8.0
    assert np.abs(shown - filtered)[settled].max() < 2e-4
    assert (
        np.abs(shown - dy)[settled].max() > 0.1
    )  # the lag that biases a regression on unfiltered regressors


@given(st.floats(0.1, 20.0), st.floats(-3.0, 3.0), st.floats(-2.0, 2.0))
@settings(max_examples=30, deadline=None)
def test_a_ramp_is_followed_without_error(bandwidth, level, slope):
    out = observe(
        Observer(bandwidth), T, level + slope * T, np.array([[level + slope * T[0]], [slope], [0.0]])
    )
    np.testing.assert_allclose(out[:, 0], level + slope * T, atol=1e-8)
    np.testing.assert_allclose(out[:, 1], slope, atol=1e-7)


def test_filter_keeps_constants_and_shape():
    constant = np.full((len(T), 2), [3.0, -1.0])
    np.testing.assert_allclose(filter_like(Observer(2.0), T, constant), constant)
    assert filter_like(Observer(2.0), T, Y).shape == Y.shape


def test_tuning_follows_the_noise():
    rng = np.random.default_rng(1)
    quiet, loud = (tune(T, Y + rng.normal(0.0, s, len(T))) for s in (0.005, 0.1))
    assert loud.bandwidth < quiet.bandwidth
    left = Y - observe(quiet, T, Y)[:, 0]
    assert np.sqrt(np.mean(left**2)) < 0.02


def test_linear_observer_is_the_matrix_exponential():
    a, b = np.array([[0.0, 1.0], [-2.0, -0.3]]), np.array([[0.0], [1.0]])
    t = np.array([0.0, 0.7, 1.0, 4.5])
    out = run_linear(t, np.full((4, 1), 3.0), a, b, np.array([1.0, 0.0]))
    rest = np.linalg.solve(a, -b[:, 0] * 3.0)
    expected = [rest + expm(a * x) @ (np.array([1.0, 0.0]) - rest) for x in t]
    np.testing.assert_allclose(out, expected, atol=1e-10)


def test_nomoto_observer_is_stable_with_the_poles_asked_for():
    a, _ = matrices(NomotoObserver(2.0, 2.5))
    poles = np.sort(np.linalg.eigvals(a).real)
    assert poles.max() < 0.0
    assert poles[-1] == pytest.approx(-0.4, abs=0.01)
    np.testing.assert_allclose(gains(np.array([-1.0, -2.0, -3.0, -4.0])), [10.0, 35.0, 50.0, 24.0])


def test_nomoto_parameters_come_out_exactly_with_both_sides_filtered():
    k, t1, t2, t3, gear = 0.19, 6.0, 45.0, 12.0, 2.5

    def command(t):
        return 0.3 * np.sin(0.05 * t) + 0.1 * np.sin(0.4 * t) + 0.1 * np.sin(0.17 * t)

    def motion(t, x):
        rate = (command(t) - x[3]) / gear
        return [x[1], x[2], (k * (t3 * rate + x[3]) - (t1 + t2) * x[2] - x[1]) / (t1 * t2), rate]

    t = np.arange(0.0, 400.0, 0.05)
    x = solve_ivp(motion, (0.0, 400.0), np.zeros(4), t_eval=t, rtol=1e-9, atol=1e-12, max_step=0.2).y
    observer = NomotoObserver(3.0, gear)
    z = observe_nomoto(observer, t, x[0], command(t))
    rudder, rudder_rate = filter_rudder(observer, t, x[3])
    columns = [filter_rudder(observer, t, s)[0] for s in (x[2], x[1])]
    c = np.linalg.lstsq(np.column_stack([*columns, rudder_rate, rudder])[400:], z[400:, 4], rcond=None)[0]
    product = -1.0 / c[1]
    np.testing.assert_allclose(
        [product, -c[0] * product, c[3] * product, c[2] / c[3]], [270.0, 51.0, k, t3], rtol=1e-3
    )


@pytest.mark.parametrize(("rule", "tolerance"), [("trapezoid", 2e-2), ("simpson", 2e-3)])
def test_weak_form_integrates_by_parts_at_uneven_times(rule, tolerance):
    form = weak_form(T, 1.0, rule=rule)
    fine = np.linspace(0.0, 20.0, 40001)
    exact = [
        np.trapezoid(bump(fine - c, 4)[0] * (0.5 * np.cos(0.5 * fine) + 0.51 * np.cos(1.7 * fine)), fine)
        for c in form.centres
    ]
    np.testing.assert_allclose(-(form.derivatives @ Y), exact, atol=tolerance)
    np.testing.assert_allclose(form.values @ DY, exact, atol=tolerance)


@given(st.integers(3, 60), st.integers(0, 10_000))
@settings(max_examples=50, deadline=None)
def test_quadrature_is_exact_for_parabolas_up_to_averaging(count, seed):
    t = np.cumsum(np.random.default_rng(seed).uniform(0.1, 1.0, count))
    weights = quadrature_weights(t)
    for power in (0, 1, 2):
        exact = (t[-1] ** (power + 1) - t[0] ** (power + 1)) / (power + 1)
        assert weights @ t**power == pytest.approx(exact, rel=1e-9, abs=1e-9)


def test_a_stretch_shorter_than_a_window_is_refused():
    with pytest.raises(ValueError, match="shorter than one window"):
        weak_form(np.linspace(0.0, 1.0, 50), 1.0)


def test_ekf_follows_the_motion():
    truth = truth_of("usv", "zigzag", 60.0)
    rng = np.random.default_rng(0)
    of = {
        "position": lambda t: (at(truth, t, "x"), at(truth, t, "y")),
        "heading": lambda t: (at(truth, t, "psi"),),
        "yaw_rate": lambda t: (at(truth, t, "r"),),
    }
    rates = {
        "position": Imperfect(5.0, 0.02),
        "heading": Imperfect(10.0, 0.01),
        "yaw_rate": Imperfect(20.0, 0.003),
    }
    p, h, r = (sample(rng, rates[k], 60.0, of[k])[:2] for k in of)
    tuning = Tuning(0.01, 0.05, 0.05, 0.02, 0.01, 0.003)
    t, state = filter_motion(p, (h[0], h[1][:, 0]), (r[0], r[1][:, 0]), tuning)
    late = t > 10.0
    for k, name, limit in ((3, "u", 0.08), (4, "v", 0.1), (5, "r", 0.01)):
        assert np.sqrt(np.mean((state[late, k] - at(truth, t[late], name)) ** 2)) < limit, name
