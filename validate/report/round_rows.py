"""Rounds of the loop as they are shown: residual tests, candidates best first, and what came in without a round."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from validate.diagnosis import Candidate, Diagnosis, Results, Round
from validate.report.figures import CHANNELS, SYMBOL, column
from validate.report.labels import (
    bars,
    in_words,
    label_of,
    outcome_words,
    ranked,
    refitted,
    short_remark_of,
    taken_of,
    taken_words,
)
from validate.report.scores import scaled
from validate.report.words import joined

#: Effects that have a test of their own.
OWN_TEST = ("waves", "input_wiring")
#: A prediction ran away where its error is so many times the standard deviation of what was measured.
RUN_AWAY = 10.0
#: Candidates of a round that are shown; the others are in report.json.
RANKED = 12


def spreads(results: Results) -> dict[str, float]:
    """Standard deviation of every channel over all logs, SI."""
    tables = results.predictions.values()
    found = {c: [v for t in tables if (v := column(t, c)) is not None] for c, _, _, _ in CHANNELS}
    return {c: float(np.nanstd(np.concatenate(v))) for c, v in found.items() if v}


def round_rows(r: Round, spread: Mapping[str, float]) -> dict[str, Any]:
    """One round: tests by name with p-values per channel, candidates best first with their bars."""
    names = list(dict.fromkeys(t.name for t in r.residual_tests))
    channels = list(dict.fromkeys(t.channel for t in r.residual_tests))
    value = {(t.name, t.channel): t.p_value for t in r.residual_tests}
    order = ranked(r)
    taken = taken_of(r)
    return {
        "channels": [SYMBOL.get(c, c) for c in channels],
        "tests": [(n, [value.get((n, c)) for c in channels]) for n in names],
        "candidates": [
            candidate_row(c, share, c is taken, spread)
            for c, share in list(zip(order, bars(order), strict=True))[:RANKED]
        ],
        "more": len(order) - RANKED,
        "outcome": outcome_words(r),
        "taken": taken_words(r),
    }


def found_apart(found: Diagnosis | None) -> list[str]:
    """Sentences on effects that no round took: some have a test of their own, others came in another's place."""
    accepted = {r.accepted for r in found.rounds} if found else set()
    names = (
        dict.fromkeys(e.fitted.name for e in found.effects if e.fitted.name not in accepted) if found else {}
    )
    groups = {
        "Found by a test of its own, apart from the rounds": [n for n in names if n in OWN_TEST],
        "Came in once the rounds were through, in the place of what they took": [
            n for n in names if n not in OWN_TEST
        ],
    }
    return [f"{how}: {in_words(joined(of))}." for how, of in groups.items() if of]


def tamed(value: float | None, scale: float, spread: float) -> str:
    """An error in the unit for reading; in words where the prediction ran away."""
    if value is not None and (np.isinf(value) or value > RUN_AWAY * spread):
        return "runs away"
    return scaled(value, scale)


def candidate_row(c: Candidate, share: float, taken: bool, spread: Mapping[str, float]) -> dict[str, Any]:
    """One candidate as it is shown; ``spread`` is the standard deviation of each channel."""
    scale = {name: factor for name, _, _, factor in CHANNELS}
    change = [
        (
            k,
            *(
                tamed(x, scale.get(k, 1.0), spread.get(k, np.inf))
                for x in (c.rmse_before[k], c.rmse_after.get(k))
            ),
        )
        for k in c.rmse_before
        if refitted(c) and c.rmse_before[k] != c.rmse_after.get(k)
    ]
    return {
        "name": in_words(label_of(c)),
        "evidence": c.evidence,
        "bar": round(100 * share, 1),
        "p_value": c.p_value,
        "change": change,
        "note": short_remark_of(c),
        "taken": taken,
    }
