"""The case studies: what the command that makes them computes, and that the prose has no number of its own."""

from __future__ import annotations

import re
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from doc_pages import ROOT

from identify.fit import FittedEffect
from validate.report_files import write_results

sys.path.insert(0, str(ROOT / "docs"))

import case_checks
import case_facts
import make_case_studies

PAGES = sorted((ROOT / "docs" / "case-studies").glob("*.md"))
TWIN = """
[vessel]
name = "Toy"
length = 1.0
beam = 0.3
[inputs.left]
kind = "thruster"
position = [-0.4, -0.3]
[inputs.right]
kind = "thruster"
position = [-0.4, 0.3]
"""
ONE = TWIN.split("[inputs.left]")[0] + '[inputs.rudder]\nkind = "rudder"\n[inputs.n]\nkind = "propeller"\n'


def case_of(tmp_path, results, toml=ONE):
    (tmp_path / "toy").mkdir()
    (tmp_path / "toy" / "campaign.toml").write_text(toml)
    write_results(results, tmp_path / "results" / "toy")
    return case_facts.Case(tmp_path / "toy", tmp_path / "results" / "toy")


@pytest.fixture(scope="module")
def case(example, tmp_path_factory):
    return case_of(tmp_path_factory.mktemp("case"), example)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_the_prose_has_no_number_that_no_command_made(page):
    prose = make_case_studies.MADE.sub("", page.read_text(encoding="utf-8"))
    prose = re.sub(r"KVLCC2|kvlcc2-hsva|SIMMAN 2008|R²", "", prose)
    assert re.findall(r"\d", prose) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_a_page_is_filled_and_shows_every_picture_of_its_own(page):
    text = page.read_text(encoding="utf-8")
    made = re.findall(r"<!-- made: (\w+) -->\n(.*?)<!-- end -->", text, re.DOTALL)
    assert len(made) >= 9
    assert [name for name, body in made if not body.strip()] == []
    assert {name for name, _ in made} <= set(make_case_studies.BLOCKS)
    shown = re.findall(r"\]\((pictures/[^)]*)\)", text)
    assert shown == list(dict.fromkeys(shown))
    assert {f"pictures/{page.stem}-{p}.png" for p in make_case_studies.CASES[page.stem]} == set(shown)
    assert all((page.parent / p).stat().st_size <= 300_000 for p in shown)


def test_every_case_has_its_page():
    assert {p.stem for p in PAGES} == set(make_case_studies.CASES)


def test_a_page_is_filled_with_the_numbers_of_the_results(case, example):
    blocks = [b for b in make_case_studies.BLOCKS if b not in ("turning", "yaw_forms")]
    text = make_case_studies.filled("".join(f"<!-- made: {b} -->\n<!-- end -->\n" for b in blocks), case)
    assert "a current of 0.178 ± 0.004 m/s flowing to" in text
    assert "on these data wind would look the same" in text
    before, after = (v.channels["u"].rmse for v in (example.validation_before, example.validation_after))
    assert f"{before:.3f} → {after:.4f}" in text
    assert "The error" not in make_case_studies.filled("untouched", case)
    assert make_case_studies.filled(text, case) == text


def test_a_result_that_is_weak_is_called_weak(example, tmp_path):
    turned = replace(
        example, validation_before=example.validation_after, validation_after=example.validation_before
    )
    text = make_case_studies.BLOCKS["outcome"](case_of(tmp_path, turned))
    assert text.count("**rises**") == 4
    assert "in 0 of 1" in text
    assert "must not be used" in text


def test_a_wiring_that_predicts_worse_is_said_to(example, tmp_path):
    wiring = FittedEffect("input_wiring", None, (), {"swapped": ["rudder", "n"]})
    taken = replace(example.diagnosis.effects[0], fitted=wiring)
    rewired = replace(example, diagnosis=replace(example.diagnosis, effects=(taken,)))
    turned = replace(
        rewired, validation_before=example.validation_after, validation_after=example.validation_before
    )
    (tmp_path / "better").mkdir()
    assert "predicted worse" not in make_case_studies.BLOCKS["verdict"](case_of(tmp_path / "better", rewired))
    assert "predicted worse" in make_case_studies.BLOCKS["verdict"](case_of(tmp_path, turned))


def test_the_command_writes_the_page_and_its_pictures_from_results_that_are_there(example, tmp_path, capsys):
    (tmp_path / "data").mkdir()
    case_of(tmp_path / "data", example)
    name, out = "kvlcc2-hsva", tmp_path / "pages"
    (tmp_path / "data" / "toy").rename(tmp_path / "data" / name)
    (tmp_path / "data" / "results" / "toy").rename(tmp_path / "data" / "results" / name)
    out.mkdir()
    (out / f"{name}.md").write_text("Prose.\n\n<!-- made: outcome -->\n<!-- end -->\n")
    where = [str(tmp_path / "data"), "--results", str(tmp_path / "data" / "results"), "--out", str(out)]
    assert make_case_studies.main([*where, "--only", name]) == 0
    made = [out / "pictures" / f"{name}-{p}.png" for p in make_case_studies.CASES[name]]
    assert capsys.readouterr().out.split() == [str(p) for p in (out / f"{name}.md", *made)]
    assert all(3_000 < p.stat().st_size < 300_000 for p in made)
    page = (out / f"{name}.md").read_text()
    assert page.startswith("Prose.")
    assert "the error of surge falls from" in page


def spinning(sign):
    """A boat that turns to the side to which it is pushed, or against it."""
    t = np.arange(0.0, 40.0, 0.1)
    left = np.sign(np.sin(t / 5.0))
    psi = -sign * 5.0 * np.cos(t / 5.0) * 0.3
    table = {"t": t, "left": left, "right": -left, "psi": psi, "r": np.gradient(psi, t), "u": 0.0 * t}
    return pd.DataFrame(table | {"x_measured": np.nan, "y_measured": np.nan})


@pytest.mark.parametrize(("sign", "says"), [(1, "the wiring is as declared"), (-1, "*against*")])
def test_a_boat_that_turns_against_its_thrusters_is_seen_without_a_model(tmp_path, example, sign, says):
    case = case_of(tmp_path, example, TWIN)
    seconds, share = case_checks.turned_as_declared(case, run := spinning(sign))
    assert seconds > 20
    assert share == (1.0 if sign > 0 else 0.0)
    assert says in case_checks.wiring_sentence(share, seconds)
    assert np.isnan(case_checks.went_as_declared(case, run))


def test_overshoots_are_those_of_the_heading_after_the_rudder_has_left():
    t = np.arange(0.0, 40.0, 0.1)
    psi = np.radians(20.0) * np.sin(2 * np.pi * t / 20.0)
    rudder = np.radians(15.0) * np.where((t < 3.0) | ((t > 13.0) & (t < 23.0)), 1.0, -1.0)
    run = pd.DataFrame(
        {"t": t, "psi": psi, "psi_after": 1.1 * psi, "rudder": rudder, "r": np.gradient(psi, t)}
    )
    at_execute = np.degrees(psi[29])
    measured, predicted = case_checks.overshoots(run), case_checks.overshoots(run, "psi_after")
    assert measured[0] == pytest.approx(20.0 - at_execute, abs=0.1)
    assert predicted[0] == pytest.approx(22.0 - at_execute, abs=0.1)
    assert len(measured) == 2


def test_the_form_of_the_yaw_equation_that_made_the_runs_follows_them_best(tmp_path, example):
    case = case_of(tmp_path, example, TWIN)
    rng = np.random.default_rng(1)
    for k, trial in enumerate(example.trials):
        t = trial.states["t"].to_numpy()
        steps = np.repeat(rng.uniform(-1.0, 1.0, (2, len(t) // 40 + 1)), 40, axis=1)[:, : len(t)]
        u, r = 1.0 + np.sin(t / 9.0 + k), np.zeros(len(t))
        push = 0.3 * (steps[0] - steps[1])
        for i in range(len(t) - 1):
            r[i + 1] = r[i] + (t[i + 1] - t[i]) * (-0.5 * r[i] - 0.8 * abs(u[i]) * r[i] + push[i])
        table = pd.DataFrame(
            {"t": t, "u": u, "v": 0.1 * np.cos(t), "r": r, "left": steps[0], "right": steps[1]}
        )
        table.to_parquet(case.results / "trial" / f"{trial.name.split('/')[-1]}.parquet")
    scores = [row.split(" | ")[2] for row in case_checks.yaw_forms(case).splitlines()[2:]]
    found = [float(s.replace("−", "-")) for s in scores]
    assert found[3] > 0.99
    assert max(found[:3]) < found[3] - 0.02
