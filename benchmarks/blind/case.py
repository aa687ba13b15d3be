"""One case: drawn, written as files, diagnosed from the files, and put beside the truth."""

from __future__ import annotations

import json
import math
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from benchmarks.blind.naming import entry_of
from benchmarks.blind.oracle import Truth, consult, prediction_error
from fixtures.blind import draw_case, record_case, write_case
from seatrial.campaign import load_campaign
from seatrial.pipeline import run
from validate.diagnosis import Candidate, Results, Round, TakenEffect

#: Candidates of each round that a record keeps.
KEPT = 6
#: What of the drawn truth a record keeps.
TOLD = ("vessel", "format", "exact_model", "declared_model", "strengths", "manoeuvres", "duration")


def steps_of(seed: int, kind: str | None, keep: Path | None, oracle: bool) -> Iterator[dict[str, Any]]:
    """Yield what is known of a case step by step: its truth, the answer, what the oracle says."""
    folder = keep or Path(tempfile.mkdtemp(prefix="blind-"))
    try:
        began = time.perf_counter()
        case = folder / f"{kind or 'drawn'}-{seed}"
        drawn = draw_case(seed, kind)
        told = write_case(drawn, case)
        yield {
            "kind": told["kind"],
            "truth": told["effects"],
            "draw_seconds": round(time.perf_counter() - began, 2),
            **{k: told[k] for k in TOLD},
        }
        results, spent = _answer(case)
        among = sorted({t.name for t in results.trials if t.role == "identify"})
        effects = [e | {"among": among} if "logs" in e else e for e in told["effects"]]  # type: ignore[attr-defined]
        yield answer_of(results) | spent | {"truth": effects}
        if oracle:
            effects = effects if told["kind"] != "outside" else []
            truth = Truth(
                results.trials, str(told["declared_model"]), tuple(effects), tuple(record_case(drawn))
            )
            yield {"oracle": consult(truth)}
    finally:
        if keep is None:
            shutil.rmtree(folder, ignore_errors=True)


def _answer(case: Path) -> tuple[Results, dict[str, float]]:
    clock, cpu = time.perf_counter(), time.process_time()
    results = run(load_campaign(case / "campaign.toml"))
    return results, {
        "seconds": round(time.perf_counter() - clock, 2),
        "cpu_seconds": round(time.process_time() - cpu, 2),
    }


def answer_of(results: Results) -> dict[str, Any]:
    """Return what the product said, as data."""
    diagnosis = results.diagnosis
    if diagnosis is None:
        raise ValueError("the loop did not run")
    among = sorted({t.name for t in results.trials if t.role == "identify"})
    before, after = results.validation_before, results.validation_after
    return {
        "verdict": diagnosis.verdict.name.lower(),
        "named": [_named(taken, among) for taken in diagnosis.effects],
        "unexplained": {c: round(v, 4) for c, v in diagnosis.unexplained.items()},
        "rounds": [_round(r) for r in diagnosis.rounds],
        "errors": {"before": prediction_error(before), "after": prediction_error(after)},
        "fitness": {"before": before.fitness, "after": after.fitness},
        "chi2": {"before": results.before.chi2_per_dof, "after": results.after.chi2_per_dof},
        "advice": diagnosis.advice,
        "timing": {k: round(v, 2) for k, v in results.timing_s.items()},
    }


def _named(taken: TakenEffect, among: Sequence[str]) -> dict[str, Any]:
    entry = entry_of(taken.fitted, among)
    return entry | {"p_value": taken.p_value, "look_alikes": list(taken.look_alikes)}


def _round(turn: Round) -> dict[str, Any]:
    return {
        "accepted": turn.accepted,
        "candidates": [_candidate(c) for c in turn.candidates[:KEPT]],
        "p_values": sorted(c.p_value for c in turn.candidates if math.isfinite(c.p_value))[:1],
        "tests": {f"{t.name} {t.channel}": t.p_value for t in turn.residual_tests},
    }


def _candidate(c: Candidate) -> dict[str, Any]:
    return {
        "effect": c.effect,
        "input": c.input,
        "evidence": round(c.evidence, 2),
        "p_value": c.p_value,
        "note": c.note,
        "rmse": {k: [v, c.rmse_after.get(k)] for k, v in c.rmse_before.items()},
    }


def line_of(record: dict[str, Any]) -> str:
    """Return a record as one line of JSON."""
    return json.dumps(record, default=float)
