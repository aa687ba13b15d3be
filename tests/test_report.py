"""The results folder: report.json, model.json, report.html and the tables."""

import json
import math
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser

import jsonschema
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from results_example import STATES, example_results, make_diagnosis

from identify.fit import Estimated, FittedEffect
from preprocess.trial import Measurement
from validate.diagnosis import Candidate, ChannelScore, Round, Verdict
from validate.report import model_schema, read_model, report_of, report_schema, write_model
from validate.report.contents import gaps
from validate.report.labels import advice_words, bars, in_words, ranked, taken_of
from validate.report.markdown import round_markdown
from validate.report.model_file import ModelFileError
from validate.report.names import file_names, slug
from validate.report.page import remark, report_page
from validate.report.plan import spread
from validate.report.schema import to_json
from validate.report.svg import Axes, Series, limits_of, path, stack, tick_text, ticks
from validate.report.tables import sampled
from validate.report.thinning import even, extremes
from validate.report.units import with_input_units
from validate.report.words import effect_words, headline, in_powers, interval, number, percent, plus_minus
from validate.report_files import write_results


@pytest.fixture(scope="module")
def results():
    return example_results()


@pytest.fixture(scope="module")
def folder(results, tmp_path_factory):
    path = tmp_path_factory.mktemp("results")
    write_results(results, path)
    return path


@pytest.fixture(scope="module")
def page(results):
    return report_page(results)


# report.json


def test_the_folder_holds_what_the_contract_lists(folder, results):
    assert {p.name for p in folder.iterdir()} == {
        "report.json", "report.html", "model.json", "recording.rrd", "predictions", "trial"}  # fmt: skip
    tables = {f"{t.name.split('/')[-1]}.parquet" for t in results.trials}
    assert {p.name for p in (folder / "predictions").iterdir()} == tables
    assert {p.name for p in (folder / "trial").iterdir()} == tables


def test_report_json_fits_its_own_schema(folder):
    report = json.loads((folder / "report.json").read_text())
    jsonschema.Draft202012Validator(report_schema()).validate(report)
    assert report["schema"] == "seatrial.report/1"
    assert report["validation"]["before"]["channels"]["u"].keys() == {"mse", "rmse", "r2", "nrmse"}
    assert report["diagnosis"]["verdict"] == "ambiguous"
    assert [r["accepted"] for r in report["diagnosis"]["rounds"]] == ["current", None]


def test_the_schema_refuses_a_report_with_a_key_too_many_or_too_few(results):
    report = json.loads(to_json(report_of(results)))
    check = jsonschema.Draft202012Validator(report_schema())
    assert not check.is_valid({**report, "extra": 1})
    del report["vessel"]
    assert not check.is_valid(report)


def test_report_json_carries_the_numbers_of_the_results(results):
    report = json.loads(to_json(report_of(results)))
    assert report["validation"]["after"]["position_rmse"] == results.validation_after.position_rmse
    assert [p["value"] for p in report["parameters"]] == [p.value for p in results.after.coefficients]
    log = report["logs"][0]
    assert (log["path"], log["bytes_damaged"]) == ("logs/zigzag0.nmea", 312)
    position = log["signals"][0]
    assert position["rate_hz"] == pytest.approx(5.0)
    assert position["outliers"] == (~results.trials[0].measurements["position"].good).sum()


def test_effects_carry_their_options_beside_their_name(results):
    effect = results.diagnosis.effects[0]
    fitted = FittedEffect("input_wiring", None, (), {"swapped": ("left", "right"), "logs": ["a.bin"]})
    changed = replace(results.diagnosis, effects=(replace(effect, fitted=fitted),))
    entry = json.loads(to_json(report_of(replace(results, diagnosis=changed))))["diagnosis"]["effects"][0]
    assert entry["swapped"] == ["left", "right"]
    assert entry["logs"] == ["a.bin"]
    assert "form" not in entry


def test_without_the_loop_diagnosis_is_null():
    report = json.loads(to_json(report_of(example_results(loop=False))))
    assert report["diagnosis"] is None
    assert report["validation"]["before"] == report["validation"]["after"]


def test_nan_and_infinity_become_null(results):
    score = ChannelScore(math.nan, math.inf, None, np.float64("nan"))
    broken = replace(results.validation_after, channels={"u": score}, fitness=math.nan)
    words = to_json(report_of(replace(results, validation_after=broken)))
    assert "NaN" not in words
    assert "Infinity" not in words
    after = json.loads(words)["validation"]["after"]
    assert after["channels"]["u"] == {"mse": None, "rmse": None, "r2": None, "nrmse": None}
    assert after["fitness"] is None


def test_a_log_whose_last_third_validates_is_one_entry_with_both_roles(results):
    first = results.trials[0]
    parts = (replace(first, role="identify"), replace(first, role="validate"))
    logs = report_of(replace(results, trials=parts)).logs
    assert [(entry.path, entry.role) for entry in logs[:1]] == [("logs/zigzag0.nmea", "both")]
    assert logs[0].signals[0].outliers == 2 * report_of(results).logs[0].signals[0].outliers


def test_gaps_are_counted_against_the_sample_time():
    t = np.array([0.0, 0.1, 0.2, 1.2, 1.3, 2.9, 3.0])
    assert gaps(Measurement("heading", t, t, 0.1, t > -1)) == 2


# model.json


def test_a_model_comes_back_as_it_was(results, tmp_path):
    fitted = FittedEffect(
        "actuator_deadband", "rudder", results.after.effects[0].parameters, {"form": "play"}
    )
    fit = replace(results.after, effects=(fitted,))
    write_model(fit, tmp_path / "model.json", {"campaign": "c.toml"})
    back = read_model(tmp_path / "model.json")
    np.testing.assert_array_equal(back.covariance, fit.covariance)
    assert replace(back, covariance=fit.covariance) == fit
    model = json.loads((tmp_path / "model.json").read_text())
    jsonschema.Draft202012Validator(model_schema()).validate(model)
    assert list(model) == [
        "schema",
        "model",
        "vessel",
        "inputs",
        "parameters",
        "covariance",
        "effects",
        "provenance",
    ]
    assert model["provenance"]["campaign"] == "c.toml"


def test_what_is_not_known_of_a_model_stays_not_known(results, tmp_path):
    covariance = results.after.covariance.copy()
    covariance[1] = np.nan
    coefficient = replace(results.after.coefficients[1], stderr=math.nan)
    fit = replace(results.after, covariance=covariance, coefficients=(coefficient,), chi2_per_dof=math.nan)
    write_model(fit, tmp_path / "model.json")
    back = read_model(tmp_path / "model.json")
    np.testing.assert_array_equal(back.covariance, covariance)
    assert math.isnan(back.coefficients[0].stderr)
    assert math.isnan(back.chi2_per_dof)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "cannot be read"),
        ("{", "is not JSON"),
        ('{"schema": "seatrial.report/1"}', "schema"),
        ("[]", "file"),
    ],
)
def test_a_file_that_is_no_model_is_refused_by_name(tmp_path, content, says):
    path = tmp_path / "x.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ModelFileError, match=says) as caught:
        read_model(path)
    assert str(path) in str(caught.value)
    assert caught.value.exit_status == 2


# tables


def test_predictions_have_the_contract_columns_with_units(folder, results):
    file = pq.ParquetFile(folder / "predictions" / "zigzag0.nmea.parquet")
    schema = file.schema_arrow
    suffixes = ("", "_measured", "_before", "_after")
    expected = {"t", "utc_ns", "role", "rudder", "n", *(s + x for s in STATES for x in suffixes)}
    assert set(schema.names) == expected
    unit = {f.name: f.metadata[b"unit"].decode() for f in schema}
    assert (unit["r_after"], unit["x_measured"], unit["rudder"], unit["n"]) == ("rad/s", "m", "rad", "rev/s")
    assert json.loads(schema.metadata[b"log"]) == "logs/zigzag0.nmea"
    table = file.read().to_pandas()
    original = results.predictions["logs/zigzag0.nmea"]
    np.testing.assert_array_equal(table["u_after"], original["u_after"])
    np.testing.assert_array_equal(table["utc_ns"], original["utc_ns"])
    assert file.read().column("x_measured").null_count == original["x_measured"].isna().sum() > 0


def test_utc_is_left_out_where_it_is_not_known(tmp_path):
    write_results(example_results(logs=1, duration=10.0, utc=False, origin=None), tmp_path)
    assert "utc_ns" not in pq.read_schema(tmp_path / "predictions" / "zigzag0.nmea.parquet").names


def test_a_state_that_is_not_predicted_is_there_and_empty(tmp_path):
    results = example_results(logs=1, duration=10.0)
    name = "logs/zigzag0.nmea"
    less = results.predictions[name].drop(columns=["u_before", "u_after", "v_before", "v_after"])
    write_results(replace(results, predictions={name: less}), tmp_path)
    table = pd.read_parquet(tmp_path / "predictions" / "zigzag0.nmea.parquet")
    assert table["u_after"].isna().all()
    assert "Δ, °/s" in (tmp_path / "report.html").read_text()


def test_trials_keep_uncertainty_units_and_history(folder, results):
    file = pq.ParquetFile(folder / "trial" / "circle1.nmea.parquet")
    table = file.read().to_pandas()
    trial = results.trials[1]
    np.testing.assert_array_equal(table["sigma_u"], trial.states["sigma_u"])
    np.testing.assert_array_equal(table["rudder"], trial.inputs["rudder"].value)
    part = json.loads(file.schema_arrow.metadata[b"parts"])[0]
    assert part["history"][0] == {
        "action": "outliers",
        "arguments": {"quantity": "position", "threshold": 4.0},
    }
    assert part["origin"] == list(trial.origin)
    assert file.schema_arrow.field("sigma_r").metadata[b"unit"] == b"rad/s"


def test_commands_are_held_and_sensors_interpolated():
    t, value = np.array([0.0, 1.0]), np.array([0.0, 2.0])
    command = Measurement("rudder", t, value, 0.0, t > -1, held=True)
    at = np.array([-0.5, 0.5, 1.5])
    np.testing.assert_array_equal(sampled(command, at), [np.nan, 0.0, 2.0])
    np.testing.assert_array_equal(sampled(replace(command, held=False), at), [np.nan, 1.0, np.nan])


def test_logs_that_share_a_file_name_get_files_of_their_own():
    names = file_names(["a/x.nmea", "b/x.nmea", "y.bin", "../c/b/x.nmea"])
    assert names["y.bin"] == "y.bin"
    assert len(set(names.values())) == 4
    assert not any("/" in n for n in names.values())


@given(st.lists(st.text("ab/._", min_size=1, max_size=8), min_size=1, max_size=6, unique=True))
def test_file_names_are_unique_and_plain(names):
    made = file_names(names)
    assert len(set(made.values())) == len(names)
    assert all("/" not in n and n not in ("", ".", "..") and slug(n) for n in made.values())


# thinning, numbers, axes


@settings(max_examples=50)
@given(st.integers(0, 3000), st.integers(4, 200), st.integers(0, 2**31))
def test_thinning_keeps_the_extremes_and_the_ends(n, most, seed):
    value = np.random.default_rng(seed).normal(size=n)
    rows = extremes(value, most)
    assert (np.diff(rows) > 0).all()
    assert len(rows) <= max(most + 2, 4)
    if n:
        assert {0, n - 1, int(value.argmin()), int(value.argmax())} <= set(rows.tolist())


def test_thinning_keeps_gaps():
    value = np.sin(np.arange(1000.0))
    value[300:400] = np.nan
    rows = extremes(value, 100)
    assert np.isnan(value[rows]).any()
    assert np.nanmax(value[rows]) == np.nanmax(value)


def test_even_rows_include_both_ends():
    assert even(10, 3).tolist() == [0, 4, 9]
    assert even(0, 3).tolist() == []


@pytest.mark.parametrize(
    ("value", "error", "expected"),
    [
        (0.178, 0.004, "0.178 ± 0.004"),
        (-1.31, 0.019, "−1.310 ± 0.019"),
        (123.4, 40.0, "123 ± 40"),
        (2.0, math.nan, "2.000"),
        (math.nan, 0.1, "–"),
        (1e-8, 1e-9, "1.000·10⁻⁸ ± 1.0·10⁻⁹"),
    ],
)
def test_a_value_is_written_as_far_as_its_error_lets_it_count(value, error, expected):
    assert plus_minus(value, error) == expected


def test_a_number_that_rounds_up_has_no_digit_too_many():
    assert [number(v) for v in (9.9999, 0.99996, 9.99)] == ["10.0", "1.00", "9.99"]


def test_numbers_have_true_minus_signs_and_dashes():
    assert [number(v) for v in (None, math.inf, 0.0, -0.5, 12345.6, 1e-7)] == [
        "–",
        "–",
        "0",
        "−0.500",
        "12346",
        "1.00·10⁻⁷",
    ]


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_ticks_are_round_and_inside(low, span):
    found = ticks(low, low + span)
    assert len(found) <= 8
    assert all(low - 1e-6 * span <= t <= low + span * (1 + 1e-6) for t in found)


def test_tick_text_has_the_decimals_of_the_step():
    assert [tick_text(v, 0.05) for v in (-0.05, 0.0, 0.1)] == ["−0.05", "0.00", "0.10"]


def test_a_diverging_prediction_does_not_squash_the_measurement():
    low, high = limits_of([np.array([0.0, 1.0])], [np.array([0.0, 1e6])])
    assert 1.0 < high < 2.0
    assert low < 0.0


def test_a_path_breaks_where_a_value_is_missing():
    drawn = path(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, np.nan, 1.0]))
    assert drawn == "M0 0l10 10M30 10h0"


# words


@pytest.mark.parametrize("verdict", Verdict)
def test_the_headline_is_one_sentence_that_names_what_was_found(results, verdict):
    found = make_diagnosis(results.after.effects[0], verdict)
    if verdict is Verdict.ADEQUATE:
        found = replace(found, effects=())
    words = headline(replace(results, diagnosis=found))
    assert words.endswith(".")
    assert words.count(". ") == 0
    assert ("a current of 0.178 m/s flowing to 75.1°" in words) == (verdict is not Verdict.ADEQUATE)
    assert ("wind" in words) == (verdict is Verdict.AMBIGUOUS)


def test_an_error_that_rises_is_said_to_rise(results):
    swapped = replace(
        results, validation_before=results.validation_after, validation_after=results.validation_before
    )
    assert "rises from" in headline(swapped)


def test_an_error_that_stays_is_not_said_to_change(results):
    assert "stays at" in headline(replace(results, validation_before=results.validation_after))


def test_hulls_are_spread_along_the_way_and_not_in_time():
    north = np.concatenate([np.zeros(1000), np.linspace(0, 100, 50)])
    rows = spread(np.column_stack([north, np.zeros(1050), np.zeros(1050)]), 5)
    np.testing.assert_allclose(north[rows], [0, 25, 50, 75, 100], atol=2.1)


def test_wiring_and_deadband_in_words(results):
    wiring = FittedEffect("input_wiring", None, (), {"swapped": ["left", "right"]})
    assert effect_words(wiring) == "input wiring: left and right swapped"
    width = replace(
        results.after.effects[0].parameters[1], name="width", value=math.radians(2), stderr=math.radians(0.3)
    )
    band = FittedEffect("actuator_deadband", "rudder", (width,), {"form": "play"})
    assert effect_words(band) == "actuator deadband of rudder as play (width 2.00 ± 0.30°)"


def test_names_in_sentences_are_words_but_those_of_inputs_and_files_stay():
    said = "Here clock_offset (yaw_rate) cannot be told from actuator_lag (n_2); see a/roll_coupling.csv, gyro_bias."
    assert in_words(said) == (
        "Here clock offset (yaw rate) cannot be told from actuator lag (n_2); see a/roll_coupling.csv, gyro bias."
    )
    assert advice_words("clock_offset: look.") == "Clock offset: look."


def tried(effect, note, evidence=1.0, input=None):
    same = {"u": 0.1, "v": 0.1, "r": 0.1}
    return Candidate(effect, input, evidence, 0.5, same, same, note)


def test_a_candidate_has_its_full_label_and_why_it_was_not_refitted(results):
    late = "not refitted: to first order it gains too little"
    candidates = (
        tried("clock_offset", "clock_offset (inputs)", 30.0),
        tried("current", "current", 20.0),
        tried("actuator_deadband", late, 40.0, "left"),
        tried("clock_offset", late, 35.0),
        tried("roll_coupling", f"roll_coupling: {late}", -3.0),
    )
    turn = Round((), candidates, "clock_offset")
    with_it = replace(results, diagnosis=replace(results.diagnosis, rounds=(turn,)))
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
    assert late in page
    assert bars(ranked(turn)) == [1.0, 20 / 30, 1.0, 1.0, 0.0]
    assert page.count("not refitted: a first look") == 2
    assert "| clock offset (inputs) |" in round_markdown(1, turn)


def test_a_limit_of_a_rudders_rate_is_in_degrees_per_second(results, tmp_path):
    rate = replace(
        results.after.effects[0].parameters[0], name="rate", value=0.2, stderr=0.01, unit="input's unit/s"
    )
    found = FittedEffect("actuator_rate_limit", "rudder", (rate,))
    taken = replace(results.diagnosis.effects[0], fitted=found)
    own = replace(
        results,
        after=replace(results.after, effects=(found,)),
        diagnosis=replace(results.diagnosis, effects=(taken,)),
    )
    write_results(own, tmp_path)
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["diagnosis"]["effects"][0]["parameters"][0]["unit"] == "rad/s"
    assert read_model(tmp_path / "model.json").effects[0].parameters[0].unit == "rad/s"
    page = (tmp_path / "report.html").read_text()
    assert "actuator rate limit of rudder (rate 11.5 ± 0.6 °/s)" in page
    assert "input&#39;s unit" not in page


def test_waves_are_said_by_their_period_and_as_found_apart(results):
    parts = (
        Estimated("", "frequency", 2.0, 0.02, "rad/s"),
        Estimated("", "u", 0.3, 0.02, "m/s²"),
    )
    waves = FittedEffect("waves", None, parts)
    assert effect_words(waves) == "waves (period 3.142 ± 0.031 s, u 0.300 ± 0.020 m/s²)"
    found = replace(results.diagnosis, effects=(replace(results.diagnosis.effects[0], fitted=waves),))
    page = report_page(replace(results, diagnosis=found))
    assert "apart from the rounds: waves." in page
    assert "apart from the rounds" not in report_page(results)


def test_what_is_hardly_known_takes_no_more_room_than_a_number():
    assert plus_minus(0.0, 1.3e12) == "0 ± 1.3·10¹²"
    assert interval(0.0, 1.3e12) == "[−2.55·10¹², 2.55·10¹²]"
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


def test_units_leave_the_one_fit_of_a_run_that_took_nothing():
    results = example_results(logs=1, duration=10.0, loop=False)
    same = with_input_units(results)
    assert same.after is same.before


# report.html


class Outline(HTMLParser):
    """Collects headings, ids, links and the attributes of every SVG."""

    def __init__(self):
        super().__init__()
        self.headings, self.ids, self.links, self.pictures, self.tags = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.append(tag)
        if re.fullmatch(r"h\d", tag):
            self.headings.append(int(tag[1]))
        if "id" in found:
            self.ids.append(found["id"])
        if tag == "a":
            self.links.append(found["href"])
        if tag == "svg":
            self.pictures.append(found)


def outline(page):
    parser = Outline()
    parser.feed(page)
    return parser


def test_the_page_needs_nothing_from_outside(page):
    assert not re.search(r"https?://", page)
    assert {"script", "img", "iframe", "object"}.isdisjoint(outline(page).tags)
    assert len(page) < 1_000_000


def test_headings_descend_in_order_and_ids_are_unique(page):
    found = outline(page)
    assert found.headings[0] == 1
    assert found.headings.count(1) == 1
    assert all(b - a <= 1 for a, b in zip(found.headings, found.headings[1:], strict=False))
    assert len(found.ids) == len(set(found.ids))
    inner = {link[1:] for link in found.links if link.startswith("#")}
    assert inner <= set(found.ids)
    assert "recording.rrd" in found.links


def test_every_picture_says_what_it_shows(page):
    pictures = outline(page).pictures
    assert len(pictures) > 20
    assert all(
        p.get("aria-hidden") == "true" or (p.get("role") == "img" and p["aria-label"]) for p in pictures
    )


def test_every_picture_is_well_formed(page):
    for svg in re.findall(r"<svg.*?</svg>", page, re.S):
        ET.fromstring(svg)
    assert "nan" not in " ".join(re.findall(r' d="([^"]*)"', page))


def test_names_from_outside_are_escaped(results):
    vessel = replace(results.after.vessel, name="<script>alert(1)</script>")
    assert "<script>" not in report_page(replace(results, after=replace(results.after, vessel=vessel)))


def test_the_page_says_what_was_found_and_what_was_wrong(page):
    for words in (
        "a current of 0.178",
        "wind would look the same",
        "checksum does not match",
        "reciprocal heading",
        "Blanke, M. (1981)",
        "the data give it only to 60 %",
    ):
        assert words in page


def test_of_two_candidates_of_one_name_only_the_better_was_taken(results):
    first = results.diagnosis.rounds[0]
    names = [("left", 10.0), ("right", 20.0), *((None, float(-k)) for k in range(18))]
    tried = tuple(replace(first.candidates[0], input=name, evidence=gain) for name, gain in names)
    found = replace(results.diagnosis, rounds=(replace(first, candidates=tried),))
    page = report_page(replace(results, diagnosis=found))
    assert page.count("✓ taken") == 1
    assert "current (right) ✓ taken" in page
    assert "8 more candidates" in page


def test_without_the_loop_the_page_has_no_before():
    page = report_page(example_results(logs=2, duration=10.0, loop=False))
    assert "switched off" in page
    assert 'class="before"' not in page


def contrast(first, second):
    """WCAG 2 contrast ratio of two #rrggbb colours."""

    def luminance(colour):
        colour = colour * 2 if len(colour) == 3 else colour
        parts = np.array([int(colour[i : i + 2], 16) for i in (0, 2, 4)]) / 255
        return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4) @ [
            0.2126,
            0.7152,
            0.0722,
        ]

    light, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def test_text_and_lines_have_enough_contrast_in_light_and_dark(page):
    blocks = re.findall(r":root \{([^}]*)\}", page)
    assert len(blocks) == 3
    for block in blocks:
        colours = dict(re.findall(r"--(\w+): #(\w+)", block))
        for ground in ("paper", "panel"):
            for text in ("ink", "muted", "before", "after", "bad", "good", "warn"):
                assert contrast(colours[text], colours[ground]) >= 4.5, (text, ground)


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PROBE = """<body><script>
const widths = [390, 1440]; let out = [];
for (const w of widths) { const f = document.createElement('iframe');
  f.style.width = w + 'px'; f.style.height = '900px'; f.src = 'report.html';
  f.onload = () => { const d = f.contentDocument.documentElement;
    const cut = [...d.querySelectorAll('svg')].filter(s => { const b = s.getBoundingClientRect();
      return [...s.querySelectorAll('text')].some(t => { const r = t.getBoundingClientRect();
        return r.left < b.left - 1 || r.right > b.right + 1 || r.top < b.top - 1 || r.bottom > b.bottom + 1; }); });
    out.push(w + ':' + (d.scrollWidth - d.clientWidth) + ':' + cut.length); document.title = out.join(' '); };
  document.body.append(f); }
</script></body>"""


@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_in_a_browser_nothing_overflows_no_label_is_cut_and_nothing_is_complained_of(folder, tmp_path):
    shutil.copy(folder / "report.html", tmp_path)
    (tmp_path / "probe.html").write_text(PROBE)
    command = [
        CHROMIUM,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-sync",
        "--disable-background-networking",
        "--disable-component-update",
        f"--user-data-dir={tmp_path / 'u'}",
        "--window-size=1600,1000",
        "--allow-file-access-from-files",
        "--enable-logging=stderr",
        "--virtual-time-budget=4000",
        "--dump-dom",
        f"file://{tmp_path / 'probe.html'}",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    title = re.search(r"<title>(.*?)</title>", done.stdout)
    assert title, done.stdout[:500]
    assert sorted(title[1].split()) == ["1440:0:0", "390:0:0"]
    assert "CONSOLE" not in done.stderr


# odd results


def with_gap(results):
    """The first log with nothing known for ten seconds, twice."""
    name = "logs/zigzag0.nmea"
    table, trial = results.predictions[name].copy(), results.trials[0]
    hole = table["t"].between(10, 20)
    columns = [c for c in table if c not in ("t", "utc_ns", "role", "rudder", "n")]
    table.loc[hole, columns] = np.nan
    states = trial.states.copy()
    states.loc[hole, [c for c in states if c != "t"]] = np.nan
    pieces = replace(trial, states=states, segments=((0.0, 10.0), (20.0, 29.95)))
    return replace(results, predictions={name: table}, trials=(pieces,))


def without_uncertainty(results):
    """Nothing known of how well the parameters are known."""
    blank = tuple(
        replace(p, stderr=math.nan, identifiable=False, reason="") for p in results.after.coefficients
    )
    fit = replace(
        results.after, coefficients=blank, covariance=np.empty((0, 0)), effects=(), chi2_per_dof=math.nan
    )
    return replace(results, after=fit, before=fit, diagnosis=None, equations=())


def yaw_alone(results):
    """A model that predicts nothing but r and psi, as Nomoto's do."""
    drop = [s + x for s in ("x", "y", "u", "v") for x in ("_before", "_after")]
    predictions = {k: t.assign(**dict.fromkeys(drop, np.nan)) for k, t in results.predictions.items()}
    none = ChannelScore(None, None, None, None)
    scores = {**results.validation_after.channels, "u": none, "v": none}
    validation = replace(results.validation_after, channels=scores, position_rmse=None, fitness=None)
    return replace(
        results, predictions=predictions, validation_before=validation, validation_after=validation
    )


def only_heading(results):
    """A log without fixes, whose reader found nothing else to say."""
    trial = results.trials[0]
    sensors = {k: m for k, m in trial.measurements.items() if k == "heading"}
    less = replace(trial, measurements=sensors, origin=None, utc_ns=None, findings=(), manoeuvre=None)
    return replace(results, trials=(less,), logs=(), actuators={}, papers=(), timing_s={})


def nothing_predicted(results):
    """Trials, but not one table of predictions."""
    return replace(results, predictions={}, actuators={})


def still_boat(results):
    """A boat that lies still: constant columns, a prediction that runs away."""
    name = "logs/zigzag0.nmea"
    table = results.predictions[name].copy()
    for state in STATES:
        table[state] = 0.0
        table[f"{state}_after"] = np.geomspace(1e-3, 1e300, len(table))
    return replace(results, predictions={name: table})


@pytest.mark.parametrize(
    "change", [with_gap, without_uncertainty, yaw_alone, only_heading, nothing_predicted, still_boat]
)
def test_odd_results_are_written_too(tmp_path, change):
    results = change(example_results(logs=1, duration=30.0))
    write_results(results, tmp_path)
    report = json.loads((tmp_path / "report.json").read_text())
    jsonschema.Draft202012Validator(report_schema()).validate(report)
    for svg in re.findall(r"<svg.*?</svg>", (tmp_path / "report.html").read_text(), re.S):
        assert "nan" not in svg
        ET.fromstring(svg)
    assert (tmp_path / "recording.rrd").stat().st_size > 1000
