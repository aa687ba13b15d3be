"""What makes an effect worth a name: the gain must not be from a few places, unless the free run comes much nearer."""

from __future__ import annotations

import pytest

from validate import judgement
from validate.judgement import worthwhile


class Fit:
    """What ``worthwhile`` asks of a fit: its distance from the noise, and its free run."""

    def __init__(self, chi2, misfit):
        self.chi2_per_dof, self.misfit = chi2, misfit


@pytest.fixture(autouse=True)
def told(monkeypatch):
    monkeypatch.setattr(judgement, "at_bound", lambda _: False)
    monkeypatch.setattr(judgement, "free_running_misfit", lambda f: f.misfit)
    monkeypatch.setattr(judgement, "whitened", lambda *_: False)
    monkeypatch.setattr(judgement, "consistent", lambda *_: False)


def test_a_gain_from_a_few_places_is_not_worth_a_name():
    assert not worthwhile(Fit(2.5, 1.0), Fit(2.0, 0.5))


def test_a_free_run_that_comes_three_times_as_near_is():
    assert worthwhile(Fit(2.5, 1.0), Fit(2.0, 0.1))


def test_not_at_a_bound(monkeypatch):
    monkeypatch.setattr(judgement, "at_bound", lambda _: True)
    assert not worthwhile(Fit(2.5, 1.0), Fit(2.0, 0.1))


def test_a_little_nearer_is_enough_where_the_gain_is_from_everywhere(monkeypatch):
    monkeypatch.setattr(judgement, "consistent", lambda *_: True)
    assert worthwhile(Fit(2.5, 1.0), Fit(2.0, 0.9))
    assert not worthwhile(Fit(2.5, 1.0), Fit(2.0, 0.99))
