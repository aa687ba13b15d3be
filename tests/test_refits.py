"""Refits of candidates: the same on one core and on several, and no more of them than are asked for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.fitted import FAR, NEAR, SLOWLY, Fitted
from identify.free_running import FOLLOWS, LOST, free_running_misfit, is_lost
from identify.prepare import prepare
from identify.settled import settled
from identify.stretch import Stretch
from preprocess.cores import on_cores
from validate import other_start, refits
from validate.candidates import Screened, candidates, from_starts, screen
from validate.finalists import WANTED, astray, finalists
from validate.from_scratch import from_scratch
from validate.pace import Pace
from validate.refined import refined
from validate.refits import CONVERGES, FEW, FIRST, MANY, begun_at, converges, raced, refit, under


@cache
def far_off():
    """A fit of a vessel whose rudder is late, far from the noise, and its candidates."""
    late = Effect("actuator_delay", {"delay": 1.0}, input="rudder")
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 6, (late,))
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0, rounds=0)
    assert fitted.chi2_per_dof > FAR
    return fitted, screen(fitted, candidates(prepared.structure))


def test_a_race_on_two_cores_gives_what_it_gives_on_one():
    fitted, screened = far_off()
    found = []
    for count in (1, 2):
        with on_cores(count):
            found.append(raced(fitted, screened[:4], Pace()))
    for (one, alone), (other, beside) in zip(*found, strict=True):
        assert one.active.label == other.active.label
        assert np.array_equal(alone.solution.p, beside.solution.p)
        assert alone.solution.total == beside.solution.total
        assert beside.problem is fitted.problem
        assert len(beside.solution.moments.residuals) == len(fitted.problem.windows)


def test_far_from_the_noise_what_the_accelerations_want_is_fitted_from_scratch(monkeypatch):
    """In the valley of a base that lacks much, coefficients are bent so far that no step from there may lead out."""
    fitted, screened = far_off()
    bent = replace(fitted, solution=replace(fitted.solution, p=fitted.solution.p * 3.0))
    chosen = finalists(fitted, screened, thorough=False)
    found = from_scratch(bent, chosen, Pace())
    assert 0 < len(found) <= WANTED
    [late] = [f for s, f in found if s.active.label == "actuator_delay (rudder)"]
    assert late.chi2_per_dof < 0.2 * fitted.chi2_per_dof
    assert late.solution.structure.values(late.solution.p, 0)["delay"] == pytest.approx(1.0, abs=0.1)
    away = replace(fitted, solution=replace(fitted.solution, cost=np.inf))
    begun = []
    monkeypatch.setattr(refits, "begun", lambda _, s: begun.append(s.active.label) or away)
    monkeypatch.setattr(refits, "went_on", lambda f, *_: f)
    leading = {s.active.label for s, _ in found}
    assert late.is_as_sensors_say
    assert [s.active.label for s, _ in raced(fitted, chosen, Pace())] == ["actuator_delay (rudder)"]
    assert not begun  # nothing else is asked for beside what is at the noise
    monkeypatch.setattr(Fitted, "is_as_sensors_say", False)
    assert {s.active.label for s, _ in raced(fitted, chosen, Pace())} == leading
    assert begun and not leading & set(begun)


def test_near_the_noise_and_lost_it_is_too_and_weighed_as_the_others_are(monkeypatch):
    """A base whose sway stands for a late rudder is near the noise, follows nothing, and no step leads out of it."""
    fitted, screened = far_off()
    loose = Stretch.weighted
    blunt = tuple(loose(s, 20.0 * s.samples.sigma, np.ones(4)) for s in fitted.problem.stretches)
    near = replace(fitted, problem=replace(fitted.problem, stretches=blunt))
    near = under(near.problem, near)
    assert near.chi2_per_dof < FAR
    chosen = finalists(fitted, screened, thorough=False)
    leading = {s.active.label for s in chosen if s.leads}
    others = [replace(s, leads=False) for s in chosen if not s.leads]
    asked = [*[s for s in chosen if s.leads], *others]
    away = replace(near, solution=replace(near.solution, cost=np.inf))
    monkeypatch.setattr(refits, "begun", lambda *_: away)
    monkeypatch.setattr(refits, "went_on", lambda f, *_: f)
    monkeypatch.setattr(refits, "converges", lambda _: False)
    for lost in (True, False):
        monkeypatch.setattr(refits, "is_lost", lambda f, lost=lost: lost and f is near)
        found = raced(near, [*asked, *screened[: MANY + 1]], Pace())
        assert {s.active.label for s, _ in found} == (leading if lost else set())
        assert all(f.problem is near.problem for _, f in found)


@pytest.mark.parametrize("near", [True, False])
def test_a_race_ends_with_one_that_comes_near_the_noise(monkeypatch, near):
    fitted, screened = far_off()
    tried = []
    begun = refits.begun
    monkeypatch.setattr(refits, "begun", lambda *a: tried.append(a[1].active.label) or begun(*a))
    right = [s for s in screened if s.active.effect.name == "actuator_delay"]
    alike = ("actuator_delay", "actuator_lag", "clock_offset")
    others = [s for s in screened if s.active.effect.name not in alike][: FIRST + 2]
    order = right + others if near else others
    found = raced(fitted, order, Pace())
    best = found[0]
    if near:
        assert best[0].active.effect.name == "actuator_delay"
        assert best[1].chi2_per_dof < CONVERGES
    at_the_noise = best[1].chi2_per_dof < NEAR  # then no more are taken to the end beside it
    assert (len(found) <= FEW) == at_the_noise == near
    assert len(tried) == (FIRST if near else len(order))


def test_a_refit_converges_from_a_fit_near_the_noise_unless_what_is_slow_of_a_compass_is_far_from_it():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 6)
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0, rounds=0)
    for position, heading, expected in ((1.0, 1.0, True), (9.0, 1.0, True), (1.0, 9.0, False)):
        dispersion = np.array([position, heading, 1.0, 1.0])
        problem = replace(fitted.problem, inflation=np.ones(4), dispersion=dispersion)
        assert converges(replace(fitted, problem=problem)) is expected
    assert not converges(far_off()[0])


@pytest.mark.parametrize(
    ("vessel", "roll"),
    [
        ("usv", {"frequency": 0.5, "damping": 0.1, "sway": -0.5, "yaw": -0.2}),
        ("tanker", {"frequency": 0.3, "damping": 0.12, "sway": -0.3, "yaw": -0.1}),
    ],
)
def test_a_slow_roll_is_found_though_the_way_to_it_is_bent(vessel, roll):
    ship, trials = trials_of(
        vessel, ("zigzag", "random", "circle", "zigzag10"), 120.0, 6, (Effect("roll_coupling", roll),)
    )
    prepared = prepare(trials, ship.model)
    base = fit_from_scratch(prepared.structure, prepared.identify)
    [screened] = screen(base, [a for a in candidates(prepared.structure) if a.effect.name == "roll_coupling"])
    found = refit(base, screened)
    assert found.chi2_per_dof < 0.03 * base.chi2_per_dof
    own = found.solution.structure.values(found.solution.p, 0)
    assert own["frequency"] == pytest.approx(roll["frequency"], rel=0.1)
    assert own["damping"] == pytest.approx(roll["damping"], rel=0.3)


def test_what_would_run_away_in_the_other_windows_is_begun_roughly_there():
    """A candidate that some windows spoke for is not lost because the base's first states throw it out of another."""
    fitted, screened = far_off()
    structure = fitted.solution.structure.with_effect(
        next(s.active for s in screened if s.active.label == "actuator_delay (rudder)")
    )
    delay = np.array([float(s.name == "delay") for s in structure.slots])
    part = fit_from_scratch(structure, fitted.problem.stretches, delay, length=10.0)
    nowhere = np.full_like(fitted.solution.first, np.nan)
    thrown = replace(fitted, solution=replace(fitted.solution, first=nowhere))
    found = refits._whole(thrown, part)
    assert np.isfinite(found.solution.total)
    assert found.chi2_per_dof < 0.2 * fitted.chi2_per_dof


def test_an_effect_is_looked_at_on_angles_beside_revolutions():
    """Revolutions have most of the accelerations: alone they would always be preferred."""
    slow = Effect("actuator_rate_limit", {"rate": 0.15}, input="azimuth_port")
    ship, trials = trials_of("tug", ("zigzag", "random"), 60.0, 6, (slow,))
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0, rounds=0)
    limits = [a for a in candidates(prepared.structure) if a.effect.name == "actuator_rate_limit"]
    named = {s.active.variant.input for s in finalists(fitted, screen(fitted, limits), True)}
    assert named & {"azimuth_port", "azimuth_starboard"}
    assert named & {"n_port", "n_starboard"}


def test_a_roll_is_found_from_far_off_whatever_start_promises_most():
    """A good compass sees every swing: in windows longer than one, each is a valley of its own."""
    roll = {"frequency": 1.44, "damping": 0.09, "sway": 0.5, "yaw": -1.5}
    good = replace(Suite(), heading=Sensor(20.0, 3e-4, 0.0), yaw_rate=Sensor(20.0, 3e-4, 0.0))
    ship, trials = trials_of(
        "usv", ("zigzag", "random", "circle"), 80.0, 6, (Effect("roll_coupling", roll),), suite=good
    )
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0, rounds=0)
    assert fitted.chi2_per_dof > FAR
    [screened] = from_starts(
        fitted, [a for a in candidates(prepared.structure) if a.effect.name == "roll_coupling"]
    )
    found = refined(refit(fitted, screened), 10.0)  # as the rounds go on with what they take
    values = found.solution.structure.values(found.solution.p, 0)
    assert values["frequency"] == pytest.approx(roll["frequency"], rel=0.03)
    assert values["yaw"] == pytest.approx(roll["yaw"], rel=0.3)


def lost(fitted, share=0.0):
    """The fit with a propeller that pushes nothing, or a share as much, first states as they were."""
    push = np.array([s.name.startswith("X_T") for s in fitted.solution.structure.slots])
    assert push.any()
    return begun_at(fitted, np.where(push, share * fitted.solution.p, fitted.solution.p), 0)


def test_no_refit_converges_from_a_fit_that_is_lost_on_its_own_logs_however_poor_the_sensors():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 6)
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0, rounds=0)
    nothing = lost(fitted)
    assert is_lost(nothing) and not is_lost(fitted)
    samples = [replace(s.samples, sigma=1e3 * s.samples.sigma) for s in fitted.problem.stretches]
    stretches = [replace(s, samples=x) for s, x in zip(fitted.problem.stretches, samples, strict=True)]
    poor = replace(fitted.problem, stretches=tuple(stretches))
    assert converges(under(poor, fitted, 0))
    there = under(poor, nothing, 0)
    assert there.chi2_per_dof < CONVERGES and astray(there) and not converges(there)


def test_a_fit_that_cannot_follow_its_own_logs_is_lost_where_slow_errors_show_it():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 6)
    prepared = prepare(trials, ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0, rounds=0)
    weak = lost(fitted, 0.8)
    assert FOLLOWS < free_running_misfit(weak) < LOST
    slow = replace(fitted.problem, dispersion=np.full(4, 1.0 + 2.0 * (SLOWLY - 1.0)))
    white = replace(fitted.problem, inflation=np.ones(4), dispersion=np.ones(4))
    assert is_lost(replace(weak, problem=slow)) and not is_lost(replace(weak, problem=white))
    assert not is_lost(replace(fitted, problem=slow))


def test_a_value_that_the_accelerations_want_is_begun_with_through_shorter_windows_where_it_runs_away(
    monkeypatch,
):
    heavy = Effect("shallow_water", {"factor": 2.4}, options={"logs": (1,)})
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 6, (heavy,), validate=0)
    prepared = prepare(trials, ship.model)
    base = fit_from_scratch(prepared.structure, prepared.identify, rounds=0)
    active = next(a for a in candidates(prepared.structure) if a.label == "shallow_water (02-random)")
    structure = prepared.structure.with_effect(active)
    begin = structure.carried(base.solution.p, prepared.structure)
    monkeypatch.setattr(other_start, "roughly", lambda _, __, p, ___: np.where(p == 0.0, 10.0, p))
    p, first = other_start.other_start(structure, Screened(active, begin, begin, 0.0, leads=True), base)
    assert structure.values(p, 0)["factor"] == pytest.approx(2.4, abs=0.3)
    assert np.isfinite(settled(base.problem, structure, p).cost) and np.isfinite(first).all()
