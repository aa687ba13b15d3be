"""The answer in a screenful: names that fit, findings of a kind once, units for reading."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.results_example import example_results
from seatrial.cli.summary import finding_lines, summary
from seatrial.cli.tables import say
from validate.report.names import short_names

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
