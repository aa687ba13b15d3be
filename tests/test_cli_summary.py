"""The answer in a screenful: names that fit, findings of a kind once, units for reading."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.results_example import example_results
from ingest.log import Finding, Log
from seatrial.cli.summary import finding_lines, lasts, summary
from seatrial.cli.tables import say
from validate.report.names import short_names
from validate.report.reading import and_others

LONG = "HSVA_CPMC_KVLCC2_Z_{}_01.dat"


@pytest.fixture(scope="module")
def results():
    made = example_results(logs=3, duration=20.0)
    named = {t.name: LONG.format(k) for k, t in enumerate(made.trials)}
    trials = tuple(
        replace(
            t,
            name=named[t.name],
            findings=(f"{2 + k}.1% were set aside.", "The logs to identify on: one speed."),
        )
        for k, t in enumerate(made.trials)
    )
    tables = {named[name]: table for name, table in made.predictions.items()}
    return replace(made, trials=trials, predictions=tables, logs=())


def test_a_screen_of_80_columns_holds_it_and_long_names_do_not_wrap(results, capsys):
    say(*summary(results))
    said = capsys.readouterr().out
    assert max(map(len, said.splitlines())) <= 80
    for k in range(3):
        assert f"\n…{k}_01.dat" in said
    assert "KVLCC2" not in said
    assert "yaw rate r, °/s" in said
    assert "position, m" in said


def test_findings_of_a_kind_are_said_once_with_their_log(results):
    assert list(finding_lines(results))[:2] == [
        "  · …0_01.dat: 2.1% were set aside. The like in 2 more.",
        "  · The logs to identify on: one speed.",
    ]
    assert len(list(finding_lines(results, most=None))) > 5


def test_what_cannot_be_used_is_said_before_anything_else(results):
    *others, last = results.trials
    left_out = replace(last, segments=(), findings=("Nothing of this log can be used.",))
    first, *_ = finding_lines(replace(results, trials=(*others, left_out)))
    assert first.endswith("2_01.dat: Nothing of this log can be used.")


def with_findings(results, *findings):
    names = [t.name for t in results.trials]
    return replace(results, logs=tuple(Log(Path(n), "csv", {}, findings=findings) for n in names))


def test_clock_jumps_duplicates_and_damage_are_told_before_what_else_was_noticed(results):
    found = with_findings(
        results,
        Finding("note", "nothing of weight"),
        Finding("clock", "a clock that was set back by 29.9 s"),
        Finding("duplicate", "172 records were logged twice", count=172),
        *(Finding("damaged", f"{n} bytes that are no record", n, n) for n in (40, 50, 60)),
        Finding("truncated", "the last line is cut off"),
    )
    assert list(finding_lines(found))[:4] == [
        "  · a clock that was set back by 29.9 s",
        "  · 172 records were logged twice",
        "  · 40 bytes that are no record, the first of 3 such",
        "  · the last line is cut off",
    ]
    lines = list(finding_lines(found, most=None))
    assert "  · …0_01.dat: nothing of weight" in lines
    assert "  · …0_01.dat: 172 records were logged twice" in lines
    assert "  · …2_01.dat: 60 bytes that are no record" in lines


def test_of_a_log_that_is_used_in_part_the_part_is_said(results):
    trial = results.trials[0]
    assert lasts(20.0, [trial]) == "20.0 s"
    assert lasts(120.0, [trial]) == "19.9 s of 2 min 00 s"
    parts = [
        replace(trial, states=trial.states[at]) for at in (trial.states["t"] < 9.0, trial.states["t"] > 11.0)
    ]
    assert lasts(20.0, parts) == "20.0 s"
    assert lasts(60.0, []) == "60.0 s"


def test_a_question_ends_with_its_mark():
    assert and_others("is its unit right?", 2) == "is its unit right? The like in 2 more."
    assert and_others("It is.", 1) == "It is. The like in 1 more."


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        (["00000216.bin", "00000220.bin"], ["00000216.bin", "00000220.bin"]),
        ([LONG.format(1), LONG.format(12)], ["…1_01.dat", "…12_01.dat"]),
        (["a_very_long_name_of_one_log.bin"], ["a_very_long_name_of_one_log.bin"]),
        (
            ["abcdefghijklmnopqrstuv.a", "abcdefghijklmnop.a"],
            ["abcdefghijklmnopqrstuv.a", "abcdefghijklmnop.a"],
        ),
    ],
)
def test_names_lose_only_what_all_begin_with_up_to_the_end_of_a_word(names, shown):
    assert list(short_names(names).values()) == shown
