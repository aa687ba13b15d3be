"""What was taken first gives way to a rival that the measurements prefer, and to no other."""

from __future__ import annotations

from functools import cache

from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import Fitted
from identify.prepare import prepare
from validate.candidates import candidates
from validate.exchange import better_rival
from validate.look_alikes import standing


@cache
def fitted_with(name: str) -> Fitted:
    """A late rudder, fitted with an effect on it."""
    late = Effect("actuator_delay", {"delay": 0.3}, "rudder")
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 5, (late,))
    prepared = prepare(trials, ship.model)
    [active] = [a for a in candidates(prepared.structure) if a.label == f"{name} (rudder)"]
    return fit_from_scratch(prepared.structure.with_effect(active), prepared.identify, rounds=1)


def test_a_lag_that_was_taken_gives_way_to_the_delay_that_it_made_up_for():
    lag = fitted_with("actuator_lag")
    rival = better_rival(lag, [standing(lag, 0)])
    assert rival is not None
    [active] = rival.solution.structure.actives
    assert active.effect.name in ("actuator_delay", "clock_offset")  # of one rudder the same


def test_the_delay_itself_gives_way_to_nothing():
    delay = fitted_with("actuator_delay")
    assert better_rival(delay, [standing(delay, 0)]) is None


def test_an_input_has_a_dead_band_in_one_form_only():
    ship, trials = trials_of("usv", ("zigzag", "random"), 30.0, 5)
    structure = prepare(trials, ship.model).structure
    bands = [a for a in candidates(structure) if a.effect.name == "actuator_deadband"]
    of_rudder = [a for a in bands if a.variant.input == "rudder"]
    assert len(of_rudder) > 1
    left = [
        a for a in candidates(structure.with_effect(of_rudder[0])) if a.effect.name == "actuator_deadband"
    ]
    assert [a.label for a in left] == [a.label for a in bands if a.variant.input != "rudder"]
    assert left
