"""What rounds are said to have come to: what was taken and stands, what does not, and what was only looked at."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import jsonschema
import pytest

from identify.effect import Active, Variant
from identify.effects import EFFECTS
from validate.became import became, left_out_words
from validate.diagnosis import Candidate, Round
from validate.outcome import Outcome
from validate.report import report_of, report_schema
from validate.report.contents import candidate_entry
from validate.report.labels import outcome_words, ranked
from validate.report.markdown import round_markdown
from validate.report.page import report_page
from validate.report.round_rows import found_apart
from validate.report.schema import to_json
from validate.verdict import _looked_at, _round, diagnose

BY_NAME = {e.name: e for e in EFFECTS}


def active(name, input=None, **options):
    return Active(BY_NAME[name], Variant(input, options))


def outcome(taken, standing, **known):
    turns = [SimpleNamespace(taken=a and SimpleNamespace(screened=SimpleNamespace(active=a))) for a in taken]
    return Outcome(None, tuple(turns), tuple(SimpleNamespace(active=a) for a in standing), None, **known)


WIND, TURNING = active("wind"), active("turning_resistance")
LATE = active("clock_offset", stream="position")
LAG, SHOAL = active("actuator_lag", "rudder"), active("shallow_water", logs=("a.csv",), form="coupled")
WHOLE = active("shallow_water", logs=("a.csv", "b.csv"), form="whole")
WALK = Active(BY_NAME["propeller_walk"], Variant("left", {}, ("right",)))


@pytest.mark.parametrize(
    ("taken", "standing", "known", "stands", "says"),
    [
        ((TURNING, WIND, None), (TURNING,), {}, [True, False, None],
         "left out again: beside turning_resistance it explains no more than chance does"),
        ((TURNING, WIND), (TURNING, LATE), {}, [True, False],
         "left out again: clock_offset (position), which no round took, came in instead"),
        ((WIND,), (), {}, [False], "left out again: looked at once more it explains no more than chance does"),
        ((SHOAL,), (WHOLE,), {}, [True], f"at the end {WHOLE.label}"),
        ((WALK,), (active("propeller_walk", "left"), active("propeller_walk", "right")), {}, [True],
         "at the end propeller_walk (left)"),
        ((LAG,), (active("actuator_lag", "propeller"),), {}, [False],
         "left out again: actuator_lag (propeller), which no round took, came in instead"),
        ((WIND, WIND), (WIND,), {}, [True, True], ""),
        ((SHOAL,), (), {"unsure": (WHOLE.label,)}, [False], "not kept: its value may as well be nothing"),
        ((WIND,), (), {"refuted": ("wind",)}, [False], "taken back: unseen or whole logs"),
        ((LATE,), (), {"slight": (LATE.label,)}, [False], "no more than any logger's"),
    ],
)  # fmt: skip
def test_what_became_of_an_effect_that_a_round_took(taken, standing, known, stands, says):
    found = became(outcome(taken, standing, **known))
    assert [b and b.stands for b in found] == stands
    assert [b for b in found if b][-1].remark.startswith(says)


def test_what_was_left_out_again_is_told_once_and_nothing_that_other_advice_tells():
    assert left_out_words(outcome((TURNING, WIND, WIND), (TURNING,))) == [
        "Taken in a round and left out again: wind: beside turning_resistance it explains no more than chance does."
    ]
    assert left_out_words(outcome((WIND,), (), refuted=("wind",))) == []
    assert left_out_words(outcome((WIND,), (WIND,))) == []


def with_rounds(example, *rounds):
    return replace(example, diagnosis=replace(example.diagnosis, rounds=rounds))


def written(results):
    report = json.loads(to_json(report_of(results)))
    jsonschema.Draft202012Validator(report_schema()).validate(report)
    return report["diagnosis"]["rounds"]


def test_a_round_says_that_what_it_took_was_left_out_again(example):
    first, last = example.diagnosis.rounds
    gone = replace(first, stands=False, remark="left out again: beside clock_offset it explains nothing")
    results = with_rounds(example, gone, replace(first, remark="at the end current"), last)
    page = report_page(results)
    assert "Round 1: current taken, left out again: beside clock offset it explains nothing</h3>" in page
    assert "Round 2: current taken (at the end current)</h3>" in page
    assert page.count("current ✓ taken, not kept") == 1
    assert "taken, not kept |" in round_markdown(1, gone)
    entries = written(results)
    assert [r["stands"] for r in entries] == [False, True, None]
    assert entries[0]["note"].startswith("left out again")
    assert outcome_words(last) == "nothing taken"


def test_a_round_of_the_loop_has_what_became_of_it(monkeypatch):
    monkeypatch.setattr("validate.verdict.cross_validated", lambda fitted: {"u": 0.1})
    monkeypatch.setattr("validate.verdict.residual_tests", lambda fitted: ())
    made = outcome((WIND,), ())
    turn = SimpleNamespace(base=None, screened=(), judged=(), taken=made.turns[0].taken)
    found = _round(turn, became(made)[0])
    assert (found.accepted, found.stands) == ("wind", False)
    assert found.remark.startswith("left out again")


def test_of_a_candidate_that_was_not_refitted_nothing_is_said_to_be_measured(example):
    seen = _looked_at(SimpleNamespace(active=LATE), {"u": 0.1, "v": 0.1, "r": 0.1}, 51.9)
    fitted = Candidate("wind", None, 22.5, 0.001, {"u": 0.1}, {"u": 0.05}, "wind", 60.0)
    little = replace(seen, promise=-3.0)
    turn = Round((), (little, seen, fitted), "wind")
    assert ranked(turn) == [fitted, seen, little]
    page = report_page(with_rounds(example, turn))
    assert "not refitted: a first look promises 51.9" in page
    assert "not refitted: it promises too little" in page
    assert '<td class="n">51.9</td>' not in page
    assert page[page.index('id="tests"') :].count('<span class="bar"') == 1
    entry = written(with_rounds(example, turn))[0]["candidates"][1]
    assert (entry["evidence"], entry["p_value"]) == (None, None)
    assert entry["rmse_after"] == {"u": None, "v": None, "r": None}
    assert entry["rmse_before"]["u"] == 0.1
    assert entry["promise"] == 51.9
    assert entry["note"].startswith("not refitted")


def test_errors_that_are_not_known_because_predictions_ran_away_are_explained():
    far, near = {"u": math.inf}, {"u": 0.1}
    notes = [
        candidate_entry(Candidate("wind", None, 1.0, 0.1, before, after, "wind")).note
        for before, after in ((far, near), (near, far), (far, far), (near, near))
    ]
    assert notes == [
        "cross-validated, predictions ran away without it",
        "cross-validated, predictions ran away with it",
        "cross-validated, predictions ran away without it and with it",
        "",
    ]


def test_what_is_material_is_kept_as_the_run_was_told(monkeypatch):
    for name, found in (("_left", {"u": 0.06}), ("_undetermined", {}), ("_taken", ())):
        monkeypatch.setattr(f"validate.verdict.{name}", lambda *_, found=found: found)
    after = SimpleNamespace(problem=SimpleNamespace(swell=None, stretches=({},), unlogged=None))
    monkeypatch.setattr("validate.verdict.advice_for", lambda *_: "")
    found = diagnose(None, outcome((), ()), after, None, 0.05)
    assert (found.materiality, found.verdict.name) == (0.05, "UNEXPLAINED")


def test_an_effect_that_came_in_another_s_place_is_not_said_to_have_a_test_of_its_own(example):
    late = replace(example.diagnosis.effects[0].fitted, name="clock_offset")
    waves = replace(late, name="waves")
    effects = tuple(replace(example.diagnosis.effects[0], fitted=f) for f in (late, waves))
    assert found_apart(replace(example.diagnosis, effects=effects)) == [
        "Found by a test of its own, apart from the rounds: waves.",
        "Came in once the rounds were through, in the place of what they took: clock offset.",
    ]
    assert found_apart(example.diagnosis) == found_apart(None) == []
