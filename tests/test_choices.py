"""Which of several fits is gone on with, and which are not asked for what they need not say."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from identify.fitted import FAR, NEAR
from validate import judgement, rounds
from validate.analysis import _nearest_bare, _nearest_in_windows
from validate.judgement import _in_their_logs


def fit(chi2, length=30.0, actives=(), total=0.0, strays=1.0):
    structure = SimpleNamespace(actives=actives)
    return SimpleNamespace(
        chi2_per_dof=chi2,
        astray_by=chi2 + total,
        problem=SimpleNamespace(length=length),
        solution=SimpleNamespace(structure=structure, total=total),
        remembered=lambda _: strays,  # what it leaves of whole logs
    )


def outcome(fitted, bases=(), wiring=None):
    turns = [SimpleNamespace(base=b) for b in bases]
    return SimpleNamespace(fitted=fitted, turns=turns, wiring=wiring)


def test_a_search_that_ends_without_effects_gives_its_fit_where_that_is_clearly_nearer_the_noise():
    declared, nearer = fit(2.0), fit(1.2)
    assert _nearest_bare(declared, outcome(nearer)) is nearer
    assert _nearest_bare(declared, None) is declared


def test_where_a_candidate_led_to_the_declared_models_better_valley_that_is_its_fit():
    """What was found beside it may be refuted, or is held against it: as it is, not as a worse valley had it."""
    declared, better, best = fit(2.0), fit(1.2), fit(1.1)
    rough, taken = fit(0.9, length=10.0), fit(1.0, actives=("walk",))
    assert _nearest_bare(declared, outcome(taken, (rough, better, best, taken))) is best


def test_values_that_windows_agree_with_leave_no_structure_though_free_runs_go_anywhere_by_them():
    declared, astray = fit(2.0), fit(1.1, strays=9.0)
    ended = outcome(fit(1.0, actives=("walk",)), (astray,))
    assert _nearest_bare(declared, ended) is declared
    assert _nearest_in_windows(declared, ended) is astray
    assert _nearest_in_windows(declared, outcome(astray, wiring="swapped")) is declared


@pytest.mark.parametrize(
    "ended",
    [
        outcome(fit(1.99)),  # no nearer than by chance
        outcome(fit(1.2, length=10.0)),  # short windows hide what it lacks
        outcome(fit(1.2, actives=("current",)), (fit(1.2, actives=("walk",)),)),  # other structures
        outcome(fit(1.2), wiring="swapped"),
        outcome(fit(1.2, strays=1.1)),  # it predicts its own logs worse
    ],
)
def test_else_the_declared_fit_stays(ended):
    declared = fit(2.0)
    assert _nearest_bare(declared, ended) is declared


@pytest.mark.parametrize("without", [0.9 * FAR, 1.3 * FAR])
@pytest.mark.parametrize(("best", "asked"), [(0.9 * NEAR, 1), (1.1 * NEAR, 2)])
def test_where_the_best_cause_comes_to_the_noise_the_others_are_not_asked_for_their_logs(
    monkeypatch, best, asked, without
):
    """Nor is one that gains next to nothing, or a second of the same effect."""
    seen = []
    monkeypatch.setattr(judgement, "in_likeliest_logs", lambda f, _: seen.append(f) or f)
    named = [
        SimpleNamespace(active=SimpleNamespace(effect=SimpleNamespace(name=n)))
        for n in ("mass_change", "mass_change", "shallow_water", "thrust_fade")
    ]
    fits = [fit(best, total=10.0), fit(3.0, total=20.0), fit(3.0, total=30.0), fit(3.0, total=99.0)]
    found = _in_their_logs(fit(without, total=100.0), list(zip(named, fits, strict=True)))
    assert seen == [fits[0], fits[2]][:asked]
    assert [f for _, f in found] == fits


@pytest.mark.parametrize(("again", "nearest"), [(1.5, "again"), (6.0, "base"), (4.0, "base")])
def test_weights_that_give_up_what_is_far_off_do_not_lead_away_from_a_nearer_fit(monkeypatch, again, nearest):
    begin, base = fit(5.0, total=0.2), fit(2.0)
    refits = iter([fit(5.0, total=10.0), named := fit(again)])
    monkeypatch.setattr(rounds, "under", lambda *_: next(refits))
    monkeypatch.setattr(rounds, "recalibrated", lambda *_: None)
    assert rounds._nearer(begin, base) is {"again": named, "base": base}[nearest]


def test_a_better_fit_by_weights_that_give_up_what_is_far_off_is_no_nearer(monkeypatch):
    begin, base = fit(2.0, total=0.2), fit(5.0)
    monkeypatch.setattr(rounds, "under", lambda *_: fit(6.0, total=10.0))
    monkeypatch.setattr(rounds, "recalibrated", lambda *_: None)
    assert rounds._nearer(begin, base) is begin
