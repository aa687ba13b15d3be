"""The words of the report: headline, effects, candidates, units."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.results_example import make_diagnosis
from identify.fit import Estimated, FittedEffect
from validate.diagnosis import Candidate, ChannelScore, Round, Verdict
from validate.report import read_model, report_of
from validate.report.labels import advice_words, bars, finding_words, in_words, ranked, taken_of
from validate.report.markdown import round_markdown
from validate.report.page import remark, report_page
from validate.report.plan import spread
from validate.report.svg import Axes, Series, limits_of, stack
from validate.report.words import effect_words, headline, in_powers, interval, percent, plus_minus
from validate.report_files import write_results


@pytest.mark.parametrize("verdict", Verdict)
def test_the_headline_is_one_sentence_that_names_what_was_found(example, verdict):
    found = make_diagnosis(example.after.effects[0], verdict)
    if verdict is Verdict.ADEQUATE:
        found = replace(found, effects=())
    words = headline(replace(example, diagnosis=found))
    assert words.endswith(".")
    assert words.count(". ") == 0
    assert ("a current of 0.178 m/s flowing to 75.1°" in words) == (verdict is not Verdict.ADEQUATE)
    assert ("wind" in words) == (verdict is Verdict.AMBIGUOUS)


def scored(results, **r2):
    channels = {c: ChannelScore(1.0, 1.0, x, 1.0) for c, x in r2.items()}
    found = replace(results.validation_after, channels=channels)
    return replace(results, diagnosis=None, validation_after=found)


@pytest.mark.parametrize(
    ("r2", "says"),
    [
        ({"u": 0.382, "v": -2.792, "r": -0.12},
         "an R² of u 0.382, v −2.792 and r −0.120, in v and r no better than the mean of what was measured;"),
        ({"u": 0.98, "v": 0.9, "r": 0.999}, "an R² of u 0.980, v 0.900 and r 0.999;"),
        ({"u": None, "v": None, "r": -12.3}, "an R² of r −12.3, no better than the mean of what was measured;"),
    ],
)  # fmt: skip
def test_a_model_that_was_only_fitted_is_said_to_be_as_good_as_it_predicts(example, r2, says):
    sentence = headline(scored(example, **r2))
    assert says in sentence
    assert sentence.endswith("what it lacks was not searched for.")


def test_an_error_that_rises_is_said_to_rise(example):
    swapped = replace(
        example, validation_before=example.validation_after, validation_after=example.validation_before
    )
    assert "rises from" in headline(swapped)


def test_an_error_that_stays_is_not_said_to_change(example):
    assert "stays at" in headline(replace(example, validation_before=example.validation_after))


def test_hulls_are_spread_along_the_way_and_not_in_time():
    north = np.concatenate([np.zeros(1000), np.linspace(0, 100, 50)])
    rows = spread(np.column_stack([north, np.zeros(1050), np.zeros(1050)]), 5)
    np.testing.assert_allclose(north[rows], [0, 25, 50, 75, 100], atol=2.1)


def test_wiring_and_deadband_in_words(example):
    wiring = FittedEffect("input_wiring", None, (), {"swapped": ["left", "right"]})
    assert effect_words(wiring) == "a swapped wiring of left and right"
    width = replace(
        example.after.effects[0].parameters[1], name="width", value=math.radians(2), stderr=math.radians(0.3)
    )
    band = FittedEffect("actuator_deadband", "rudder", (width,), {"form": "play"})
    assert effect_words(band) == "an actuator deadband of rudder as play (width 2.00 ± 0.30°)"


def test_names_in_sentences_are_words_but_those_of_inputs_and_files_stay():
    said = "Here clock_offset (yaw_rate) cannot be told from actuator_lag (n_2); see a/roll_coupling.csv, gyro_bias."
    assert in_words(said) == (
        "Here clock offset (yaw rate) cannot be told from actuator lag (n_2); see a/roll_coupling.csv, gyro bias."
    )
    assert advice_words("clock_offset: look.") == "Clock offset: look."
    assert advice_words("thrust_fade: a. actuator_lag of rudder: b. current: c. Sail. wind is no begin.") == (
        "Thrust fade: a. Actuator lag of rudder: b. Current: c. Sail. wind is no begin."
    )
    assert (
        finding_words("yaw_rate: circle -292° of heading, 37-68 s.")
        == "yaw rate: circle −292° of heading, 37-68 s."
    )


def tried(effect, note, evidence=1.0, input=None):
    same = {"u": 0.1, "v": 0.1, "r": 0.1}
    if "not refitted" in note:
        return Candidate(
            effect, input, math.nan, math.nan, same, dict.fromkeys(same, math.nan), note, evidence
        )
    return Candidate(effect, input, evidence, 0.5, same, same, note)


def test_a_candidate_has_its_full_label_and_why_it_was_not_refitted(example):
    late = "not refitted: to first order it gains too little"
    candidates = (
        tried("clock_offset", "clock_offset (inputs)", 30.0),
        tried("current", "current", 20.0),
        tried("actuator_deadband", late, 40.0, "left"),
        tried("clock_offset", late, 35.0),
        tried("roll_coupling", f"roll_coupling: {late}", -3.0),
    )
    turn = Round((), candidates, "clock_offset")
    with_it = replace(example, diagnosis=replace(example.diagnosis, rounds=(turn,)))
    entries = report_of(with_it).diagnosis.rounds[0].candidates
    assert [(c.label, c.note) for c in entries] == [
        ("clock_offset (inputs)", ""),
        ("current", ""),
        ("actuator_deadband (left)", late),
        ("clock_offset", late),
        ("roll_coupling", late),
    ]
    assert taken_of(turn) is candidates[0]
    page = report_page(with_it)
    assert "clock offset (inputs) ✓ taken" in page
    assert page.count("✓ taken") == 1
    assert page.count("not refitted: it promises too little") == 1
    assert bars(ranked(turn)) == [1.0, 20 / 30, 0.0, 0.0, 0.0]
    assert page.count("not refitted: a first look") == 2
    assert "| clock offset (inputs) |" in round_markdown(1, turn)


def test_a_limit_of_a_rudders_rate_is_in_degrees_per_second(example, tmp_path):
    rate = replace(
        example.after.effects[0].parameters[0], name="rate", value=0.2, stderr=0.01, unit="input's unit/s"
    )
    found = FittedEffect("actuator_rate_limit", "rudder", (rate,))
    taken = replace(example.diagnosis.effects[0], fitted=found)
    own = replace(
        example,
        after=replace(example.after, effects=(found,), covariance=example.after.covariance[:-1, :-1]),
        diagnosis=replace(example.diagnosis, effects=(taken,)),
    )
    write_results(own, tmp_path)
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["diagnosis"]["effects"][0]["parameters"][0]["unit"] == "rad/s"
    assert read_model(tmp_path / "model.json").effects[0].parameters[0].unit == "rad/s"
    page = (tmp_path / "report.html").read_text()
    assert "actuator rate limit of rudder (rate 11.5 ± 0.6 °/s)" in page
    assert "input&#39;s unit" not in page


def test_waves_are_said_by_their_period_and_as_found_apart(example):
    parts = (
        Estimated("", "frequency", 2.0, 0.02, "rad/s"),
        Estimated("", "u", 0.3, 0.02, "m/s²"),
    )
    waves = FittedEffect("waves", None, parts)
    assert effect_words(waves) == "waves (period 3.142 ± 0.031 s, u 0.300 ± 0.020 m/s²)"
    found = replace(example.diagnosis, effects=(replace(example.diagnosis.effects[0], fitted=waves),))
    page = report_page(replace(example, diagnosis=found))
    assert "apart from the rounds: waves." in page
    assert "apart from the rounds" not in report_page(example)


def test_what_is_hardly_known_takes_no_more_room_than_a_number():
    assert plus_minus(0.0, 1.3e12) == "0 ± 1.3·10¹²"
    assert interval(0.0, 1.3e12) == "[−2.55·10¹², 2.55·10¹²]"
    assert interval(0.0, 0.0) == "–"
    unknown = Estimated(
        "v", "Y_F", 0.0, 1.3e12, "1", False, reason="the standard error is 1e20 % of the value"
    )
    assert remark(unknown) == "the standard error is many times the value"


def test_powers_and_shares_as_they_are_read():
    assert in_powers("u̇ = 4.91e-05 T:propeller − 2e+03 e2") == "u̇ = 4.91·10⁻⁵ T:propeller − 2·10³ e2"
    assert [percent(v) for v in (None, 0.004, 0.32, 2.07, 1178.4)] == [
        "–",
        "0.4 %",
        "32 %",
        "207 %",
        "> 1000 %",
    ]


def test_the_last_number_below_an_axis_stays_in_the_picture():
    t = np.linspace(0.0, 100.0, 11)
    svg = stack("a", "x", [Axes("u", (Series("smooth", t, t),), (0.0, 100.0))], (0.0, 100.0))
    ends = [float(x) + 3.4 * len(w) for x, w in re.findall(r'x="(\d+)"[^>]*middle">(\d+)<', svg)]
    assert ends
    assert max(ends) <= 420


def test_a_name_longer_than_its_axis_stands_above_it_and_rest_has_round_numbers():
    t = np.linspace(0.0, 10.0, 11)
    axes = [Axes("azimuth_starboard, °", (Series("smooth", t, 0 * t),), limits_of([0 * t]), 40)]
    svg = stack("a", "x", axes, (0.0, 10.0))
    assert re.search(r'class="small"[^>]*>azimuth_starboard, °<', svg)
    assert "rotate" not in svg
    assert "0.000" not in svg
    assert "rotate" in stack("a", "x", [replace(axes[0], height=130)], (0.0, 10.0))
