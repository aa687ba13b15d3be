"""Comparing methods on the same data, and running fleets of campaigns."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from identification_samples import trials_of
from typer.testing import CliRunner

from ingest.errors import DataError, UsageError
from seatrial import comparison, fleet_run
from seatrial.cli import compare_command
from seatrial.cli.app import make_app
from seatrial.comparison import Method, Task, methods, models_for, score_method, table_of_methods
from seatrial.fleet_run import Options, campaigns_in, fleet, read_summary, voyages

CAMPAIGN = """
[vessel]
name = "Boat"
length = 1.2
beam = 0.9
[inputs.left]
kind = "thruster"
position = [-0.35, -0.3]
signal = "left"
[model]
name = "modulus"
[[log]]
path = "a.csv"
"""


@cache
def trials():
    return trials_of("catamaran", ("zigzag", "random", "zigzag10"), 60.0, 5)[1]


@cache
def scored(model, estimator="ls", optimiser="auto"):
    return score_method(Task(trials(), Method(model, estimator, optimiser), 0))


def test_every_combination_that_makes_a_difference():
    found = methods(["a", "b"], ["ls", "lssvm", "auto"], ["auto", "abc"])
    assert len(found) == len(set(found)) == 2 * (1 + 2 + 2)
    assert Method("a", "ls", "abc") not in found
    assert Method("a", "output_error", "abc") in found
    assert Method("a", "lssvm", "abc").label == "a, lssvm + abc"


def test_only_models_whose_inputs_exist():
    assert set(models_for(trials())) == {"linear", "modulus"}


def test_a_method_is_scored_on_logs_that_it_has_not_seen():
    row = scored("modulus", "weak_form")
    assert 0.0 < row["error"] < 0.3
    assert row["r2_r"] > 0.95
    assert row["fitness"] > 0
    assert row["seconds"] > 0
    assert row["note"] == ""


def test_where_no_log_validates_the_table_says_so():
    own = tuple(replace(t, role="identify") for t in trials())
    row = score_method(Task(own, Method("modulus", "ls"), 0))
    assert "no log validates" in row["note"]
    assert row["r2_u"] is None
    assert row["error"] == row["error_identify"]


def test_a_channel_that_is_not_predicted_counts_as_its_mean():
    # u and v as bad as their mean: the error cannot be below sqrt(2/3)
    _, own = trials_of("usv", ("zigzag", "zigzag10"), 40.0, 5)
    row = score_method(Task(own, Method("nomoto1", "ls"), 0))
    assert row["r2_u"] is None
    assert row["r2_r"] > 0.5
    assert np.sqrt(2 / 3) <= row["error"] < 1.0


def test_the_best_comes_first_and_what_failed_last():
    failed = {"model": "mmg", "estimator": "ls", "optimiser": "auto", "note": "cannot"}
    table = table_of_methods([failed, scored("linear"), scored("modulus")])
    assert table["model"].tolist() == ["modulus", "linear", "mmg"]
    assert table["error"].iloc[:2].is_monotonic_increasing
    with pytest.raises(DataError, match="cannot"):
        table_of_methods([failed])


def test_a_model_that_is_not_there_is_a_row_and_not_the_end():
    rows = comparison.rows(trials(), [Method("mmg"), Method("linear", "ls")], 0, 1, None, lambda *_: None)
    by_model = {r["model"]: r for r in rows}
    assert "[vessel.propeller] diameter" in by_model["mmg"]["note"]
    assert by_model["linear"]["error"] > 0
    with pytest.raises(UsageError):
        score_method(Task(trials(), Method("mmg"), 0))


def test_a_prediction_that_runs_away_is_said(monkeypatch):
    as_it_is = scored("modulus", "weak_form")["error"]
    good = comparison.free_run

    def away(structure, p, stretch):
        found = good(structure, p, stretch)
        found[len(found) // 2 :] = np.nan
        return found

    monkeypatch.setattr(comparison, "free_run", away)
    row = score_method(Task(trials(), Method("modulus", "weak_form"), 0))
    assert row["note"] == "runs away in 1 of 1 stretches that are predicted"
    assert row["error"] > as_it_is


def test_figures_of_any_size_keep_their_columns(capsys):
    rows = [scored("linear"), scored("modulus") | {"error": 5.1e6, "r2_u": -4e5, "note": "runs away"}]
    compare_command._show(table_of_methods(rows))
    printed = capsys.readouterr().out
    assert "5e+06" in printed
    assert "< -10" in printed
    assert "modulus ls: runs away" in printed
    assert "Optimiser" not in printed
    assert "\nError" not in printed, "an error begins with this word"
    assert max(map(len, printed.splitlines())) <= 80


def test_the_command_prints_a_table_and_draws(tmp_path, monkeypatch):
    (tmp_path / "a.csv").write_text("t\n")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    monkeypatch.setattr(comparison, "read_logs", lambda *_: [])
    monkeypatch.setattr(comparison, "runs_of", lambda *_: [])
    monkeypatch.setattr(comparison, "make_trials", lambda *_: trials())
    arguments = ["compare", str(tmp_path), "--estimator", "ls,weak_form", "--workers", "1", "--quiet"]
    shown = CliRunner().invoke(make_app(), [*arguments, "--out", str(tmp_path / "table.svg")])
    assert shown.exit_code == 0, shown.output
    lines = [line for line in shown.output.splitlines() if line.startswith(("modulus", "linear"))]
    assert sum("not compared" in line for line in lines) == 0
    assert len(lines) == 4
    assert lines[0].startswith("modulus")
    assert "abkowitz, blanke, cybership2, taylor3, zhu2019: not compared: no rudder" in shown.output
    assert (tmp_path / "table.svg").stat().st_size > 1000
    table = pd.read_csv(tmp_path / "table.csv")
    assert len(table.dropna(subset="error")) == 4
    assert table["error"].isna().tolist() == sorted(table["error"].isna())
    data = json.loads(CliRunner().invoke(make_app(), [*arguments, "--model", "linear", "--json"]).output)
    assert {row["estimator"] for row in data} == {"ls", "weak_form"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--model", "blank"], "blanke"),
        (["--out", "table.txt"], "picture"),
        (["--optimiser", "acor"], "aco_r"),
    ],
)
def test_wrong_options_are_named(options, said, tmp_path):
    done = CliRunner().invoke(make_app(), ["compare", str(tmp_path), *options])
    assert isinstance(done.exception, UsageError)
    assert said in str(done.exception)


# fleet


def campaigns(folder, *names):
    for name in names:
        (folder / name).mkdir(parents=True)
        (folder / name / "campaign.toml").write_text(CAMPAIGN)
        (folder / name / "a.csv").write_text("t\n1\n")
    return folder


def fake_run(calls):
    def run(campaign, out, **options):
        calls.append(campaign.path.parent.name)
        if campaign.path.parent.name == "bad":
            raise DataError("nothing in it.")
        if campaign.path.parent.name == "worse":
            raise RuntimeError("a fault")
        scores = {
            "channels": {c: {"r2": 0.9} for c in "uvr"}, "fitness": 0.1, "position_rmse": 1.0, "heading_rmse": 0.1,
        }  # fmt: skip
        effect = {"name": "actuator_lag", "input": "left", "look_alikes": ["actuator_delay"]}
        report = {
            "vessel": "Boat", "model": options["model"] or "modulus",
            "validation": {"before": scores | {"fitness": 0.4}, "after": scores},
            "diagnosis": {"verdict": "explained", "effects": [effect], "unexplained": {"u": 0.0, "v": 0.01, "r": 0.02}},
        }  # fmt: skip
        from pathlib import Path

        Path(out).mkdir(parents=True, exist_ok=True)
        (Path(out) / "report.json").write_text(json.dumps(report))

    return run


@pytest.fixture
def calls(monkeypatch):
    made = []
    monkeypatch.setattr("seatrial.pipeline.run", fake_run(made))
    return made


def planned(folder, **options):
    return voyages(campaigns_in([folder]), Options(**options))


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_finished_campaigns_are_not_run_again(tmp_path, calls, suffix):
    folder, summary = campaigns(tmp_path / "all", "one", "two"), tmp_path / f"fleet{suffix}"
    first = fleet(planned(folder), summary)
    assert sorted(calls) == ["one", "two"]
    assert first["status"].tolist() == ["done", "done"]
    assert first["effects"].tolist() == ["actuator_lag (left)"] * 2
    again = fleet(planned(folder), summary)
    assert len(calls) == 2
    assert again["fitness_after"].tolist() == [0.1, 0.1]
    (folder / "two" / "a.csv").write_text("t\n1\n2\n")
    fleet(planned(folder), summary)
    assert calls[2:] == ["two"]
    fleet(planned(folder, model="linear"), summary)
    assert sorted(calls[3:]) == ["one", "two"]
    fleet(planned(folder, model="linear"), summary, again=True)
    assert len(calls) == 7
    (folder / "one" / "results" / "report.json").unlink()
    fleet(planned(folder, model="linear"), summary)
    assert calls[7:] == ["one"]


def test_a_campaign_that_fails_costs_itself_alone_and_is_tried_again(tmp_path, calls):
    folder, summary = campaigns(tmp_path / "all", "bad", "good", "worse"), tmp_path / "fleet.csv"
    told = []
    table = fleet(planned(folder), summary, tell=lambda row, count, total: told.append((count, total)))
    assert table["status"].tolist() == ["failed", "done", "failed"]
    assert table["error"].tolist()[0] == "nothing in it."
    assert "unexpected RuntimeError" in table["error"].tolist()[2]
    assert told == [(1, 3), (2, 3), (3, 3)]
    fleet(planned(folder), summary)
    assert sorted(calls) == ["bad", "bad", "good", "worse", "worse"]
    assert {r["campaign"] for r in read_summary(summary)} == {v.campaign for v in planned(folder)}


def test_results_of_all_go_where_they_are_wanted(tmp_path):
    folder = campaigns(tmp_path / "all", "x/day", "y/day")
    wanted = [v.results for v in voyages(campaigns_in([folder]), Options(), tmp_path / "out")]
    assert wanted == [str(tmp_path / "out" / "day"), str(tmp_path / "out" / "day-2")]
    with pytest.raises(UsageError):
        campaigns_in([tmp_path / "nowhere"])


def test_the_command_sums_up_and_its_status_tells(tmp_path, calls):
    folder, summary = campaigns(tmp_path / "all", "good"), tmp_path / "s.csv"
    done = CliRunner().invoke(make_app(), ["fleet", str(folder), "--out", str(summary), "--workers", "1"])
    assert done.exit_code == 0, done.output
    assert "explained" in done.output
    campaigns(folder, "bad")
    failed = CliRunner().invoke(make_app(), ["fleet", str(folder), "--out", str(summary), "--workers", "1"])
    assert isinstance(failed.exception, DataError)
    assert "1 of 2" in str(failed.exception)
    assert "bad: nothing in it." in failed.output.splitlines()


def test_a_campaign_file_that_is_wrong_is_told_from_data_that_give_nothing(tmp_path, calls):
    folder, summary = campaigns(tmp_path / "all", "bad", "good", "odd"), tmp_path / "s.csv"
    (folder / "odd" / "campaign.toml").write_text(CAMPAIGN.replace("length", "lenght"))
    done = CliRunner().invoke(make_app(), ["fleet", str(folder), "--out", str(summary), "--workers", "1"])
    assert isinstance(done.exception, UsageError)
    assert "2 of 3 campaigns gave no results, 1 of them" in str(done.exception)
    assert {r["status"] for r in read_summary(summary)} == {"failed", "done", "wrong campaign"}
    reason = "".join(done.output.partition("\nodd: ")[2].split())
    assert "campaign.toml:[vessel]lenght:" in reason


def test_what_is_no_summary_is_not_overwritten(tmp_path):
    (tmp_path / "s.csv").write_text("a,b\n1,2\n")
    with pytest.raises(UsageError, match="no summary"):
        read_summary(tmp_path / "s.csv")
    with pytest.raises(UsageError, match="csv"):
        fleet_run.checked_summary(tmp_path / "s.txt")
