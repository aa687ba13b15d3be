"""Clocks, manoeuvres and excitation: what the motion itself tells."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from preprocess_samples import Imperfect, sampled, truth_of

from preprocess.excitation import _pair as coherent
from preprocess.excitation import excitation
from preprocess.manoeuvres import find_manoeuvres, plateaus, reversals
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials

DURATION = 150.0


@cache
def trial_of(vessel, manoeuvre, **delays):
    rates = {"position": (5.0, 0.02), "heading": (10.0, 0.01), "yaw_rate": (20.0, 0.003)}
    sensors = {k: Imperfect(*v, delay=delays.get(k, 0.0)) for k, v in rates.items()}
    made = sampled(truth_of(vessel, manoeuvre, DURATION, 1), 1, **sensors)
    (trial,) = make_trials([LoggedRun("a.csv", made.log, "identify")], made.vessel, made.inputs, made.sensors)
    return trial


def offsets(trial):
    (step,) = [s for s in trial.history if s.action == "clock_offsets"]
    return {k: (v[1], v[2]) for k, v in step.arguments.items()}


@pytest.mark.parametrize("delay", [-0.15, 0.1, 0.4])
def test_yaw_rate_clock(delay):
    late = {"yaw_rate": delay} if delay > 0 else {"position": -delay, "heading": -delay}
    trial = trial_of("usv", "zigzag", **late)
    offset, _ = offsets(trial)["yaw_rate"]
    assert offset == pytest.approx(delay, abs=0.02)
    assert any("yaw_rate" in f and "stamps" in f for f in trial.findings)


def test_position_clock():
    trial = trial_of("catamaran", "random", position=0.3)
    assert offsets(trial)["position"][0] == pytest.approx(0.3, abs=0.08)
    assert any(f.startswith("The stamps of position") for f in trial.findings)


@pytest.mark.parametrize(
    ("vessel", "manoeuvre"), [("usv", "zigzag"), ("catamaran", "random"), ("tanker", "zigzag")]
)
def test_right_clocks_are_left_alone(vessel, manoeuvre):
    trial = trial_of(vessel, manoeuvre)
    assert not [f for f in trial.findings if "stamps" in f]


@pytest.mark.parametrize(
    ("vessel", "manoeuvre"),
    [
        ("usv", "zigzag"),
        ("tanker", "zigzag"),
        ("usv", "circle"),
        ("usv", "straight"),
        ("usv", "idle"),
        ("usv", "spiral"),
    ],
)
def test_manoeuvres_are_recognised(vessel, manoeuvre):
    trial = trial_of(vessel, manoeuvre)
    assert trial.manoeuvre == manoeuvre, find_manoeuvres(trial)


def test_reversals_and_plateaus():
    psi = np.interp(np.arange(100), [0, 20, 50, 80, 99], [0.0, 0.4, -0.4, 0.4, 0.0])
    np.testing.assert_allclose(reversals(psi, 0.1), [0.4, -0.4, 0.4])
    np.testing.assert_allclose(plateaus(np.repeat([0.0, 0.3, -0.3], 30)), [0.0, 0.3, -0.3])


def test_excitation_names_the_terms_that_cannot_be_told_apart():
    trial = trial_of("usv", "random")
    names = list(trial.inputs)
    one, other = (trial.inputs[n] for n in names[:2])
    said = {}
    for kind, value in {
        "one": 7.0 + 0.0 * one.value,
        "none": 0.0 * one.value,
        "same": 3.0 * other.value,
    }.items():
        source = other if kind == "same" else one
        inputs = {**trial.inputs, names[0]: replace(source, name=names[0], value=value)}
        said[kind] = [s for s in excitation([replace(trial, inputs=inputs)]).sentences if "usual" in s]
    first, second = (f"|{n}|{n}" for n in names[:2])
    assert said["one"] == [f"Of the usual terms of sway and yaw, 1 and {first} cannot be told apart."]
    axes = ("surge", "sway and yaw")
    assert said["none"] == [f"Of the usual terms of {a}, {first} is zero throughout." for a in axes]
    assert said["same"] == [
        f"Of the usual terms of {a}, {first} and {second} cannot be told apart." for a in axes
    ]


def test_excitation_says_what_was_not_varied():
    straight, rich = trial_of("usv", "straight"), trial_of("usv", "random")
    poor, good = excitation([straight]), excitation([straight, rich])
    assert any("Less than half of the compass" in s for s in poor.sentences)
    assert good.headings > poor.headings
    assert good.regressions[1].condition < poor.regressions[1].condition
    assert good.ranges["r"][1] > poor.ranges["r"][1]
    assert max(good.coherence.values()) > 0.3


def test_an_input_that_switches_as_evenly_as_its_log_has_a_coherence_all_the_same():
    """At most frequencies then nothing happens at all."""
    even, noise = np.tile([1.0, -1.0], 600), np.random.default_rng(1).standard_normal(1200)
    assert 0.0 < coherent(even, noise) < 0.3
    assert coherent(even, even) == pytest.approx(1.0)
