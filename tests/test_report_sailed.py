"""What the page says that the model is about: vessel, day, place, ranges sailed, values without dimension."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.results_example import example_results
from identify.similar import prime_coefficients
from preprocess.vessel import Vessel
from validate.report.page import report_page
from validate.report.sailed import particulars, prime, ranges, when, where
from validate.report.words import number


def test_the_vessel_is_told_as_declared(example):
    vessel = Vessel("Tug", 20.0, 6.5, draught=2.0, mass=150e3)
    told = dict(particulars(vessel, example.trials))
    assert (told["length"], told["beam"], told["draught"]) == ("20.0 m", "6.50 m", "2.00 m")
    assert "mass" in told
    assert "yaw inertia" not in told


def test_day_and_place_are_those_of_the_logs(example):
    assert when(example.trials) == "9 October 2025, 08:53 to 09:04 UTC"
    assert where(example.trials) == "59.4300° N, 24.7500° E"
    later = replace(example.trials[-1], utc_ns=example.trials[-1].utc_ns + 86_400 * 10**9)
    assert when((*example.trials[:-1], later)) == "9 October 2025, 08:53 to 10 October 2025, 09:04 UTC"
    south = replace(example.trials[0], origin=(-33.9, -18.4))
    assert where((south,)) == "33.9000° S, 18.4000° W"


def test_of_logs_that_know_neither_nothing_is_told():
    unknown = example_results(logs=1, duration=5.0, utc=False, origin=None)
    assert {"sailed", "about"}.isdisjoint(dict(particulars(unknown.after.vessel, unknown.trials)))


def test_ranges_are_those_of_the_logs_to_identify_on_and_of_the_others(example):
    own = [t for t in example.trials if t.role == "identify"]
    rows = {name: rest for name, *rest in ranges(example.trials)}
    speed = np.concatenate([np.hypot(t.states["u"], t.states["v"]) for t in own])
    assert rows["speed over ground, m/s"][0] == f"{number(speed.min())} to {number(speed.max())}"
    rudder = np.degrees(np.concatenate([t.inputs["rudder"].value for t in own]))
    assert rows["rudder, °"][0] == f"{number(rudder.min())} to {number(rudder.max())}"
    assert rows["rudder, °"][0] != rows["rudder, °"][1]
    assert {"drift angle, °", "yaw rate, °/s", "n, rev/s"} <= rows.keys()
    assert ranges(own)[0][2] == "–"


def test_a_sample_that_was_set_aside_and_a_gap_are_no_range(example):
    trial = example.trials[0]
    rudder, states = trial.inputs["rudder"], trial.states.copy()
    states.loc[3, ["u", "v", "r"]] = np.nan
    good, value = rudder.good.copy(), rudder.value.copy()
    good[5], value[5] = False, 9.0
    bad = replace(trial, states=states, inputs={"rudder": replace(rudder, good=good, value=value)})
    assert "nan" not in str(ranges((bad,)))
    assert "516" not in {n: a for n, a, _ in ranges((bad,))}["rudder, °"]


def test_coefficients_without_dimension_refer_to_the_median_speed_where_the_model_has_none(example):
    found, speed = prime(example.after, example.trials)
    own = [t.states for t in example.trials if t.role == "identify"]
    assert speed == pytest.approx(np.median(np.concatenate([np.hypot(s["u"], s["v"]) for s in own])))
    assert found[0] == number(prime_coefficients(example.after, speed)[0].value)
    newtons = replace(example.after.coefficients[0], unit="1/N")
    odd = replace(example.after, coefficients=(newtons, *example.after.coefficients[1:]))
    assert prime(odd, example.trials) == ({}, 0.0)
    assert ">prime</th>" not in report_page(replace(example, after=odd))


def test_the_page_says_what_the_model_is_about(example_page):
    section = example_page[example_page.index('id="model"') : example_page.index('id="plots"')]
    for words in ("<dt>beam</dt><dd>0.300 m</dd>", "59.4300° N", "rudder, °", ">prime</th>", "extrapolates"):
        assert words in section
