"""What came near an effect in the round that took it is asked for again in its place, from where it was."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import Fitted
from identify.prepare import prepare
from validate.candidates import Screened, candidates
from validate.judgement import Judged
from validate.look_alikes import standing
from validate.rounds import Turn
from validate.runners_up import runners_up


@cache
def fits() -> dict[str, Fitted]:
    """A late rudder, fitted with each of two effects on it."""
    late = Effect("actuator_delay", {"delay": 0.3}, "rudder")
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 5, (late,))
    prepared = prepare(trials, ship.model)
    on_it = {a.label: a for a in candidates(prepared.structure)}
    named = {n: prepared.structure.with_effect(on_it[f"actuator_{n} (rudder)"]) for n in ("lag", "delay")}
    return {n: fit_from_scratch(s, prepared.identify, rounds=1) for n, s in named.items()}


def judged(name: str, gain: float) -> Judged:
    fit = fits()[name]
    s = fit.solution
    screened = Screened(s.structure.actives[-1], s.p, s.p, gain)
    return Judged(screened, fit, gain, 1, 0.0, gain)


def turn_of(lag: float, delay: float, far: bool = False) -> Turn:
    """A round that took the lag, with these gains."""
    both = judged("lag", lag), judged("delay", delay)
    return Turn(cast("Fitted", SimpleNamespace(is_far=far)), (), both, both[0])


@pytest.mark.parametrize(("delay", "near"), [(1000.0, True), (945.0, True), (935.0, False), (2000.0, True)])
def test_only_what_came_near_is_asked_for(delay, near):
    found = runners_up([turn_of(1000.0, delay)], fits()["lag"], 0)
    assert [s.active.label for s in found] == ["actuator_delay (rudder)"] * near


def test_it_begins_with_what_it_had():
    [found] = runners_up([turn_of(1000.0, 1000.0)], fits()["lag"], 0)
    assert found.p == pytest.approx(fits()["delay"].solution.p)


def test_far_from_the_noise_nothing_is_said_of_what_came_near():
    assert runners_up([turn_of(1000.0, 1000.0, far=True)], fits()["lag"], 0) == []


def test_a_rival_that_was_near_is_refitted_from_there_and_no_other_place():
    lag = fits()["lag"]
    [beside] = runners_up([turn_of(1000.0, 1000.0)], lag, 0)
    assert rivals(lag, beside)["actuator_delay"] == pytest.approx(0.3, abs=0.05)
    nowhere = replace(beside, p=np.full(len(beside.p), np.nan))
    assert "actuator_delay" not in rivals(lag, nowhere)


def rivals(fitted: Fitted, beside: Screened) -> dict[str, float]:
    """Rivals of a fit's one effect by name, and the first value of each."""
    return {
        r.solution.structure.actives[-1].effect.name: next(
            v for s, v in zip(r.solution.structure.slots, r.solution.p, strict=True) if s.effect == 0
        )
        for r in standing(fitted, 0, [beside]).rivals
    }
