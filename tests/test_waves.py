"""Waves are found with their frequency and size; noise, wander and a wrong model are not taken for waves."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect, World, wave_series
from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch, fit_states
from identify.first_states import first_states
from identify.fitted import NEAR, Fitted
from identify.prepare import prepare
from validate import swell
from validate import waves as searched
from validate.error_spectra import TAPERS, _transform, spectra_of
from validate.pace import Pace
from validate.peaks import around_of, core_of
from validate.refits import under
from validate.rounds import rounds
from validate.swell import _in_windows, needs_waves, seen_waves, with_waves_known, without_waves
from validate.wave_band import measured
from validate.waves import (
    _goes_with,
    _grows_with,
    _material,
    _may_be_half,
    as_effect,
    fastest,
    find_waves,
    waves_of,
)

DURATION = 60.0
WAVES = {"frequency": 1.6, "u": 0.12, "v": 0.15, "r": 0.06}
HIGH = {"frequency": 1.5, "u": 0.2, "v": 0.3, "r": 0.12}
WANDERING = replace(Suite(), position=Sensor(5.0, 0.02, 0.004, wander=0.3, wander_time=5.0))


def fitted(
    vessel, effects=(), seed=3, suite=None, manoeuvres=("zigzag", "random", "zigzag", "random")
) -> Fitted:
    ship, trials = trials_of(vessel, manoeuvres, DURATION, seed, effects, suite=suite)
    prepared = prepare(trials, ship.model)
    return fit_from_scratch(prepared.structure, prepared.identify, rounds=1)


@cache
def clean() -> Fitted:
    return fitted("usv")


@cache
def in_waves(seed=3, **waves) -> Fitted:
    """A fit that knows nothing of the waves that were there."""
    return fitted("usv", (Effect("waves", waves),), seed)


@cache
def waves_known() -> Fitted:
    return with_waves_known(in_waves(**WAVES))


def realised(effect, seed, logs=3):
    """Amplitudes that the drawn components came to in these logs."""
    times = np.arange(0.0, DURATION, 0.05)
    made = [
        wave_series(World((effect,)), k, times, np.random.default_rng([seed, k, 11])) for k in range(logs)
    ]
    return dict(zip("uvr", np.sqrt(2.0 * np.mean([m.var(axis=0) for m in made], axis=0)), strict=True))


def test_none_where_there_are_none():
    assert find_waves(clean()) is None


def test_what_is_sampled_once_a_second_has_no_wave_of_a_second():
    """A receiver's velocity often comes less often than its position."""
    suite = replace(Suite(), velocity=Sensor(1.0, 0.05, 0.0))
    spectra = spectra_of(fitted("usv", suite=suite))
    power = np.mean(np.abs(spectra.rate) ** 2, axis=0)
    places = np.abs(spectra.omega - 2.0 * np.pi) < 1.5 * spectra.spacing
    for channel in range(3):
        level = around_of(spectra, power[:, channel]).level
        assert (power[places, channel] < 3.0 * level[places]).all()


@pytest.mark.slow
@pytest.mark.parametrize("vessel", ["catamaran", "tug"])
def test_none_with_other_vessels(vessel):
    assert find_waves(fitted(vessel, seed=4)) is None


def test_a_wandering_receiver_makes_no_waves():
    assert find_waves(fitted("usv", seed=5, suite=WANDERING)) is None


@pytest.mark.parametrize("vessel", ["usv", pytest.param("tug", marks=pytest.mark.slow)])
def test_a_model_that_answers_wrongly_makes_no_waves(vessel):
    from fixtures.vessels import make_vessel

    names = make_vessel(vessel).names
    lag = [Effect("actuator_lag", {"time_constant": 0.8}, n) for n in names]
    found = fitted(vessel, lag, seed=6, manoeuvres=("zigzag",) * 4)
    assert found.chi2_per_dof > 1.3
    assert find_waves(found) is None


@pytest.mark.parametrize(
    ("vessel", "frequency", "size", "seed"),
    [
        ("usv", 2.2, 0.15, 7),
        pytest.param("usv", 1.5, 0.3, 8, marks=pytest.mark.slow),
        pytest.param("catamaran", 3.0, 0.15, 9, marks=pytest.mark.slow),
    ],
)
def test_waves_are_found_with_frequency_and_amplitudes(vessel, frequency, size, seed):
    effect = Effect("waves", {"frequency": frequency, "u": 0.7 * size, "v": size, "r": 0.4 * size})
    waves = find_waves(fitted(vessel, [effect], seed))
    assert waves is not None
    assert waves.seen.p_value < 1e-4
    assert waves.seen.frequency == pytest.approx(frequency, rel=0.03)
    truth = realised(effect, seed)
    for channel in "uvr":
        assert waves.seen.amplitudes[channel] == pytest.approx(
            truth[channel], abs=max(0.3 * truth[channel], 3.0 * waves.seen.stderrs[channel])
        )
        assert 0.0 < waves.seen.stderrs[channel] < 0.4 * truth[channel]
        assert 0.2 < waves.seen.share[channel] <= 1.0
    reported = as_effect(waves)
    assert (reported.name, reported.input, reported.options) == ("waves", None, {})
    assert {p.name: p.unit for p in reported.parameters} == {
        "frequency": "rad/s", "u": "m/s²", "v": "m/s²", "r": "rad/s²",
    }  # fmt: skip


@pytest.mark.parametrize("model", ["nomoto1", "nomoto2"])
def test_a_band_is_measured_by_what_a_model_predicts(model, monkeypatch):
    """Of surge and sway a model of yaw alone says nothing: no channel of theirs has a say in the band."""
    sea = WAVES | {"frequency": 2.2}
    _, trials = trials_of("usv", ("zigzag", "random", "zigzag"), DURATION, 3, (Effect("waves", sea),))
    prepared = prepare(trials, model)
    fit = fit_from_scratch(prepared.structure, prepared.identify, rounds=1)
    spectra = spectra_of(fit)
    found = measured(fit, spectra, int(np.argmin(np.abs(spectra.omega - sea["frequency"]))), 1e-9)
    assert found.frequency == pytest.approx(sea["frequency"], rel=0.05)
    assert found.seen.frequency == pytest.approx(sea["frequency"], rel=0.05)
    assert 0.0 < found.spread < 0.3 * found.frequency
    assert set(found.seen.amplitudes) == {"r"}
    assert found.seen.amplitudes["r"] == pytest.approx(sea["r"], rel=0.35)
    missed = np.sqrt(spectra.mean_square) * (1e3, 1e3, 0.5)  # nobody foretold surge and sway
    unlike = SimpleNamespace(mean_square=missed**2)
    monkeypatch.setattr(searched, "spread_of", lambda _: np.sqrt(spectra.mean_square))
    monkeypatch.setattr(searched, "spectra_of", lambda _: unlike)
    assert searched._spectra_near(fit) is unlike
    unlike.mean_square[2] *= 9.0
    assert searched._spectra_near(fit) is None


def test_sensors_so_good_that_the_swell_is_a_thousand_times_their_noise_show_it():
    fit = in_waves(8, **HIGH)
    structure, p = fit.solution.structure, fit.solution.p
    sharp = tuple(s.weighted(0.05 * s.samples.sigma, np.full(4, 0.05)) for s in fit.problem.stretches)
    problem = replace(fit.problem, stretches=sharp)
    fit = replace(fit, problem=problem, solution=fit_states(problem, structure, p))
    assert fit.chi2_per_dof > 1000.0
    waves = find_waves(fit)
    assert waves is not None
    assert waves.seen.frequency == pytest.approx(1.5, rel=0.03)


def test_what_is_louder_the_more_the_vessel_does_is_no_sea():
    """A tank that is half full swings by itself, without the phase of anything that was done."""
    waves = Effect("waves", {"frequency": 2.2, "u": 0.1, "v": 0.15, "r": 0.06})
    spectra = spectra_of(fitted("usv", (waves,), 7))
    spectra = replace(spectra, rate=np.tile(spectra.rate, (4, 1, 1)), done=np.tile(spectra.done, (4, 1, 1)))
    place = int(np.argmin(np.abs(spectra.omega - 2.2)))
    core = core_of(spectra, spectra.omega[place])
    assert not any(_grows_with(spectra, place, c) for c in range(3))
    done = np.mean(np.abs(spectra.done[:, core]) ** 2, axis=1)
    busy = np.repeat(np.mean(done / done.mean(axis=0), axis=1).reshape(-1, TAPERS).mean(axis=1), TAPERS)
    rate = spectra.rate.copy()
    rate[:, core] *= busy[:, None, None] ** 2
    assert all(_grows_with(replace(spectra, rate=rate), place, c) for c in range(3))


def test_nothing_is_made_of_a_band_where_a_model_misses_more_than_the_motion():
    fit = in_waves(8, **HIGH)
    p = np.where([s.coefficient >= 0 for s in fit.solution.structure.slots], -fit.solution.p, fit.solution.p)
    assert find_waves(replace(fit, solution=replace(fit.solution, p=0.2 * p))) is None


def test_windows_of_one_log_have_one_sea_and_logs_tell_how_well_it_is_known():
    fit = in_waves(**WAVES)
    found, spectra = find_waves(fit), spectra_of(fit)
    assert set(spectra.log) == {0, 1, 2}
    place = int(np.argmin(np.abs(spectra.omega - found.frequency)))
    one, three = (
        measured(fit, replace(spectra, log=k), place, 0.0).seen for k in (0 * spectra.log, spectra.log)
    )
    assert one.sharpness == three.sharpness <= one.frequency_stderr <= three.frequency_stderr
    assert all(one.stderrs[c] <= three.stderrs[c] for c in "uvr")
    assert sum(three.stderrs.values()) > sum(one.stderrs.values())


def test_a_band_in_which_nothing_stands_out_has_a_middle_all_the_same():
    """A peak of one channel's rates may be none of the accelerations: it is measured, and is then no waves."""
    spectra = spectra_of(clean())
    for place in (8, len(spectra.omega) // 2):
        force = spectra.force.copy()
        force[:, core_of(spectra, spectra.omega[place])] *= 1e-3
        seen = measured(clean(), replace(spectra, force=force), place, 1.0).seen
        assert seen.frequency == pytest.approx(spectra.omega[place], rel=0.3)
        assert np.isfinite([seen.frequency_stderr, *seen.amplitudes.values(), *seen.stderrs.values()]).all()


def test_one_window_cannot_show_waves():
    whole = clean()
    problem = replace(whole.problem, windows=whole.problem.windows[:1])
    solution = replace(whole.solution, first=first_states(problem))
    assert find_waves(replace(whole, problem=problem, solution=solution)) is None


@pytest.mark.slow
def test_waves_that_are_known_leave_a_lag_to_be_seen():
    lag = Effect("actuator_lag", {"time_constant": 0.6}, "rudder")
    waves = Effect("waves", WAVES)
    before = fitted("usv", (waves, lag))
    after = with_waves_known(before)
    known = after.problem.stretches[0].swell
    assert known.frequency == pytest.approx(1.6, rel=0.05)
    assert after.chi2_per_dof < 0.5 * before.chi2_per_dof
    first = rounds(after, [], Pace())
    assert [a.effect.name for a in first.solution.structure.actives] == ["actuator_lag"]
    assert first.solution.structure.values(first.solution.p, 0)["time_constant"] == pytest.approx(
        0.6, abs=0.15
    )


def in_slow_waves(vessel, frequency) -> Fitted:
    waves = Effect("waves", {"frequency": frequency, "u": 0.07, "v": 0.12, "r": 0.05})
    ship, trials = trials_of(vessel, ("zigzag", "random", "zigzag", "random"), 120.0, 5, (waves,))
    prepared = prepare(trials, ship.model)
    return fit_from_scratch(prepared.structure, prepared.identify, rounds=1)


def test_waves_too_slow_for_the_usual_windows_show_in_longer_ones():
    before = in_slow_waves("usv", 0.8)
    assert find_waves(before) is None
    after = with_waves_known(before)
    assert after.chi2_per_dof < NEAR < before.chi2_per_dof
    seen = after.problem.swell.seen
    assert seen.frequency == pytest.approx(0.8, abs=3.0 * seen.frequency_stderr)
    assert seen.frequency_stderr < 0.05


def test_a_peak_that_long_windows_show_is_no_waves_where_most_of_the_errors_stay():
    """A few long windows, of a vessel that answers wrongly, have a peak far from where the waves are."""
    before = in_slow_waves("catamaran", 0.7)
    peak = waves_of(_in_windows(before, 2.0 * before.problem.length))
    assert peak is not None
    assert abs(peak.seen.frequency - 0.7) > 0.5
    assert with_waves_known(before) is before


def test_a_fit_without_waves_stays_as_it_was():
    assert with_waves_known(clean()) is clean()


def test_waves_that_nobody_is_told_of_are_taken_out_of_a_fit():
    known = waves_known()
    assert known.problem.swell is not None
    bare = without_waves(known)
    assert bare.problem.swell is None
    assert bare.chi2_per_dof > known.chi2_per_dof
    assert without_waves(bare) is bare
    assert needs_waves(known)


def test_waves_that_are_known_are_not_needed_where_a_fit_is_at_the_noise_without():
    swell = waves_known().problem.swell
    plain = clean()
    stretches = tuple(replace(s, swell=swell) for s in plain.problem.stretches)
    known = under(replace(plain.problem, stretches=stretches), plain)
    assert known.problem.swell is not None
    assert not needs_waves(known)


@pytest.mark.parametrize("off", [True, False])
def test_waves_without_which_a_fit_is_off_are_looked_for_in_longer_windows_too(monkeypatch, off):
    known = waves_known()
    monkeypatch.setattr(swell, "_shown", lambda fitted: None)  # as in a short log, whose lines are wide
    monkeypatch.setattr(swell, "without_waves", lambda fitted: SimpleNamespace(is_off=off))
    found = seen_waves(known)
    assert (found is not None) is off
    assert not off or found.seen.frequency == pytest.approx(WAVES["frequency"], rel=0.05)
    assert not off or found.seen.cycles > 1.2 * swell.ENOUGH_CYCLES
    assert seen_waves(clean()) is None


def test_no_waves_are_higher_than_waves_break():
    fit = in_waves(frequency=2.0, u=0.2, v=0.4, r=0.1)
    seen = find_waves(fit)
    assert seen is not None
    spectra = spectra_of(fit)
    place = int(np.argmin(np.abs(spectra.omega - seen.frequency)))
    around = around_of(spectra, np.mean(np.abs(spectra.rate[:, :, 1]) ** 2, axis=0))
    for height, believed in ((1.0, True), (30.0, False)):
        amplitudes = {c: height * a for c, a in seen.seen.amplitudes.items()}
        higher = replace(seen, seen=replace(seen.seen, amplitudes=amplitudes))
        assert _material(higher, spectra, around, place, 1) == believed


@pytest.mark.parametrize(
    ("length", "speed", "least", "most"), [(1.0, 1.5, 20.0, 60.0), (30.0, 5.0, 4.0, 8.0)]
)
def test_waves_much_shorter_than_a_vessel_do_not_move_it(length, speed, least, most):
    """A quarter of 30 m is a wave of 2.9 rad/s, met from ahead at 7.1."""
    states = np.zeros((50, 6))
    states[:, 3] = speed
    vessel, stretch = SimpleNamespace(length=length), SimpleNamespace(states=states)
    fit = SimpleNamespace(
        problem=SimpleNamespace(stretches=(stretch,)),
        solution=SimpleNamespace(structure=SimpleNamespace(vessel=vessel)),
    )
    assert least < fastest(fit) < most


def test_a_peak_at_a_frequency_of_no_waves_is_none(monkeypatch):
    fit = fitted("usv", [Effect("waves", {"frequency": 2.0, "u": 0.05, "v": 0.05, "r": 0.03})], 3)
    assert find_waves(fit) is not None
    monkeypatch.setattr(searched, "fastest", lambda _: 1.5)
    assert find_waves(fit) is None


@pytest.mark.parametrize("rows", [8, 30, 200])
def test_what_accounts_for_half_of_a_peak_is_hardly_ever_taken_for_less(rows):
    """Of peaks that are half what the vessel did no more are let pass than is meant; of those that are not, many."""
    rng = np.random.default_rng(rows)
    draws = rng.standard_normal((2, 4000, rows, 2)) @ np.array([1.0, 1.0j])
    for share, passes in ((0.5, (0.0, 0.08)), (0.02, (0.1 if rows < 10 else 0.8, 1.0))):
        done, force = draws[0], math.sqrt(share) * draws[0] + math.sqrt(1.0 - share) * draws[1]
        together = np.abs(np.sum(force.conj() * done, axis=1)) ** 2
        own = np.sum(np.abs(force) ** 2, axis=1) * np.sum(np.abs(done) ** 2, axis=1)
        told = np.mean([not _may_be_half(float(c), rows) for c in together / own])
        assert passes[0] <= told <= passes[1], (share, told)


@pytest.mark.parametrize(("share", "mostly"), [(0.3, False), (0.9, True)])
def test_a_helmsman_who_answers_the_waves_does_not_make_them(share, mostly):
    """His rudder is surely coherent with them; only what may be half of a peak refuses waves that need but be tried."""
    rng = np.random.default_rng(5)
    wave, other = rng.standard_normal((2, 120, 2)) @ np.array([1.0, 1.0j])
    rudder = math.sqrt(share) * wave + math.sqrt(1.0 - share) * other
    spectra = SimpleNamespace(rate=wave[:, None, None], done=rudder[:, None, None])
    assert _goes_with(spectra, 0, 0)
    assert _goes_with(spectra, 0, 0, mostly=True) == mostly


@pytest.mark.parametrize(
    ("without", "beside", "known"),
    [(1.5, 1.1, True), (20.0, 2.9, False), (90.0, 2.9, True), (9000.0, 4.0, False)],
)
def test_waves_that_errors_only_may_show_are_known_near_the_noise_alone(monkeypatch, without, beside, known):
    """Far from it they may stand for anything that swings, such as a ship that is unstable on course."""
    fits = {chi2: SimpleNamespace(chi2_per_dof=chi2) for chi2 in (without, beside)}
    monkeypatch.setattr(swell, "_bare", lambda fitted: fitted)
    monkeypatch.setattr(swell, "_perhaps", lambda _: "waves")
    monkeypatch.setattr(swell, "_with_likeliest_shape", lambda *_: "problem")
    monkeypatch.setattr(swell, "knowing", lambda *_: fits[beside])
    assert (swell._tried(fits[without]) is fits[beside]) == known


@pytest.mark.parametrize("ticks", [(0.05,) * 6 + (0.075,), (0.05,) * 5 + (0.1,), (0.1,)])
def test_a_slow_line_shows_once_however_a_logger_ticks(ticks):
    t = np.cumsum(np.tile(ticks, 420 // len(ticks)))
    omega = np.linspace(0.5, 20.0, 400)
    line = np.cos(1.17 * t)[:, None]
    power = np.sum(np.abs(_transform(t, line, t[0], t[-1], omega)) ** 2, axis=(0, 2))
    assert omega[np.argmax(power)] == pytest.approx(1.17, abs=0.2)
    assert power[omega > 5.0].max() < 3e-5 * power.max()


def test_white_noise_has_its_own_density_at_even_times():
    t = 0.1 * np.arange(600)
    noise = np.random.default_rng(3).standard_normal((600, 40))
    omega = np.linspace(2.0, 20.0, 60)
    power = np.mean(np.abs(_transform(t, noise, t[0], t[-1], omega)) ** 2, axis=(0, 2))
    assert power[:20].mean() == pytest.approx(0.1, rel=0.06)
    assert power[-20:].mean() == pytest.approx(0.1, rel=0.06)
