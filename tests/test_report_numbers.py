"""Thinning, numbers and axes of the report."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.physical import Physical
from validate.report.svg import Axes, Series, limits_of, path, stack, tick_text, ticks
from validate.report.thinning import even, extremes
from validate.report.words import number, plus_minus, share


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


def test_a_physical_value_has_no_digit_that_its_error_does_not_let_count():
    assert str(Physical("T", 5.12345, 0.0412, "s")) == "T = 5.12 ± 0.04 s"
    assert str(Physical("N_v'", -0.013742, 0.0012, "1")) == "N_v' = −0.0137 ± 0.0012"


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
    assert 2 <= len(found) <= 8
    assert all(low - 1e-6 * span <= t <= low + span * (1 + 1e-6) for t in found)


@pytest.mark.parametrize(("low", "high"), [(-0.45, 0.45), (-0.46, 0.03), (0.9, 1.4), (-0.001, 0.0049)])
def test_a_low_plot_has_two_ticks_at_least(low, high):
    found = ticks(low, high, most=3)
    assert len(found) >= 2
    assert all(low - 1e-9 <= t <= high + 1e-9 for t in found)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (0.9991, "0.9991"), (0.99995, "0.99995"), (0.999, "0.999"), (0.99876, "0.9988"), (0.9999953, "0.999995"),
        (0.98, "0.980"), (1.0, "1.000"), (1.0 - 1e-9, "1.000"), (-0.12, "−0.120"), (-12.3, "−12.3"), (None, "–"),
    ],
)  # fmt: skip
def test_an_r2_near_one_has_the_digits_that_tell_it_from_another(value, says):
    assert share(value) == says


def test_tick_text_has_the_decimals_of_the_step():
    assert [tick_text(v, 0.05) for v in (-0.05, 0.0, 0.1)] == ["−0.05", "0.00", "0.10"]


def test_a_diverging_prediction_does_not_squash_the_measurement():
    low, high = limits_of([np.array([0.0, 1.0])], [np.array([0.0, 1e6])])
    assert 1.0 < high < 2.0
    assert low < 0.0


def test_a_path_breaks_where_a_value_is_missing():
    drawn = path(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, np.nan, 1.0]))
    assert drawn == "M0 0l10 10M30 10h0"


def test_a_line_is_marked_at_the_edge_where_it_leaves_the_plot_and_comes_back():
    t = np.linspace(0.0, 100.0, 1001)
    y = np.where((t > 20) & (t < 30), 5.0, np.where((t > 60) & (t < 61), -5.0, 0.0))
    axes = Axes(
        "u", (Series("before", t, y), Series("after", t, 0.1 * y), Series("raw", t, y, "dots")), (-1.0, 1.0)
    )
    svg = stack("a", "", [axes], (0.0, 100.0))
    (marks,) = re.findall(r'<path class="cut before" d="([^"]*)"', svg)
    places = [tuple(map(float, p.split())) for p in re.findall(r"M([\d. ]+)l", marks)]
    assert [x for x, _ in places] == pytest.approx([52 + 3.6 * t for t in (20.1, 29.9, 60.1)], abs=1)
    assert [y for _, y in places] == [8.0, 8.0, 138.0]
    assert 'class="cut after"' not in svg
    swings = Axes("u", (Series("before", t, 5.0 * np.sin(40 * t)),), (-1.0, 1.0))
    assert (
        len(re.findall("M", re.search('cut before" d="([^"]*)"', stack("a", "", [swings], (0, 100)))[1]))
        < 100
    )
