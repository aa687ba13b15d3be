"""What the error of a first state makes of a free run, and that the report's band counts it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from identification_samples import trials_of

from identify.base_fit import fit_from_scratch
from identify.predict import free_run
from identify.prepare import prepare
from validate.carried import carried_on, carried_tables
from validate.report.figures import carried_sigma
from validate.report.page import report_page


@pytest.fixture(scope="module")
def fitted():
    _, trials = trials_of("usv", ("zigzag", "random", "circle"), 60.0, 5, ())
    prepared = prepare(trials, "modulus")
    return fit_from_scratch(prepared.structure, prepared.identify)


def test_a_sway_that_was_off_dies_away_and_the_heading_that_turned_by_it_stays_off(fitted):
    s = fitted.solution
    stretch = fitted.problem.stretches[0]
    sigmas = np.vstack([[[0.0, 0.04, 0.0]], stretch.sigmas[1:]])
    spread = carried_on(s.structure, s.p, replace(stretch, sigmas=sigmas))
    states = stretch.states.copy()
    states[0, 4] += 0.04
    moved = free_run(s.structure, s.p, replace(stretch, states=states)) - free_run(s.structure, s.p, stretch)
    np.testing.assert_allclose(spread, np.abs(moved), atol=1e-9)
    assert spread[0, 4] == pytest.approx(0.04)
    assert spread[-1, 4] < 0.1 * spread[0, 4]
    assert spread[-1, 2] > 0.5 * spread[:, 2].max() > 0.0


def test_free_runs_of_a_true_model_are_as_far_off_in_heading_as_their_first_states_say(fitted):
    s, ratios = fitted.solution, []
    for seed in range(12):
        _, trials = trials_of("usv", ("circle",), 20.0, seed, (), validate=0)
        stretch = prepare(trials, "modulus").identify[0]
        error = (free_run(s.structure, s.p, stretch) - stretch.states)[-1, 2]
        ratios.append(error / np.hypot(0.002 * np.sqrt(2), carried_on(s.structure, s.p, stretch)[-1, 2]))
    assert 0.6 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def test_the_tables_have_the_rows_of_the_predictions(fitted):
    s, stretch = fitted.solution, fitted.problem.stretches[0]
    t = np.linspace(stretch.grid[0], stretch.grid[-1] + 1.0, 50)
    table = carried_tables(s.structure, s.p, [stretch], {stretch.name: pd.DataFrame({"t": t})})[stretch.name]
    assert table["psi"].iloc[:48].notna().all()
    assert np.isnan(table["psi"].iloc[-1])
    assert carried_sigma(t, table, "psi")[-1] == 0.0


def test_the_band_of_the_report_counts_it(example):
    name = next(iter(example.predictions))
    t = example.predictions[name]["t"]
    wide = pd.DataFrame({"t": t, **{c: np.full(len(t), 0.2) for c in ("u", "v", "r", "psi")}})
    plain, counted = report_page(example), report_page(replace(example, carried={name: wide}))
    assert plain.count('class="band"') == counted.count('class="band"')
    assert plain != counted
    assert "what the error of the first state makes of the prediction" in plain
