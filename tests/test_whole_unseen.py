"""What is said of unseen logs as a whole: that nothing follows them, that the values are not known, or nothing."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from validate import verdict
from validate.rounds import MOST_EFFECTS


@dataclass(frozen=True)
class Windows:
    length: float


@dataclass(frozen=True)
class WindowedFit:
    chi2_per_dof: float
    problem: Windows
    is_off: bool = False
    slow: float = 1.0


def whole_fit(chi2_per_dof):
    return None if chi2_per_dof is None else WindowedFit(chi2_per_dof, Windows(np.inf))


@pytest.mark.parametrize(
    ("whole", "own", "told"),
    [(None, 1.0, {"u": 19.0}), (1.01, 1.0, {}), (2.0, 1.0, {"u": 0.4}), (2.0, 1.5, {})],
    ids=["run away", "at the noise", "off it", "as their own are"],
)
def test_whole_unseen_logs_that_values_do_not_predict_are_owned_up_to(monkeypatch, whole, own, told):
    """Unless what the sensors show of them is at the noise (positions that wander make smoothed velocities look far
    off), or the fit's own logs are off as a whole too.
    """
    prepared = SimpleNamespace(identify=(), validate=("log",))
    found, share = whole_fit(whole), {"u": 0.4 if whole == 2.0 else 0.0, "v": 0.0, "r": 0.2}
    monkeypatch.setattr(verdict, "on_other_logs", lambda f, _: found if f.problem.length == np.inf else None)
    monkeypatch.setattr(verdict, "as_a_whole", lambda _: whole_fit(own))
    monkeypatch.setattr(verdict, "spread_of", lambda _: np.ones(3))
    monkeypatch.setattr(verdict, "over_whole_logs", lambda *_: {"u": 19.0, "v": 0.3, "r": 1.2})
    monkeypatch.setattr(verdict, "structured_share", lambda *_: share)
    fitted = WindowedFit(1.0, Windows(30.0))
    assert verdict._undetermined(prepared, fitted, {"u": 0.0, "v": 0.0, "r": 0.2}, 0.1) == told


@pytest.mark.parametrize(
    ("own", "shown", "quick", "left"),
    [
        (1.0, 4.0, True, {"v": 0.5}), (1.0, 1.05, True, {}), (1.4, 4.0, True, {}), (1.0, None, True, {}),
        (None, 4.0, True, {}), (1.0, 4.0, False, {}),
    ],
    ids=["not followed", "at the noise", "own off as well", "run away", "own run away", "own slow as a whole"],
)  # fmt: skip
def test_whole_unseen_logs_that_no_values_follow_while_the_fit_s_own_are_at_the_noise_are_left(
    monkeypatch, own, shown, quick, left
):
    """A rich model bends to what is missing; first states that are free in every window hide how far."""
    prepared = SimpleNamespace(identify=("log",), validate=("other",))
    monkeypatch.setattr(verdict, "as_a_whole", lambda _: whole_fit(own))
    monkeypatch.setattr(verdict, "with_wander_anew", lambda found: found)
    monkeypatch.setattr(verdict, "as_quick", lambda *_: quick)
    for name in ("on_other_logs", "with_other_logs"):
        monkeypatch.setattr(verdict, name, lambda *_: whole_fit(shown))
    monkeypatch.setattr(verdict, "structured_share", lambda *_: {"v": 0.5})
    assert verdict._left_over_whole_unseen(prepared, WindowedFit(1.0, Windows(30.0))) == left


def test_whole_unseen_logs_are_held_against_a_drift_as_the_fit_s_own_show_it_as_a_whole(monkeypatch):
    """A receiver may be off for minutes, of which windows of half of one show a part."""
    prepared = SimpleNamespace(identify=("log",), validate=("other",))
    whole, told, asked = whole_fit(1.0), whole_fit(1.0), []
    monkeypatch.setattr(verdict, "as_a_whole", lambda _: whole)
    monkeypatch.setattr(verdict, "with_wander_anew", lambda found: told if found is whole else None)
    monkeypatch.setattr(verdict, "as_quick", lambda *_: True)
    monkeypatch.setattr(verdict, "on_other_logs", lambda found, _: asked.append(found) or whole_fit(1.0))
    assert verdict._left_over_whole_unseen(prepared, WindowedFit(1.0, Windows(30.0))) == {}
    assert len(asked) == 1 and asked[0] is told


@pytest.mark.parametrize("off", [False, True])
def test_whole_unseen_logs_are_asked_of_the_fit_in_windows_where_the_reported_one_is_off(monkeypatch, off):
    """A receiver that is taken to wander may stand for what the model lacks."""
    asked = []
    for name in ("structured_share", "_left_unseen", "_left_astray"):
        monkeypatch.setattr(verdict, name, lambda *_: {"u": 0.0, "v": 0.0, "r": 0.0})
    monkeypatch.setattr(verdict, "_left_over_whole_unseen", lambda _, fit: asked.append(fit) or {"v": 0.2})
    windows, reported = WindowedFit(1.0, Windows(30.0)), WindowedFit(1.5, Windows(np.inf), is_off=off)
    assert verdict._left(None, windows, reported) == {"u": 0.0, "v": 0.2, "r": 0.0}
    assert asked == [windows if off else reported]


def test_what_is_said_of_unseen_logs_is_of_the_values_that_are_reported(monkeypatch):
    """Those in windows may run away where those of whole logs do not."""
    asked = []
    for name, found in (("_left", {"u": 0.0}), ("_taken", ()), ("advice_for", "")):
        monkeypatch.setattr(verdict, name, lambda *_, found=found: found)
    monkeypatch.setattr(verdict, "_undetermined", lambda _p, fitted, *_: asked.append(fitted) or {})
    monkeypatch.setattr(verdict, "without_pushes", lambda fitted: fitted)
    monkeypatch.setattr(verdict, "became", lambda _: ())
    windows = SimpleNamespace(problem=SimpleNamespace(swell=None))
    for reported in ("reported", None):
        verdict.diagnose(None, SimpleNamespace(turns=(), standing=()), windows, None, 0.1, reported)
    assert asked == ["reported", windows]


@pytest.mark.parametrize(("standing", "left"), [(MOST_EFFECTS, {"r": 0.4}), (MOST_EFFECTS - 1, {})])
def test_as_many_effects_as_are_ever_taken_stand_in_for_something_else(monkeypatch, standing, left):
    """Two dead bands, two offsets and two asymmetries were taken of thrusters that push less astern: explained."""
    monkeypatch.setattr(
        verdict, "structured_share", lambda fit: {"r": 0.4} if fit.taken == 2 else {"r": 0.01}
    )

    def without(count):
        structure = SimpleNamespace(actives=range(count))
        return SimpleNamespace(
            base=SimpleNamespace(taken=count, solution=SimpleNamespace(structure=structure))
        )

    outcome = SimpleNamespace(standing=("an effect",) * standing, turns=[without(n) for n in range(standing)])
    assert verdict._stood_in_for(outcome) == left
    outcome.turns = outcome.turns[3:]  # a search that went on from many has none beside few
    assert verdict._stood_in_for(outcome) == {}
