"""A wiring is put right on the accelerations' word, but not against a fit that leaves nothing to put right."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from identification_samples import trials_of

import validate.loop
from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import NEAR
from identify.prepare import prepare
from validate.candidates import wirings
from validate.loop import _otherwise, _otherwise_wired, search
from validate.nearer import clearly_nearer
from validate.outcome import Outcome
from validate.pace import Pace
from validate.rounds import ALL
from validate.wiring import Wiring, better_wiring


def test_a_wiring_is_not_taken_where_the_declared_one_is_likelier(monkeypatch):
    _, trials = trials_of("catamaran", ("zigzag", "random"), 60.0, 4)
    prepared = prepare(trials, "modulus")
    declared = fit_from_scratch(prepared.structure, prepared.identify)
    wrong = wirings(prepared.structure)[0]
    found = Wiring(wrong, 8.0, 1e-15, (), ((wrong, 8.0),))
    monkeypatch.setattr(validate.loop, "better_wiring", lambda structure, stretches: found)
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
    return found, _otherwise_wired(prepared, found, _otherwise(prepared), Pace(), ALL)


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


def test_no_wiring_is_tried_for_what_none_would_mend():
    found, other = _looked_at_again(
        Effect("thruster_cutouts", {"depth": 0.6, "every": 15.0, "lasting": 5.0}, "n_port")
    )
    assert found.fitted.is_off
    assert other is found
