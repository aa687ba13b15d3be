"""A cause on one of two inputs that move alike is told as well of the other."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active
from identify.effects import ACTUATOR_DELAY
from identify.fitted import Fitted
from identify.prepare import prepare
from preprocess.trial import Trial
from validate.candidates import candidates
from validate.look_alikes import standing
from validate.twins import is_twin, on_twins


@cache
def trials(apart: float = 0.0) -> tuple[str, tuple[Trial, ...]]:
    """A late rudder that was logged as two, each with errors of its own and so much larger or smaller."""
    rng = np.random.default_rng(4)
    late = Effect("actuator_lag", {"time_constant": 0.8}, "rudder")
    ship, sailed = trials_of("usv", ("zigzag", "random"), 60.0, 5, (late,))
    return ship.model, tuple(_doubled(t, rng, apart) for t in sailed)


def _doubled(trial: Trial, rng: np.random.Generator, apart: float) -> Trial:
    logged = trial.inputs["rudder"]
    rudders = {
        name: replace(
            logged, name=name, value=gain * logged.value + 0.002 * rng.standard_normal(len(logged.t))
        )
        for name, gain in (("port", 1.0 - apart), ("starboard", 1.0 + apart))
    }
    [declared] = [i for i in trial.inputs_declared if i.name == "rudder"]
    others = tuple(i for i in trial.inputs_declared if i.name != "rudder")
    return replace(
        trial,
        inputs=rudders | {k: v for k, v in trial.inputs.items() if k != "rudder"},
        inputs_declared=(*(replace(declared, name=n) for n in rudders), *others),
    )


@cache
def fitted() -> Fitted:
    """The lag on one of them."""
    model, both = trials()
    prepared = prepare(both, model)
    [lag] = [a for a in candidates(prepared.structure) if a.label == "actuator_lag (port)"]
    return fit_from_scratch(prepared.structure.with_effect(lag), prepared.identify, rounds=1)


def twin() -> Active:
    """The lag on the other one."""
    own = fitted().solution.structure.actives[0]
    return replace(own, variant=replace(own.variant, input="starboard"))


def test_what_is_on_one_could_be_on_the_other():
    assert "actuator_lag (starboard)" in standing(fitted(), 0).look_alikes
    [other] = on_twins(fitted(), 0, [twin()])
    assert other.p == pytest.approx(fitted().solution.p)


def test_inputs_that_do_not_move_alike_are_told_apart():
    own = fitted().solution.structure.actives[0]
    assert is_twin(own, twin(), fitted().problem.stretches)
    model, apart = trials(0.1)
    assert not is_twin(own, twin(), prepare(apart, model).identify)


def test_the_same_input_another_cause_and_all_inputs_are_no_twins():
    own, stretches = fitted().solution.structure.actives[0], fitted().problem.stretches
    delay = replace(twin(), effect=ACTUATOR_DELAY)
    on_both = replace(own, variant=replace(own.variant, besides=("starboard",)))
    assert not any(is_twin(own, a, stretches) for a in (own, delay, on_both))
