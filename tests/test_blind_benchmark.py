"""The blind benchmark's own arithmetic: what counts as named, detected, covered; and that no case can hang it."""

from __future__ import annotations

import json
import math
import os
import time
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.blind import detail, naming, scores, tables, workers
from benchmarks.blind.__main__ import main, read_records

CURRENT = {"name": "current", "input": None, "parameters": {"speed": 0.2, "direction": 6.2}}


def named(name: str, input: str | None = None, alike: tuple[str, ...] = (), **options: Any) -> dict[str, Any]:
    return {
        "name": name, "input": input, "parameters": {}, "p_value": 1e-9, "look_alikes": list(alike), **options,
    }  # fmt: skip


def record(**changes: Any) -> dict[str, Any]:
    base = {
        "seed": 1, "asked": "all", "kind": "one", "status": "ok", "truth": [CURRENT], "strengths": [0.9],
        "verdict": "explained", "named": [named("current")], "unexplained": {"u": 0.0, "v": 0.0, "r": 0.0},
        "rounds": [], "errors": {"before": 2.0, "after": 1.0}, "seconds": 4.0, "cpu_seconds": 3.0,
        "chi2": {"before": 5.0, "after": 1.0}, "advice": "", "timing": {},
        "oracle": {"error": 1.0, "chi2": 1.0, "share": {"u": 0.0}, "effects": [
            {"gain": 50.0, "raises": 2.0, "rivals": {"wind": 20.0}, "parameters": {}, "deviations": {}}]},
    }  # fmt: skip
    return base | changes


def test_an_effect_on_another_input_is_another_effect() -> None:
    true = {"name": "actuator_lag", "input": "left", "parameters": {}}
    assert naming.same_cause(true, named("actuator_lag", "left"))
    assert not naming.same_cause(true, named("actuator_lag", "right"))
    assert not naming.same_cause(true, named("actuator_delay", "left"))


def test_streams_and_wirings_must_agree_and_forms_need_not() -> None:
    late = {"name": "clock_offset", "input": None, "parameters": {}, "stream": "heading"}
    assert not naming.same_cause(late, named("clock_offset", stream="position"))
    assert naming.same_cause(late, named("clock_offset", stream="heading"))
    crossed = {"name": "input_wiring", "input": None, "parameters": {}, "swapped": ["a", "b"]}
    assert naming.same_cause(crossed, named("input_wiring", swapped=["b", "a"]))
    assert not naming.same_cause(crossed, named("input_wiring", reversed=["a"]))
    slack = {"name": "actuator_deadband", "input": "left", "parameters": {}, "form": "play"}
    assert naming.same_cause(slack, named("actuator_deadband", "left", form="neutral"))


def test_directions_are_compared_the_short_way_round() -> None:
    found = named("current") | {"parameters": {"speed": [0.21, 0.01], "direction": [0.02, 0.1]}}
    z = naming.deviations(CURRENT, found)
    assert z["speed"] == pytest.approx(1.0)
    assert z["direction"] == pytest.approx((0.02 + 2 * math.pi - 6.2) / 0.1)


def test_a_ratio_named_on_the_other_of_a_pair_is_inverted() -> None:
    true = {"name": "thrust_asymmetry", "input": "left", "parameters": {"ratio": 0.8}}
    assert naming.true_values(true, named("thrust_asymmetry", "left"))["ratio"] == 0.8
    assert naming.true_values(true, named("thrust_asymmetry", "right"))["ratio"] == pytest.approx(1.25)


def test_heavier_in_some_logs_is_lighter_in_the_others() -> None:
    among = ["a", "b", "c"]
    true = {
        "name": "mass_change",
        "input": None,
        "parameters": {"ratio": 1.25},
        "logs": ["a"],
        "among": among,
    }
    others = named("mass_change", logs=["b", "c", "unseen"], among=among)
    assert naming.same_cause(true, others)
    assert naming.true_values(true, others)["ratio"] == pytest.approx(0.8)
    assert naming.true_values(true, named("mass_change", logs=["a"], among=among))["ratio"] == 1.25
    assert not naming.same_cause(true, named("mass_change", logs=["b"], among=among))


def test_labels_are_those_of_the_look_alikes() -> None:
    slack = {"name": "actuator_deadband", "input": "left", "parameters": {}, "form": "play"}
    assert naming.label_of(slack) == "actuator_deadband (left, play)"
    assert naming.alike(slack, ["current", "actuator_deadband (left, play)"])
    assert naming.alike(slack, ["actuator_deadband"])
    heavy = {"name": "mass_change", "input": None, "parameters": {}, "logs": ["b.nmea", "c.nmea"]}
    assert naming.label_of(heavy) == "mass_change (b.nmea and c.nmea)"
    assert naming.alike(heavy, ["mass_change (a.nmea)"])
    assert not naming.alike(slack, ["actuator_deadband (right, play)"])


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_holds_the_share_and_stays_within_bounds(case: tuple[int, int]) -> None:
    good, of = case
    low, high = scores.wilson(good, of)
    assert -1e-12 <= low <= good / of + 1e-12
    assert good / of - 1e-12 <= high <= 1 + 1e-12


def test_wilson_is_that_of_the_literature() -> None:
    assert scores.wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=2e-4)  # Newcombe 1998, table I
    assert scores.wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=2e-4)


def test_look_alikes_count_only_under_the_verdict_ambiguous() -> None:
    other = [named("wind", alike=("current",))]
    assert scores.all_named(record(verdict="ambiguous", named=other))
    assert not scores.all_named(record(verdict="explained", named=other))
    assert not scores.all_named(record(verdict="unexplained"))
    assert scores.all_listed(record(verdict="unexplained"))


def test_sole_and_right_allows_no_other_name() -> None:
    assert scores.sole_and_right(record())
    assert not scores.sole_and_right(record(named=[named("current"), named("gyro_bias")]))
    assert not scores.sole_and_right(record(verdict="ambiguous"))


def test_a_case_without_an_answer_is_a_miss() -> None:
    failed = {"seed": 7, "asked": "all", "kind": "clean", "status": "failed", "truth": [], "why": "late"}
    share = scores.share_of([failed], scores.adequate)
    assert (share.good, share.of, share.misses) == (0, 1, (7,))


def test_only_what_matters_and_can_be_told_apart_is_asked_for() -> None:
    faint = {"gain": 9.0, "raises": 1.1, "rivals": {}, "parameters": {}, "deviations": {}}
    assert not scores.detectable(record(oracle={"error": 1.0, "effects": [faint]}))
    unseen = faint | {"raises": 3.0, "gain": 0.0}
    assert not scores.detectable(record(oracle={"error": 1.0, "effects": [unseen]}))
    twin = faint | {"raises": 3.0, "rivals": {"wind": 1.0}}
    assert scores.detectable(record(oracle={"error": 1.0, "effects": [twin]}))
    assert not scores.told_apart(record(oracle={"error": 1.0, "effects": [twin]}))
    assert scores.told_apart(record())
    assert not scores.detectable(record(oracle={"missing": "no such effect"}))


def test_tables_hold_every_case_and_survive_failures() -> None:
    failed = {"seed": 7, "asked": "all", "status": "failed", "why": "the process died"}
    records = [record(), record(seed=2, kind="clean", truth=[], named=[], verdict="adequate"), failed]
    text = tables.summary(records)
    assert "the process died" in text
    assert "1/1" in text
    assert "current" in tables.each(records[0])
    assert "leaving it out" in detail.told(records[0])


def test_stored_results_are_read_back_and_the_last_of_a_case_counts(
    tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "results.jsonl"
    lines = [record(verdict="unexplained"), record(seed=2), record()]
    file.write_text("".join(json.dumps(r) + "\n" for r in lines))
    assert [r["verdict"] for r in read_records(file)] == ["explained", "explained"]
    main(["--print", str(file)])
    assert "2 cases" in capsys.readouterr().out


class Stuck:
    """A process that never answers."""

    killed = False

    def kill(self) -> None:
        self.killed = True

    def join(self) -> None:
        pass


def test_a_case_whose_time_is_up_is_ended() -> None:
    worker = workers._Worker(Stuck(), None, record={"seed": 3, "asked": "all"}, step=1)  # type: ignore[arg-type]
    worker.deadline = time.monotonic() + 60.0
    assert not workers._late(worker)
    worker.deadline = time.monotonic() - 1.0
    assert workers._late(worker)
    assert worker.process.killed  # type: ignore[attr-defined]
    ended = workers._ended(worker)
    assert ended["status"] == "failed"
    assert "diagnosing" in ended["why"]


@pytest.mark.slow
def test_a_drawn_case_goes_through_files_and_comes_back_with_an_answer() -> None:
    task = workers.Task(seed=5013, kind="clean", oracle=False)
    before = dict(os.environ)
    (found,) = workers.run_cases([task], 1, limit=300.0)
    assert dict(os.environ) == before
    assert found["status"] == "ok", found.get("why")
    assert found["kind"] == "clean"
    assert found["verdict"] in ("adequate", "explained", "ambiguous", "unexplained")


def test_what_is_started_has_one_thread_and_who_starts_it_keeps_his(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    before = dict(os.environ)
    with workers.one_thread():
        assert {os.environ[name] for name in workers.THREADS} == {"1"}
    assert dict(os.environ) == before
