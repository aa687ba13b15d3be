"""What known waves leave open in predictions is what waves do to them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of
from scipy.linalg import expm

from identify.base_fit import fit_from_scratch
from identify.innovations import filter_of, new_in, since_used
from identify.kernel import HEADING, POSITION, VELOCITY, YAW_RATE
from identify.prepare import prepare
from identify.swell import RESONANCE, Swell, path_of
from identify.windows import cut
from validate import swell as module
from validate.swell import in_swell

SWELL = Swell(1.7, 0.1, (0.05, 0.08, 0.02), arm=(0.4, -0.3), damping=(0.1, 0.4, 0.6))
#: What each stream's noise is, in the order of the kinds.
NOISE = np.array([0.05, 0.002, 0.002, 0.01])
H, LONG, LEAD = 0.02, 40.0, 400.0


def swung(swell, rng):
    """Velocities u, v, r (n, 3) that waves make: resonances that white noise drives, and what slow pushes leave.

    The second (3,) is where the resonances begin: a fit's first states take that.
    """
    n, g, w = round(LONG / H) + 1, swell.spread, swell.frequency
    long = round(LEAD / H)
    step = expm(np.array([[0.0, 1.0], [-(w**2), -2.0 * g]]) * H)
    out, begin = np.zeros((n, 3)), np.zeros(3)
    for k, motion in enumerate(swell.motion):
        first, second, made = np.zeros(2), np.zeros(2), np.zeros((long + n, 2))
        for i, white in enumerate(rng.standard_normal(long + n)):
            made[i] = second
            second = step @ second + [0.0, H * first[1]]
            first = step @ first + [0.0, white]
        made *= motion / made[:, 1].std()
        begin[k] = made[long, 0]
        pushed, pushes = 0.0, np.sqrt(4.0 * RESONANCE * g * swell.skirt) * motion
        for i in range(n):
            out[i, k] = made[long + i, 1] + pushed
            pushed += -swell.damping[k] * pushed * H + pushes * np.sqrt(H) * rng.standard_normal()
    return out, begin


def motion_of(steady, more, begin):
    """States (n, 6) of a vessel at velocities u, v, r and what waves add, so far displaced as it begins."""
    u, v, r = (steady + more).T
    psi = 0.3 + begin[2] + summed(r)
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    c, s = np.cos(psi[0]), np.sin(psi[0])
    x, y = c * begin[0] - s * begin[1] + summed(north), s * begin[0] + c * begin[1] + summed(east)
    return np.column_stack([x, y, psi, u, v, r])


def summed(rate):
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * H])


def shown(states, i, kind, arm):
    """What a sensor shows (2,) at a step."""
    x, y, psi, u, v, r = states[i]
    c, s = np.cos(psi), np.sin(psi)
    ahead, aside = c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]
    return {
        POSITION: (x + ahead, y + aside), HEADING: (psi, 0.0), YAW_RATE: (r, 0.0),
        VELOCITY: (u * c - v * s - r * aside, u * s + v * c + r * ahead),
    }[kind]  # fmt: skip


@pytest.mark.parametrize("skirt", [0.0, 1.0])
@pytest.mark.parametrize("rate", [0.0, 0.15])
def test_what_is_left_of_a_vessel_in_waves_is_white(skirt, rate):
    """However it turns: errors of every sensor, all of a window's own, are those of the sensors' noise."""
    swell, rng = replace(SWELL, skirt=skirt), np.random.default_rng(7)
    n = round(LONG / H) + 1
    steady = np.tile([1.5, 0.1, rate], (n, 1))
    quiet = motion_of(steady, np.zeros((n, 3)), np.zeros(3))
    places = np.sort(rng.choice(np.arange(5, n), 700, replace=False))
    kind = rng.integers(0, 4, len(places))
    t, sigma = places * H, NOISE[kind]
    since = since_used(t, np.ones(len(t), dtype=bool))
    path = path_of(t, since, H * np.arange(n), quiet)
    known = filter_of(
        swell.process(since, kind, path), sigma, np.ones(len(t), dtype=bool), [slice(0, len(t))]
    )
    left = []
    for _ in range(6):
        moved = motion_of(steady, *swung(swell, rng))
        error = np.array([
            np.subtract(shown(moved, i, k, swell.arm), shown(quiet, i, k, swell.arm))
            for i, k in zip(places, kind, strict=True)
        ])  # fmt: skip
        both = np.isin(kind, [POSITION, VELOCITY])[:, None] | (np.arange(2) == 0)
        error = error / sigma[:, None] + rng.standard_normal(error.shape) * both
        left.append(new_in(known, slice(0, len(t)), error[:, :, None])[:, :, 0])
    left = np.array(left)[:, 30:]  # the first states of a fit take what there is at the begin
    kind = kind[30:]
    for k in range(4):
        assert np.mean(left[:, kind == k, 0] ** 2) == pytest.approx(1.0, abs=0.15)
    heading = left[:, kind == HEADING, 0]
    assert abs(np.mean(heading[:, 1:] * heading[:, :-1])) < 0.1


def test_a_window_varies_by_the_band_and_what_slow_pushes_add_up_to():
    assert SWELL.variance(30.0) == pytest.approx(np.square(SWELL.motion))
    pushed = replace(SWELL, skirt=1.0, damping=(0.0, 50.0, 0.6)).variance(30.0) - np.square(SWELL.motion)
    assert pushed[0] == pytest.approx(SWELL.motion[0] ** 2 * 4.0 * RESONANCE * SWELL.spread * 15.0, rel=0.01)
    assert pushed[1] == pytest.approx(SWELL.motion[1] ** 2 * 4.0 * RESONANCE * SWELL.spread / 100.0, rel=0.02)


def test_nothing_is_taken_off_where_no_waves_are_known():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 3, ())
    stretches = prepare(trials, ship.model).identify
    calm, rough = (cut(in_swell(stretches, s), 20.0) for s in (None, SWELL))
    assert not calm.hides
    assert rough.hides
    errors = np.ones((calm.windows[0].samples.stop, 2))
    assert calm.less_known(calm.windows[0], errors) is not None
    assert np.array_equal(calm.less_known(calm.windows[0], errors), errors)
    assert not np.allclose(rough.less_known(rough.windows[0], errors), errors)


@pytest.mark.parametrize(
    ("away", "starts", "anew"), [(False, True, False), (True, True, True), (True, False, False)]
)
def test_waves_beside_a_fit_that_ran_away_are_seen_again_beside_one_from_scratch(
    monkeypatch, away, starts, anew
):
    """Its errors make a band so wide that nothing else is left to be seen."""
    waves = SimpleNamespace(swell="wide", stretches=(), length=30.0)
    found, begun = SimpleNamespace(problem=waves, runs_away=away), SimpleNamespace(problem=waves)
    monkeypatch.setattr(module, "hardly_seen", lambda _: False)
    monkeypatch.setattr(module, "_begun_anew", lambda _: begun)
    monkeypatch.setattr(module, "tried", lambda way: way() if starts else None)
    monkeypatch.setattr(module, "with_waves_known", lambda fitted: ("seen beside", fitted))
    assert module._seen_again(found) == (("seen beside", begun) if anew else found)


def test_a_fit_from_scratch_in_known_waves_has_them_and_its_windows():
    ship, trials = trials_of("usv", ("zigzag", "random"), 40.0, 5, ())
    prepared = prepare(trials, ship.model)
    calm = fit_from_scratch(prepared.structure, prepared.identify, length=20.0)
    found = replace(calm, problem=replace(calm.problem, stretches=in_swell(calm.problem.stretches, SWELL)))
    begun = module._begun_anew(found)
    assert (begun.problem.swell, begun.problem.length) == (SWELL, 20.0)
    assert np.isfinite(begun.solution.cost)


@pytest.mark.parametrize(
    ("far", "chi2", "anew"), [(True, 40.0, True), (True, 60.0, False), (False, 1.0, False)]
)
def test_waves_that_led_a_far_fit_to_a_nearer_valley_are_seen_anew_from_there(monkeypatch, far, chi2, anew):
    """A fit that ran away may show anything that swings; what it was taken for would hide a current."""
    fitted, bare = SimpleNamespace(is_far=far, chi2_per_dof=100.0), SimpleNamespace(chi2_per_dof=chi2)
    monkeypatch.setattr(module, "without_waves", lambda _: bare)
    monkeypatch.setattr(module, "with_waves_known", lambda fit: ("anew", fit))
    monkeypatch.setattr(module, "_seen_again", lambda found: ("again", found))
    expected = ("anew", bare) if anew else ("again", "found")
    assert module._from_where_it_led(fitted, "found") == expected


@pytest.mark.parametrize(
    ("off", "off_without", "kept"), [(False, True, True), (False, False, False), (True, True, False)]
)
def test_waves_are_not_forgotten_where_a_fit_at_the_noise_leaves_it_without_them(
    monkeypatch, off, off_without, kept
):
    """Beside a false clock their band was seen no more, and the fit was thirteen times the noise without."""
    fitted, without = (
        SimpleNamespace(problem=SimpleNamespace(swell=SWELL), is_off=o, chi2_per_dof=1.0)
        for o in (off, off_without)
    )
    bare = SimpleNamespace(swell=None)
    stubs = {"_in_usual_windows": lambda f: f, "_shown": lambda _: None, "_would_show": lambda *_: True}
    stubs |= {"_with_likeliest_shape": lambda *_: bare, "knowing": lambda *_: without}
    for name, stub in stubs.items():
        monkeypatch.setattr(module, name, stub)
    assert module.with_waves_known(fitted) is (fitted if kept else without)
