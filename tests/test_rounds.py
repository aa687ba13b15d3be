"""What a round does where nothing is taken: looks at more, looks again, or lets waves be known first."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from identify.effect import Active
from identify.effects import EFFECTS
from identify.fitted import FAR, NEAR
from validate import loop, pruning
from validate import rounds as module
from validate.candidates import Screened
from validate.judgement import _unlikely, plainest
from validate.pace import Pace
from validate.rounds import Turn, rounds
from validate.within import First, GivenUp, Within


def fit(chi2, name="fit", swell=None, actives=(), length=30.0, off=True):
    return SimpleNamespace(
        name=name, chi2_per_dof=chi2, is_off=off, is_far=chi2 > FAR,
        problem=SimpleNamespace(swell=swell, length=length),
        solution=SimpleNamespace(
            structure=SimpleNamespace(actives=actives, vessel=SimpleNamespace(length=2.0))
        ),
    )  # fmt: skip


@dataclass(frozen=True)
class Judged:
    """What rounds read of a refit."""

    label: str
    fitted: SimpleNamespace
    p_value: float = 1.0
    evidence: float = 1.0


@pytest.fixture
def play(monkeypatch):
    """Stands in for what rounds call, by name."""

    def stubs(**named):
        for name, stub in named.items():
            monkeypatch.setattr(module, name, stub)

    stubs(astray=lambda _: False, _in_waves=lambda *_: None, _nearer=lambda fitted, _: fitted)
    stubs(_in_pairs=lambda turn, *_: [turn], _together=lambda *_: [], instead_of_wander=lambda *_: None)
    for name in ("with_wander_known", "with_pushes_known", "with_slight_compass_known"):
        stubs(**{name: lambda fitted: fitted})
    return stubs


@pytest.mark.parametrize(
    ("chi2", "astray", "looks"), [(1.5, False, [False, True]), (1.5, True, [False]), (1.1, False, [False])]
)
def test_off_the_noise_every_effect_is_refitted_before_it_is_believed_that_none_is_worth_it(
    play, chi2, astray, looks
):
    """A clock of the inputs that is a second late promises little to first order, and explains all."""
    seen = []

    def turn(fitted, _pace, _barred, thorough=False, **_):
        seen.append(thorough)
        return Turn(fitted, (), (), None)

    play(_turn=turn, astray=lambda _: astray)
    begin = fit(chi2)
    assert rounds(begin, [], Pace()) is begin
    assert seen == looks


@pytest.mark.parametrize("chi2", [2.9, 3.1])
def test_what_has_nothing_left_to_take_farther_off_than_another_search_came_is_given_up(play, chi2):
    seen = []

    def turn(fitted, _pace, _barred, thorough=False, **_):
        seen.append(thorough)
        return Turn(fitted, (), (), None)

    play(_turn=turn, astray=lambda _: False)
    with pytest.raises(GivenUp) if chi2 > 3.0 else nullcontext():
        rounds(fit(chi2), [], Pace(), within=Within(first=First(1.5)))
    assert seen == ([False] if chi2 > 3.0 else [False, True])


def test_what_a_thorough_look_finds_is_taken(play):
    clock, end = Judged("clock_offset (inputs)", fit(1.0)), fit(1.0, "with it")

    def turn(fitted, _pace, _barred, thorough=False, **_):
        return Turn(fitted, (), (clock,), clock if thorough and fitted is begin else None)

    begin, turns = fit(1.5), []
    play(_turn=turn, _after=lambda taken, waves: end)
    assert rounds(begin, turns, Pace()) is end
    assert [t.taken for t in turns] == [clock, None]


def test_a_thorough_look_refits_what_none_has_refitted(play):
    """Under the same weights it would come to the same."""
    names, refitted = ("current", "wind", "actuator_lag"), []

    def judge(base, chosen, *_):
        refitted.append([s.active.label for s in chosen])
        return base, [Judged(label, fit(1.4), evidence=-1.0) for label in refitted[-1]]

    def look(_fitted, _screened, thorough):
        each = [SimpleNamespace(active=SimpleNamespace(label=n), leads=False) for n in names]
        return each if thorough else each[:1]

    play(candidates=lambda _: [], screen=lambda *_: [], in_likeliest_sets=lambda *_: [], ways=lambda *_: 0)
    play(finalists=look, judge=judge)
    turns = []
    rounds(fit(1.5), turns, Pace())
    assert refitted == [["current"], ["wind", "actuator_lag"]]
    assert {j.label for j in turns[0].judged} == set(names)


def test_what_shows_beside_pushes_alone_is_taken_beside_them(play):
    """As so many times the noise they hide it."""
    loss, end, pushed = Judged("thrust_loss_with_speed", fit(1.0)), fit(1.0, "with it"), fit(1.05, "pushed")

    def turn(fitted, _pace, _barred, **_):
        return Turn(fitted, (), (loss,), loss if fitted is pushed else None)

    begin, turns = fit(1.5), []
    known = {"pushed": pushed}
    play(_turn=turn, _after=lambda taken, waves: end)
    play(with_pushes_known=lambda fitted: known.pop("pushed") if fitted is begin else fitted)
    assert rounds(begin, turns, Pace()) is end
    assert [(t.base, t.taken) for t in turns] == [(pushed, loss), (end, None)]


def test_what_nothing_shows_beside_pushes_either_goes_on_as_it_was(play):
    seen, begin, pushed = [], fit(1.5), fit(1.05, "pushed")

    def turn(fitted, _pace, _barred, thorough=False, **_):
        seen.append((fitted, thorough))
        return Turn(fitted, (), (), None)

    play(_turn=turn, with_pushes_known=lambda fitted: pushed)
    assert rounds(begin, [], Pace()) is begin
    assert seen == [(begin, False), (pushed, False), (begin, True)]


@pytest.mark.parametrize(
    ("off", "slow", "believed"),
    [(None, None, "known"), (True, 1.4, "known"), (False, 1.2, "known"), (False, 1.0, "with it")],
)
def test_headings_as_slowly_off_as_any_are_known_where_no_one_cause_takes_all_of_them(
    play, off, slow, believed
):
    """In a good compass a slow actuator shows no larger than any compass is off; its round is made once."""
    looked, known, begin = [], fit(1.0, "known"), fit(1.1, "begin", off=True)

    def turn(fitted, _pace, _barred, thorough=False, **_):
        looked.append(fitted)
        if fitted is begin and off is not None:
            lag = fit(1.0, off=off)
            lag.slow = slow
            return Turn(fitted, (), (), Judged("actuator_lag", lag))
        return Turn(fitted, (), (), None)

    after = fit(1.0, "with it")
    play(_turn=turn, with_slight_compass_known=lambda fitted: known, _after=lambda *_: after)
    assert rounds(begin, [], Pace()).name == believed
    assert [f.name for f in looked] == ["begin", believed]
    looked.clear()
    assert rounds(begin, [], Pace(), enough=FAR).name == believed  # it is taken though that is near enough
    assert [f.name for f in looked] == ["begin"]
    looked.clear()
    near = fit(1.0, off=False)
    assert rounds(near, [], Pace()) is near  # that leaves nothing off
    assert looked == [near]


def test_what_followed_a_wander_of_the_position_is_asked_again_beside_it(play):
    """A false effect gains by what a wander leaves that a rich model has followed."""
    false, begin, known = Judged("shallow_water", fit(1.2)), fit(1.3), fit(1.0, "known", off=False)

    def turn(fitted, _pace, _barred, **_):
        return Turn(fitted, (), (false,), false if fitted is begin else None)

    turns = []
    play(_turn=turn, with_wander_known=lambda fitted: known if fitted is begin else fitted)
    assert rounds(begin, turns, Pace()) is known
    assert [t.taken for t in turns] == [None]


@pytest.mark.parametrize(
    ("swings", "off", "seen", "waits"),
    [(True, True, True, True), (True, True, False, False), (True, False, True, False), (False, True, True, False)],
)  # fmt: skip
def test_waves_that_show_are_known_before_a_roll_that_does_not_come_to_the_noise_is_taken(
    monkeypatch, swings, off, seen, waits
):
    """Over short windows hardly any damping lets a roll follow whatever waves there are."""
    known = fit(1.0, swell="waves" if seen else None)
    monkeypatch.setattr(module, "swings", lambda _: swings)
    monkeypatch.setattr(module, "with_waves_known", lambda _: known)
    taken = Judged("roll_coupling", fit(2.0, off=off))
    begin = fit(4.0)
    assert module._in_waves(begin, Turn(begin, (), (taken,), taken)) is (known if waits else None)
    assert module._in_waves(fit(4.0, swell="waves"), Turn(begin, (), (taken,), taken)) is None
    assert module._in_waves(begin, Turn(begin, (), (), None)) is None


def test_what_followed_waves_before_they_were_known_is_taken_back_before_anything_else_is_looked_at(play):
    """A roll that was taken over short windows, in which no waves show, lets a false clock gain beside them."""
    begin, bare, looks = fit(1.0, "with a roll", swell="waves"), fit(1.0, "without", swell="waves"), []

    def turn(fitted, *_, **__):
        looks.append(fitted)
        return Turn(fitted, (), (), None)

    play(_turn=turn, _swinging=lambda *_: None, pruned=lambda fitted, _: bare)
    assert rounds(begin, [], Pace()) is bare
    assert looks == [bare]


@pytest.mark.parametrize("settles", [1.0, 2.0])
def test_what_is_sure_but_runs_away_as_the_model_did_is_worth_it_once_begun_anew(monkeypatch, settles):
    """A rich model with a rudder's play runs away from where it was without; begun anew with it, it does not."""
    base, first = fit(1.5), fit(settles, "anew")
    play_of_rudder = Judged("actuator_deadband", fit(1.4), p_value=1e-9)
    for name, stub in {
        "consistent": lambda *_: True, "at_bound": lambda _: False, "settled": lambda _: first,
        "worthwhile": lambda _, found: found is first, "_turn": lambda fitted, *_: Turn(fitted, (), (), None),
    }.items():  # fmt: skip
        monkeypatch.setattr(module, name, stub)
    turns = module._in_pairs(Turn(base, (), (play_of_rudder,), None), Pace())
    taken = [t.taken for t in turns if t.taken]
    assert [t.fitted for t in taken] == ([first] if settles < NEAR else [])


def test_a_nearer_fit_that_was_found_on_the_way_is_looked_from_before_pairs_are(play):
    steps = [fit(9.0), fit(6.0), fit(5.0), fit(4.0)]
    done = []

    def turn(fitted, *_, again):
        done.append(f"look at {fitted.chi2_per_dof:g}" + " again" * again)
        return Turn(fitted, (), (), None)

    def pairs(turn, *_):
        done.append("pairs")
        return [turn]

    play(
        _turn=turn, _in_pairs=pairs, astray=lambda _: True,
        _nearer=lambda fitted, _: steps[min(steps.index(fitted) + 1, 3)],
    )  # fmt: skip
    assert rounds(steps[0], [], Pace()) is steps[3]
    assert done == ["look at 9", "look at 6 again", "look at 5 again", "pairs"]


def test_with_an_effect_taken_it_is_not_looked_at_again_but_anew(play):
    begin, nearer, after = fit(9.0), fit(8.0), fit(5.0)
    taken = Judged("delay", after)
    looks = []

    def turn(fitted, *_, again):
        looks.append((fitted.chi2_per_dof, again))
        return Turn(fitted, (), (), taken if fitted is nearer else None)

    play(
        _turn=turn, astray=lambda _: True, _after=lambda *_: after,
        _nearer=lambda fitted, _: nearer if fitted is begin else fitted,
    )  # fmt: skip
    assert rounds(begin, [], Pace()) is after
    assert looks == [(9.0, False), (8.0, True), (5.0, False)]


def test_nothing_is_fitted_from_scratch_when_it_is_looked_at_again(play):
    """What such a fit is does not hang on where the search is by then."""
    asked = []
    play(
        candidates=lambda _: [], screen=lambda *_: [], plainest=lambda _: None,
        finalists=lambda *_: [Screened(Active(EFFECTS[0]), None, None, 1.0, leads=True)],
        judge=lambda fitted, chosen, *_: asked.extend(s.leads for s in chosen) or (fitted, []),
    )  # fmt: skip
    for again in (False, True):
        module._turn(fit(9.0), Pace(), again=again)
    assert asked == [True, False]


@pytest.mark.parametrize(("chi2", "taken", "lengths"), [
    (9.0, False, [40.0]), (90.0, False, [20.0]), (9.0, True, [20.0, 40.0]), (1.5, False, [20.0, 40.0]),
])  # fmt: skip
def test_where_nothing_is_left_to_take_far_off_the_next_look_is_in_the_longest_windows(
    monkeypatch, chi2, taken, lengths
):
    looked = []
    for name, stub in {
        "window_length": lambda _: 40.0, "refined": lambda _, length: fit(chi2, length=length),
        "at_likeliest_speed": lambda f: f, "with_waves_known": lambda f: f,
        "rounds": lambda f, *_: looked.append(f.problem.length) or f,
    }.items():  # fmt: skip
        monkeypatch.setattr(loop, name, stub)
    turns = [Turn(fit(chi2), (), (), Judged("current", fit(chi2)) if taken else None)]
    found = loop._lengthened(fit(min(chi2, 9.0), length=10.0), turns, Pace(), Within())
    assert looked == lengths
    assert found.problem.length == lengths[-1]


@pytest.mark.parametrize(("first", "given_up"), [(np.inf, False), (2.0, True)])
def test_what_came_to_nothing_in_the_longest_windows_is_not_looked_at_again(monkeypatch, first, given_up):
    monkeypatch.setattr(loop, "rounds", lambda *_: pytest.fail("looked again"))
    near = fit(5.0, length=40.0)
    within, turns = Within(first=First(first)), [Turn(near, (), (), None)]
    monkeypatch.setattr(loop, "window_length", lambda _: 40.0)
    if given_up:
        with pytest.raises(GivenUp):
            loop._lengthened(near, turns, Pace(), within)
    else:
        assert loop._lengthened(near, turns, Pace(), within) is near


@pytest.mark.parametrize(("costs", "taken"), [((10.0, 10.2), 1), ((10.0, 12.0), 0)])
def test_of_causes_that_are_the_same_on_these_logs_the_plainer_one_is_taken(costs, taken):
    """An input that is never astern has an offset where it might have a dead band."""
    band, offset = (next(e for e in EFFECTS if e.name == n) for n in ("actuator_deadband", "actuator_offset"))
    worth = [
        SimpleNamespace(
            screened=SimpleNamespace(active=Active(e)),
            fitted=SimpleNamespace(solution=SimpleNamespace(total=c)),
        )
        for e, c in zip((band, offset), costs, strict=True)
    ]
    assert plainest(worth) is worth[taken]
    assert plainest([]) is None


def test_of_what_is_no_chance_the_likeliest_is_taken():
    """A gain counts for less where windows scatter, but not for less than a smaller one."""
    chance, scattered, sharp = (
        SimpleNamespace(gain=g, parameters=k, evidence=e)
        for g, k, e in ((300.0, 1, -2.0), (189.0, 1, 39.0), (135.0, 4, 85.0))
    )
    assert sorted([chance, sharp, scattered], key=_unlikely) == [scattered, sharp, chance]


@pytest.mark.parametrize(
    ("chi2", "effects", "given_up"), [(1.4, 2, True), (1.4, 1, False), (1.2, 2, False), (1.4, 3, True)]
)
def test_what_took_as_many_effects_as_another_search_and_is_clearly_behind_is_given_up(
    play, chi2, effects, given_up
):
    """A search without a first effect that was none of the causes needs no more of them than one with it."""
    play(_turn=lambda fitted, *_, **__: Turn(fitted, (), (), None), astray=lambda _: False)
    behind = fit(chi2, actives=(None,) * effects)
    with pytest.raises(GivenUp) if given_up else nullcontext():
        assert rounds(behind, [], Pace(), within=Within(first=First(1.2, 2))) is behind


@pytest.mark.parametrize(
    ("chi2", "effects", "stands", "given_up"),
    [(1.0, 2, 2, True), (1.0, 1, 1, False), (1.0, 3, 1, False), (1.0, 3, 2, True), (0.9, 2, 2, False)],
)
def test_what_needs_as_many_effects_as_a_search_that_came_to_the_noise_is_given_up(
    play, monkeypatch, chi2, effects, stands, given_up
):
    """Once those that no longer stand are gone: none is plainer, and none can be clearly nearer."""
    kept = fit(chi2, actives=(None,) * stands)
    play(_turn=lambda fitted, *_, **__: Turn(fitted, (), (), None))
    monkeypatch.setattr(
        pruning, "pruned", lambda f, _: f if len(f.solution.structure.actives) == stands else kept
    )
    within = Within(first=First(1.02, 2, at_noise=True))
    with pytest.raises(GivenUp) if given_up else nullcontext():
        found = rounds(fit(chi2, actives=(None,) * effects), [], Pace(), within=within)
        assert len(found.solution.structure.actives) == stands
