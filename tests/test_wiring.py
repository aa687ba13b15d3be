"""A wiring is put right on the accelerations' word, but not against a fit that leaves nothing to put right."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from identification_samples import trials_of

import validate.loop
import validate.preferred_wiring
from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import NEAR
from identify.held_inputs import prepare_best
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from preprocess.trials import make_trials
from seatrial import load_campaign
from seatrial.pipeline import read_logs, runs_of
from validate import nearer
from validate.candidates import wirings
from validate.loop import _otherwise_wired, _rough, search
from validate.nearer import clearly_nearer
from validate.outcome import Outcome
from validate.pace import Pace
from validate.preferred_wiring import preferred_wiring, wired_otherwise
from validate.wiring import Wiring, better_wiring
from validate.within import ALL

BLUEBOAT = Path(__file__).resolve().parents[2] / "shared" / "data" / "blueboat" / "campaign.toml"
measured = pytest.mark.skipif(not BLUEBOAT.exists(), reason="the measured logs are not here")


def test_a_wiring_is_not_taken_where_the_declared_one_is_likelier(monkeypatch):
    _, trials = trials_of("catamaran", ("zigzag", "random"), 60.0, 4)
    prepared = prepare(trials, "modulus")
    declared = fit_from_scratch(prepared.structure, prepared.identify)
    wrong = wirings(prepared.structure)[0]
    found = Wiring(wrong, 8.0, 1e-15, (), ((wrong, 8.0),))
    monkeypatch.setattr(validate.preferred_wiring, "better_wiring", lambda structure, stretches: found)
    outcome = search(prepared, declared)
    assert outcome.wiring is None
    assert outcome.standing == ()


@pytest.mark.parametrize(
    ("length", "chi2", "goes"),
    [
        (10.0, 5415.0, False),
        (10.0, 2000.0, True),
        (20.0, 6000.0, True),
        (5.0, 100.0, False),
        (20.0, 4e9, False),
    ],
)
def test_a_wiring_goes_where_the_declared_one_isclearly_nearer(length, chi2, goes):
    """Far from the noise half a per cent says nothing, and the accelerations have spoken."""

    def fit(length, chi2):
        return SimpleNamespace(problem=SimpleNamespace(length=length), chi2_per_dof=chi2)

    assert clearly_nearer(fit(length, chi2), fit(10.0, 5446.0)) is goes


def _preferred(seed, *effects):
    manoeuvres = ("circle", "zigzag", "random", "reciprocal")
    _, trials = trials_of("cybership", manoeuvres, 139.0, seed, effects=effects, validate=0)
    prepared = prepare(trials, "cybership2")
    return better_wiring(prepared.structure, prepared.identify)


@pytest.mark.parametrize("seed", [0, 3])
def test_a_propeller_that_loses_thrust_at_times_is_not_reversed(seed):
    """One that pulls back, and pushes the more the faster the ship goes, has two speeds: it followed that best."""
    lost = Effect("thruster_cutouts", {"depth": 0.36, "every": 24.7, "lasting": 7.0}, "propeller")
    assert _preferred(seed, lost) is None


@pytest.mark.parametrize("seed", [0, 3])
def test_a_reversed_propeller_is_found(seed):
    wiring = _preferred(seed, Effect("input_wiring", {}, None, {"reversed": ("propeller",)}))
    assert wiring is not None
    assert wiring.active.label == "input_wiring (reversed propeller)"


def _looked_at_again(*effects):
    """The search's end with the inputs as declared, and what another wiring makes of it."""
    _, trials = trials_of("tug", ("zigzag", "random"), 60.0, 4, effects=effects, validate=0)
    prepared = prepare(trials, "modulus")
    found = Outcome(fit_from_scratch(prepared.structure, prepared.identify), (), (), None)
    return found, _otherwise_wired(
        prepared, found, wired_otherwise(prepared, _rough(prepared.structure)), Pace(), ALL
    )


def test_where_a_search_stays_off_the_noise_a_wiring_that_is_likelier_is_tried():
    found, other = _looked_at_again(Effect("input_wiring", {}, None, {"swapped": ("n_port", "n_starboard")}))
    assert found.fitted.is_off
    assert other.wiring.active.variant.options["swapped"] == ("n_port", "n_starboard")
    assert other.fitted.chi2_per_dof < NEAR
    assert "input_wiring (swapped azimuth_port and azimuth_starboard)" not in other.wiring.look_alikes


def test_where_nothing_but_another_wiring_brings_a_model_to_the_noise_no_other_cause_is_asked_first(
    monkeypatch,
):
    back = Effect("input_wiring", {}, None, {"reversed": ("n_port",)})
    _, trials = trials_of("tug", ("zigzag", "random"), 60.0, 4, effects=(back,), validate=0)
    prepared = prepare(trials, "modulus")
    assert better_wiring(prepared.structure, prepared.identify) is None  # the accelerations alone do not tell
    wired = []
    searched = validate.loop._searched
    monkeypatch.setattr(validate.loop, "_searched", lambda *a: wired.append(a[2]) or searched(*a))
    outcome = search(prepared, None)
    assert [w.active.variant.options["reversed"] for w in wired] == [("n_port",)]
    assert outcome.fitted.chi2_per_dof < NEAR
    assert outcome.wiring is wired[0]


@pytest.mark.parametrize(
    ("off", "effects", "taken"),
    [(True, 3, True), (False, 1, True), (False, 2, True), (False, 3, False)],
)
def test_many_effects_at_the_noise_give_way_to_a_wiring_with_fewer(monkeypatch, off, effects, taken):
    """A propeller's walk to port and another's to starboard reverse the moment of two thrusters that are swapped."""

    def ended(effects, off):
        fitted = SimpleNamespace(is_off=off, chi2_per_dof=1.0, problem=SimpleNamespace(length=30.0))
        return SimpleNamespace(fitted=fitted, standing=("effect",) * effects)

    swapped = SimpleNamespace(
        wiring=SimpleNamespace(active=SimpleNamespace(label="swapped")), chi2=2.0, declared=9.0
    )
    found, other = ended(3, off), ended(effects, False)
    monkeypatch.setattr(validate.loop, "_searched", lambda *_: other)
    assert _otherwise_wired(None, found, swapped, Pace(), ALL) is (other if taken else found)


@pytest.mark.parametrize(("effects", "asked"), [(2, False), (3, True)])
def test_a_wiring_is_asked_for_where_many_effects_came_to_the_noise(monkeypatch, effects, asked):
    fitted = SimpleNamespace(is_off=False, chi2_per_dof=1.0)
    found = SimpleNamespace(fitted=fitted, standing=("effect",) * effects)
    for name in ("_searched", "_begun_otherwise", "_begun_shorter"):
        monkeypatch.setattr(validate.loop, name, lambda *_: found)
    monkeypatch.setattr(validate.loop, "preferred_wiring", lambda *_: None)
    monkeypatch.setattr(validate.loop, "wired_otherwise", lambda *_: None)
    monkeypatch.setattr(validate.loop, "_otherwise_wired", lambda *_: "asked")
    prepared = SimpleNamespace(structure=SimpleNamespace(vessel=SimpleNamespace(length=2.0)))
    assert (search(prepared, None, Pace()) == "asked") is asked


def test_no_wiring_is_tried_for_what_none_would_mend():
    found, other = _looked_at_again(
        Effect("thruster_cutouts", {"depth": 0.6, "every": 15.0, "lasting": 5.0}, "n_port")
    )
    assert found.fitted.is_off
    assert other is found


def test_windows_in_which_nothing_fits_say_no_more_for_being_long(monkeypatch):
    """A fit is held against another in windows as long as those in which that one does not run away."""

    def fit(length, chi2, far=True):
        problem = SimpleNamespace(length=length, stretches="logs")
        solution = SimpleNamespace(structure="model", p="values")
        return SimpleNamespace(problem=problem, chi2_per_dof=chi2, is_far=far, solution=solution)

    shorter = SimpleNamespace(weighted_as=lambda _: "shorter")
    asked = []
    monkeypatch.setattr(nearer, "cut", lambda logs, length: asked.append(length) or shorter)
    monkeypatch.setattr(nearer, "fit_states", lambda *_: "states")
    monkeypatch.setattr(nearer, "calibrated", lambda problem, _: problem)
    monkeypatch.setattr(nearer, "under", lambda problem, *_: fit(15.0, 8000.0))
    assert not nearer.nearer_in_windows_alike(fit(30.0, 18000.0), fit(15.0, 5500.0))
    assert nearer.nearer_in_windows_alike(fit(30.0, 18000.0), fit(15.0, 18000.0))
    assert asked == [15.0, 15.0]
    assert nearer.nearer_in_windows_alike(fit(30.0, 2.0, far=False), fit(15.0, 100.0))
    assert not nearer.nearer_in_windows_alike(fit(15.0, 8000.0), fit(30.0, 9000.0))
    assert asked == [15.0, 15.0]


@pytest.mark.slow
@measured
def test_a_boat_that_turned_against_its_declared_thrusters_has_them_swapped():
    """Of the time in which they were clearly told to turn it, it turned as declared in three per cent."""
    campaign = load_campaign(BLUEBOAT)
    trials = make_trials(
        runs_of(campaign, read_logs(campaign)), campaign.vessel, campaign.inputs, {}, by_response=False
    )
    prepared = prepare_best(trials, campaign.model)
    wiring = preferred_wiring(prepared, fit_declared(prepared))
    assert wiring is not None
    assert wiring.active.label == "input_wiring (swapped left and right)"
