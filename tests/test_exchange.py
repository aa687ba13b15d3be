"""What was taken first gives way to a rival that the measurements prefer, and to no other."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.effect import Active, Variant
from identify.effects import MASS_CHANGE
from identify.fitted import Fitted
from identify.prepare import prepare
from ingest.errors import NotIdentifiable
from validate import clocks, exchange
from validate.candidates import candidates
from validate.clocks import fewer_clocks
from validate.exchange import better_rival, likelier, one_for_two, one_load_for_two
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


def test_what_was_taken_back_comes_into_nobodys_place():
    lag = fitted_with("actuator_lag")
    at_its_place, barred = [standing(lag, 0)], []
    while (rival := likelier(lag, at_its_place, barred)) is not None:
        name = rival.solution.structure.actives[-1].effect.name
        assert name not in barred
        barred.append(name)
    assert "actuator_delay" in barred or "clock_offset" in barred


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


def test_inputs_that_are_all_late_by_as_much_are_one_clock_that_is_off():
    late = Effect("clock_offset", {"offset": -0.4}, None, {"stream": "inputs"})
    ship, trials = trials_of("usv", ("random", "zigzag", "random"), 60.0, 5, (late,))
    prepared = prepare(trials, ship.model)
    delays = [a for a in candidates(prepared.structure) if a.effect.name == "actuator_delay"]
    assert len(delays) == 2
    structure = prepared.structure.with_effect(delays[0]).with_effect(delays[1])
    both = fit_from_scratch(structure, prepared.identify, rounds=1)
    found = one_for_two(both, [standing(both, k) for k in range(2)])
    assert found is not None
    assert [a.label for a in found.solution.structure.actives] == ["clock_offset (inputs)"]


def test_inputs_that_are_late_each_by_its_own_stay_two():
    late = tuple(Effect("actuator_delay", {"delay": d}, i) for d, i in ((0.5, "rudder"), (1.0, "propeller")))
    ship, trials = trials_of("usv", ("random", "zigzag", "random"), 60.0, 5, late)
    prepared = prepare(trials, ship.model)
    structure = prepared.structure
    for active in candidates(structure):
        structure = structure.with_effect(active) if active.effect.name == "actuator_delay" else structure
    both = fit_from_scratch(structure, prepared.identify, rounds=1)
    assert one_for_two(both, [standing(both, k) for k in range(2)]) is None


def with_clocks_off(*streams):
    """A vessel whose compass is late, fitted with the clocks of these streams."""
    late = Effect("clock_offset", {"offset": 0.3}, None, {"stream": "heading"})
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 5, (late,))
    prepared = prepare(trials, ship.model)
    structure = prepared.structure
    for stream in streams:
        [clock] = [a for a in candidates(structure) if a.label == f"clock_offset ({stream})"]
        structure = structure.with_effect(clock)
    return fit_from_scratch(structure, prepared.identify, rounds=1)


def test_every_clock_but_one_early_by_as_much_is_that_one_late():
    many = with_clocks_off("position", "yaw_rate", "inputs")
    found = fewer_clocks(many)
    assert found is not None
    assert [a.label for a in found.solution.structure.actives] == ["clock_offset (heading)"]
    assert found.solution.structure.values(found.solution.p, 0)["offset"] == pytest.approx(0.3, abs=0.01)


def test_one_clock_is_not_taken_for_more():
    assert fewer_clocks(with_clocks_off("heading")) is None


def test_many_clocks_stay_where_no_fit_with_fewer_can_begin(monkeypatch):
    def runs_away(*_, **__):
        raise NotIdentifiable("it runs away at once.")

    many = with_clocks_off("position", "yaw_rate", "inputs")
    monkeypatch.setattr(clocks, "fit_from_scratch", runs_away)
    assert fewer_clocks(many) is None


def loaded(ratio, other, form=None):
    """Four logs, a load in the second and one in the third, fitted with one effect for each, that perhaps in a form."""
    effects = [
        Effect("mass_change", {"ratio": r}, options={"logs": (k,)}) for k, r in ((1, ratio), (2, other))
    ]
    ship, trials = trials_of("usv", ("random", "zigzag", "random", "circle"), 60.0, 5, effects, validate=0)
    prepared = prepare(trials, ship.model)
    structure = prepared.structure
    for k in (1, 2):
        read = {"form": form} if form and k == 2 else {}
        variant = Variant(options={"logs": (trials[k].name,), **read})
        structure = structure.with_effect(Active(MASS_CHANGE, variant))
    return fit_from_scratch(structure, prepared.identify, rounds=1)


def test_a_load_that_was_found_in_one_log_and_then_in_another_is_one():
    fit = loaded(1.3, 1.3)
    one = one_load_for_two(fit)
    assert one is not None
    [active] = one.solution.structure.actives
    assert active.variant.options["logs"] == tuple(
        n for a in fit.solution.structure.actives for n in a.variant.options["logs"]
    )
    [value] = one.solution.structure.values(one.solution.p, 0).values()
    assert value == pytest.approx(1.3, rel=0.02)


def test_a_load_that_was_found_in_two_forms_is_one_in_the_likelier():
    one = one_load_for_two(loaded(1.3, 1.3, form="whole"))
    assert one is not None
    [active] = one.solution.structure.actives
    assert "form" not in active.variant.options
    [value] = one.solution.structure.values(one.solution.p, 0).values()
    assert value == pytest.approx(1.3, rel=0.02)


def test_one_load_stands_for_two_that_explain_little_more(monkeypatch):
    """With the threshold of a chance alone small faults of a log's stamps would make two of what is one."""
    fit = loaded(1.3, 1.3)
    monkeypatch.setattr(exchange, "INDISTINCT", -np.inf)
    assert one_load_for_two(fit) is not None
    monkeypatch.setattr(exchange, "LITTLE", 0.0)
    assert one_load_for_two(fit) is None


def test_two_loads_that_are_not_the_same_stay_two():
    assert one_load_for_two(loaded(1.3, 1.6)) is None
