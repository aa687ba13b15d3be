"""A search goes on from the declared fit only where that shows what it lacks."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import LONG, SHORT, fit_from_scratch
from identify.effect import Active, Variant
from identify.effects.hull import ROLL_COUPLING
from identify.fitted import FAR, NEAR
from identify.prepare import prepare
from identify.structure import null_parameters
from validate import loop
from validate import nearer as nearer_by
from validate.loop import tells
from validate.within import ALL, First, GivenUp, Within

BLOWN = (
    Effect("actuator_delay", {"delay": 6.0}, "rudder"),
    Effect("wind", {"speed": 18.0, "direction": 1.0, "cx": 2e-4, "cy": 6e-4, "cn": 2e-5}),
)


def in_short_windows(effects):
    ship, trials = trials_of("tanker", ("random", "zigzag", "circle", "random"), 240.0, 5, effects)
    ready = prepare(trials, ship.model)
    return fit_from_scratch(ready.structure, ready.identify, length=SHORT)


def test_short_windows_near_the_noise_say_nothing_of_a_model_whose_free_runs_are_astray():
    fitted = in_short_windows(BLOWN)
    assert fitted.chi2_per_dof < FAR
    assert not tells(fitted)


def test_short_windows_of_a_model_that_follows_its_logs_are_enough():
    assert tells(in_short_windows(()))


def test_a_roll_that_short_windows_hide_in_their_first_states_is_looked_for_in_long_ones():
    roll = Effect("roll_coupling", {"frequency": 0.9, "damping": 0.06, "sway": 0.11, "yaw": 0.014})
    ship, trials = trials_of("patrol", ("random", "zigzag", "circle", "random"), 120.0, 5, (roll,))
    ready = prepare(trials, ship.model)
    fitted = fit_from_scratch(ready.structure, ready.identify, length=SHORT)
    assert fitted.chi2_per_dof < FAR
    assert not tells(fitted)


def test_a_fit_begun_with_a_known_roll_keeps_it_in_windows_that_hardly_show_it():
    values = {"frequency": 0.9, "damping": 0.06, "sway": 0.11, "yaw": 0.014}
    roll = Effect("roll_coupling", values)
    ship, trials = trials_of("patrol", ("random", "zigzag", "circle", "random"), 60.0, 5, (roll,))
    ready = prepare(trials, ship.model)
    structure = ready.structure.with_effect(Active(ROLL_COUPLING, Variant()))
    begun = null_parameters(structure)
    for k, slot in enumerate(structure.slots):
        begun[k] = values[slot.name] if slot.effect == 0 else begun[k]
    fitted = fit_from_scratch(structure, ready.identify, begun)
    assert fitted.problem.length > SHORT
    assert fitted.chi2_per_dof < NEAR
    assert structure.values(fitted.solution.p, 0)["frequency"] == pytest.approx(0.9, rel=0.01)


def test_a_search_that_begins_near_the_noise_in_short_windows_goes_on_in_long_ones(monkeypatch):
    looked = []
    monkeypatch.setattr(
        loop, "rounds", lambda fitted, *_, **__: looked.append(fitted.problem.length) or fitted
    )
    ship, trials = trials_of("tug", ("random", "zigzag", "circle"), 90.0, 5)
    ready = prepare(trials, ship.model)
    found = loop.search(ready, fit_from_scratch(ready.structure, ready.identify, length=2.0 * SHORT))
    assert looked == [2.0 * SHORT, LONG]
    assert found.fitted.problem.length == LONG


def test_what_has_the_longest_windows_already_is_looked_at_to_the_end(monkeypatch):
    """Waves that a rough fit shows are known in long windows: these leave nothing to lengthen, and much to look for."""
    asked = []
    monkeypatch.setattr(loop, "rounds", lambda fitted, *_, enough=0.0, **__: asked.append(enough) or fitted)
    structure = SimpleNamespace(vessel=SimpleNamespace(length=5.0))
    fitted = SimpleNamespace(
        problem=SimpleNamespace(length=LONG), solution=SimpleNamespace(structure=structure), chi2_per_dof=0.9
    )
    assert loop._lengthened(fitted, [], lambda _: None, frozenset()) is fitted
    assert asked == [0.0]


@pytest.mark.parametrize("chi2", [1.5, 50.0])
def test_what_longer_windows_throw_far_off_stays_in_the_shorter_ones_and_its_rounds_are_not_told(
    monkeypatch, chi2
):
    ship, trials = trials_of("tug", ("random", "zigzag", "circle"), 90.0, 5)
    ready = prepare(trials, ship.model)
    declared = fit_from_scratch(ready.structure, ready.identify, length=2.0 * SHORT)
    longer = SimpleNamespace(chi2_per_dof=chi2)
    monkeypatch.setattr(loop, "rounds", lambda fitted, turns, _, within: turns.append("short") or fitted)
    monkeypatch.setattr(
        loop, "_lengthened", lambda _fitted, turns, _pace, _within: turns.append("long") or longer
    )
    turns = []
    found = loop._gone_on_with(declared, turns, None, ALL)
    assert found is (longer if chi2 < FAR else declared)
    assert turns == (["short", "long"] if chi2 < FAR else ["short"])


def test_what_is_given_up_in_longer_windows_stays_in_the_shorter_ones(monkeypatch):
    ship, trials = trials_of("tug", ("random", "zigzag", "circle"), 90.0, 5)
    ready = prepare(trials, ship.model)
    declared = fit_from_scratch(ready.structure, ready.identify, length=2.0 * SHORT)

    def given_up(_fitted, turns, _pace, _within):
        turns.append("long")
        raise GivenUp

    monkeypatch.setattr(loop, "rounds", lambda fitted, turns, _, within: turns.append("short") or fitted)
    monkeypatch.setattr(loop, "refined", lambda near, _length: near)
    monkeypatch.setattr(loop, "_lengthened", given_up)
    turns = []
    assert loop._gone_on_with(declared, turns, None, Within(first=First(0.5))) is declared
    assert turns == ["short"]


@pytest.mark.parametrize(("chi2", "right"), [((1.1, 0.0), 0), ((12.0, 1.0), 1), ((12.0, 30.0), 0)])
def test_a_wiring_with_which_nothing_comes_near_the_noise_is_held_against_the_declared_one(
    monkeypatch, chi2, right
):
    ends = [
        SimpleNamespace(fitted=SimpleNamespace(chi2_per_dof=x, problem=SimpleNamespace(length=30.0)))
        for x in chi2
    ]
    wiring = SimpleNamespace(active=SimpleNamespace(label="input_wiring"))
    monkeypatch.setattr(loop, "preferred_wiring", lambda *_: wiring)
    monkeypatch.setattr(loop, "_searched", lambda _prepared, _declared, wired, *_: ends[wired is None])
    assert loop.search(None) is ends[right]


@pytest.mark.parametrize(
    ("chi2", "off", "astray", "nearer"),
    [
        (2.6, True, 0.05, True),
        (2.6, True, 0.05, False),
        (1.1, False, 0.15, True),
        (1.1, True, 0.15, True),
        (1.1, True, 0.15, False),
        (1.1, True, 0.05, True),
    ],
)
def test_several_effects_that_stay_off_the_noise_are_held_against_a_search_without_the_first(
    monkeypatch, chi2, off, astray, nearer
):
    first, asks = "offset", off and (chi2 > 2.0 or astray > 0.1)
    monkeypatch.setattr(nearer_by, "free_running_errors", lambda _: np.array([0.01, astray, 0.02]) ** 2)

    def of(names, chi2, off):
        active = [SimpleNamespace(effect=SimpleNamespace(name=n), label=n) for n in names]
        turns = [SimpleNamespace(taken=SimpleNamespace(screened=SimpleNamespace(active=a))) for a in active]
        fitted = SimpleNamespace(chi2_per_dof=chi2, is_off=off, problem=SimpleNamespace(length=30.0))
        return SimpleNamespace(
            turns=turns, standing=[SimpleNamespace(active=a) for a in active], fitted=fitted
        )

    found, other = of((first, "heading_bias"), chi2, off), of(("walk",), 1.0 if nearer else 2.5, not nearer)
    asked = []
    monkeypatch.setattr(loop, "_searched", lambda *_: asked.append(_[-1]) or other)
    best = loop._begun_otherwise(None, None, found, lambda _: None, Within())
    assert asked == ([Within(frozenset({first}), first=First(chi2, 2, at_noise=not off))] if asks else [])
    assert best is (other if asks and nearer else found)


def test_a_search_without_the_first_effect_that_is_given_up_leaves_what_was_found(monkeypatch):
    def given_up(*_):
        raise GivenUp

    monkeypatch.setattr(loop, "_searched", given_up)
    monkeypatch.setattr(loop, "worth_another", lambda _: True)
    active = SimpleNamespace(effect=SimpleNamespace(name="offset"), label="offset")
    turn = SimpleNamespace(taken=SimpleNamespace(screened=SimpleNamespace(active=active)))
    found = SimpleNamespace(
        turns=[turn], standing=[SimpleNamespace(active=active)] * 2, fitted=SimpleNamespace(chi2_per_dof=1.5)
    )
    assert loop._begun_otherwise(None, None, found, lambda _: None, Within()) is found


def near_fit(chi2, off, *labels, length=30.0):
    actives = tuple(SimpleNamespace(label=label) for label in labels)
    return SimpleNamespace(
        chi2_per_dof=chi2, astray_by=chi2, is_off=off, problem=SimpleNamespace(length=length),
        solution=SimpleNamespace(structure=SimpleNamespace(actives=actives)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("takes", "chi2", "looks"),
    [("walk", 2.4, 0), ("walk", 1.5, 1), ("wind", 2.4, 1), ("wind", 2.6, 0), ("wind", 1.5, 1)],
)
def test_what_is_taken_over_short_windows_is_gone_on_with_in_long_ones_that_it_brings_nearer_the_noise(
    monkeypatch, takes, chi2, looks
):
    """Clearly nearer, if it had been taken before."""
    looked = []
    monkeypatch.setattr(
        loop, "rounds", lambda f, turns, *_, **__: turns.append(SimpleNamespace(taken="walk")) or f
    )
    monkeypatch.setattr(loop, "fit_from_scratch", lambda *_, **__: near_fit(1.1, False, takes, length=10.0))
    monkeypatch.setattr(loop, "refined", lambda near, length: near_fit(chi2, True, takes, length=length))
    monkeypatch.setattr(loop, "_lengthened", lambda near, *_: looked.append(near) or near)
    found = SimpleNamespace(fitted=near_fit(2.5, True, "walk"), turns=[])
    monkeypatch.setattr(loop, "_ended", lambda *_: found)
    prepared = SimpleNamespace(structure=SimpleNamespace(vessel=SimpleNamespace(length=2.0)), identify=())
    assert loop._begun_shorter(prepared, found, lambda _: None, Within()) is found
    assert len(looked) == looks


@pytest.mark.parametrize(
    ("off", "first_length", "takes", "nearer", "asked"),
    [
        (2.5, None, True, True, True),
        (2.5, 30.0, True, True, True),
        (2.5, 30.0, True, False, True),
        (2.5, 30.0, False, True, True),
        (2.5, 10.0, True, True, False),
        (0.0, 30.0, True, True, False),
        (3.5, 30.0, True, True, False),
    ],
)
def test_a_search_off_the_noise_that_began_in_long_windows_is_held_against_one_that_takes_over_short_ones(
    monkeypatch, off, first_length, takes, nearer, asked
):
    begun, seen = near_fit(1.3, True, "walk"), []

    def taking(fitted, turns, _pace, within):
        seen.append((fitted, within.first))
        turns.append(SimpleNamespace(taken="walk" if takes else None))
        return fitted

    def based(length):
        return SimpleNamespace(base=SimpleNamespace(problem=SimpleNamespace(length=length)))

    turns = [] if first_length is None else [based(first_length)]
    found = SimpleNamespace(fitted=near_fit(off or 1.1, off > 0.0), turns=turns)
    other = SimpleNamespace(fitted=near_fit(1.05 if nearer else 2.4, not nearer))
    monkeypatch.setattr(loop, "rounds", taking)
    monkeypatch.setattr(loop, "fit_from_scratch", lambda *_, length: begun if length == 10.0 else None)
    monkeypatch.setattr(loop, "refined", lambda near, _length: near)
    monkeypatch.setattr(loop, "_lengthened", lambda near, *_: near)
    monkeypatch.setattr(loop, "_ended", lambda *_: other)
    structure = SimpleNamespace(vessel=SimpleNamespace(length=2.0))
    prepared = SimpleNamespace(structure=structure, identify=())
    best = loop._begun_shorter(prepared, found, lambda _: None, Within())
    assert best is (other if asked and takes and nearer else found)
    assert seen == ([(begun, First(np.inf))] if asked else [])


def test_a_search_over_short_windows_that_is_given_up_leaves_what_was_found(monkeypatch):
    def given_up(*_):
        assert _[-1].first == First(2.5)
        raise GivenUp

    monkeypatch.setattr(
        loop, "rounds", lambda f, turns, *_, **__: turns.append(SimpleNamespace(taken="walk")) or f
    )
    monkeypatch.setattr(loop, "fit_from_scratch", lambda *_, **__: near_fit(1.3, True, "walk"))
    monkeypatch.setattr(loop, "refined", lambda near, _length: near)
    monkeypatch.setattr(loop, "_lengthened", given_up)
    prepared = SimpleNamespace(structure=SimpleNamespace(vessel=SimpleNamespace(length=2.0)), identify=())
    found = SimpleNamespace(fitted=near_fit(2.5, True), turns=[])
    assert loop._begun_shorter(prepared, found, lambda _: None, Within()) is found


@pytest.mark.parametrize(
    ("kept", "other_kept", "chi2", "plainer"),
    [(3, 2, 1.04, True), (3, 2, 1.06, False), (3, 3, 1.0, False), (2, 1, 1.0, False)],
)
def test_many_effects_at_the_noise_give_way_to_fewer_that_come_as_near(
    monkeypatch, kept, other_kept, chi2, plainer
):
    def of(count, chi2):
        active = [SimpleNamespace(effect=SimpleNamespace(name=f"effect {n}"), label="") for n in range(count)]
        fitted = SimpleNamespace(chi2_per_dof=chi2, is_off=False, problem=SimpleNamespace(length=30.0))
        turns = [SimpleNamespace(taken=SimpleNamespace(screened=SimpleNamespace(active=a))) for a in active]
        return SimpleNamespace(
            turns=turns, standing=[SimpleNamespace(active=a) for a in active], fitted=fitted
        )

    found, other = of(kept, 1.05), of(other_kept, chi2)
    monkeypatch.setattr(loop, "worth_another", lambda _: False)
    monkeypatch.setattr(loop, "_searched", lambda *_: other)
    assert loop._begun_otherwise(None, None, found, lambda _: None, Within()) is (other if plainer else found)
