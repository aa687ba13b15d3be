"""Intervals of simulated measures: none from the draws that are left of many, and none without its own value."""

from __future__ import annotations

import math

import numpy as np
import pytest
from identification_samples import RUDDER
from test_simulate import fit_of

from identify.simulate import Order, simulate
from identify.simulate.drawn import _positive
from identify.simulate.intervals import Draws, measure_of, remarks

NAN = math.nan


def drawn(missing, count=100):
    return np.array([*np.linspace(1.0, 2.0, count - missing), *[NAN] * missing])


@pytest.mark.parametrize("missing", [6, 50, 95])
def test_draws_that_are_left_of_many_make_no_interval(missing):
    found = measure_of("advance", 1.5, drawn(missing), None)
    assert found.value == 1.5
    assert all(math.isnan(x) for x in (found.stderr, found.low, found.high))


@pytest.mark.parametrize("missing", [0, 5])
def test_a_few_that_are_missing_leave_an_interval(missing):
    found = measure_of("advance", 1.5, drawn(missing), None)
    assert 1.0 < found.low < 1.1
    assert 1.9 < found.high < 2.0
    assert found.stderr > 0.25


@pytest.mark.parametrize("value", [0.0, 0.9, 2.5])
def test_an_interval_holds_its_value(value):
    found = measure_of("loop_width", value, drawn(0), None)
    assert found.low <= value <= found.high
    assert (found.low, found.high) != (value, value)


def test_what_was_not_reached_has_no_interval():
    assert math.isnan(measure_of("period", NAN, drawn(0), None).high)


@pytest.mark.parametrize(
    ("failed", "said"),
    [
        (0, []),
        (2, ["2 of 100 draws", "the intervals are those of the rest"]),
        (30, ["30 of 100 draws", "no interval is given"]),
        (95, ["95 of 100 draws", "no interval is given", "do not rely on its measures"]),
    ],
)
def test_draws_that_failed_are_said_with_what_it_means(failed, said):
    draws = Draws({"advance": drawn(failed)}, np.zeros((0, 0, 2)), 100, failed)
    text = " ".join(remarks(draws, [measure_of("advance", 1.5, draws.values["advance"], None)]))
    assert all(words in text for words in said)
    assert bool(text) == bool(said)
    assert ("do not rely" in text) == (failed > 50)


def test_a_measure_that_some_draws_stop_short_of_is_named():
    draws = Draws({"advance": drawn(0), "time_to_180": drawn(12)}, np.zeros((0, 0, 2)), 100, 0)
    measures = [measure_of(n, 1.5, v, None) for n, v in draws.values.items()]
    assert remarks(draws, measures) == [
        "No interval, since draws did not come so far: time to 180 (12 of 100)."
    ]


def test_a_manoeuvre_that_many_draws_cannot_sail_has_no_intervals():
    fit = fit_of({("r", "r"): -0.05, ("r", "δ"): 0.4}, "nomoto1", (RUDDER,), spread=6.0)
    found = simulate(fit, Order("circle", 0.3, speed=1.0, samples=60))
    assert found.failed > 0.1
    assert math.isfinite(found["advance"].value)
    assert all(math.isnan(m.low) and math.isnan(m.stderr) for m in found.measures)
    assert any("no interval is given" in note for note in found.notes)


def runaway(spread, **options):
    fit = fit_of({("r", "r"): -0.05, ("r", "δ"): 0.4}, "nomoto1", (RUDDER,), spread=spread, **options)
    return simulate(fit, Order("circle", 0.3, speed=1.0, samples=60))


def test_standard_errors_that_account_for_logs_left_out_hold_to_first_order():
    found, near = runaway(1.2, misfit=3.0), runaway(0.012)
    assert found.failed > 0.1
    for measure, small in zip(found.measures, near.measures, strict=True):
        assert measure.low <= measure.value <= measure.high
        assert measure.stderr == pytest.approx(100.0 * small.stderr, rel=0.05)
    assert any("small draws, made larger in proportion" in note for note in found.notes)


def test_whole_draws_that_can_be_sailed_are_the_intervals_far_from_the_noise_too():
    assert runaway(0.06, misfit=3.0).measures == runaway(0.06).measures


def test_what_no_draw_has_below_nothing_is_never_below_it():
    assert _positive({"advance": np.array([0.5, NAN, 2.0]), "transfer": np.array([0.5, -0.1])}) == {"advance"}
    wide = np.linspace(-2.0, 6.0, 100)
    free, ended = (measure_of("advance", 2.0, wide, None, least) for least in (-math.inf, 0.0))
    assert free.low < -1.0
    assert (ended.low, ended.high, ended.stderr) == (0.0, free.high, free.stderr)
