"""A gain from few places counts where it puts them right."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from validate import consistency


@pytest.mark.parametrize(
    "places, left, believed",
    [(60, 3.0, True), (5, 1.0, True), (5, 3.0, False), (1, 1.0, False)],
    ids=["from all over", "few, put right", "few, still large", "one"],
)
def test_a_gain_from_few_places_counts_where_these_are_left_like_all_others(
    monkeypatch, places, left, believed
):
    gains, after = np.zeros(100), np.ones(100)
    gains[:places], after[:places] = 20.0, left
    noisy = SimpleNamespace(dispersed=SimpleNamespace(inflation=np.array([2.0, 1.0, 1.0, 1.0])))
    monkeypatch.setattr(consistency, "gains_by_time", lambda base, fit: gains)
    monkeypatch.setattr(consistency, "by_time", lambda fit: after)
    monkeypatch.setattr(consistency, "_samples_by_time", lambda fit: np.ones(100))
    monkeypatch.setattr(consistency, "replace", lambda fit, problem: fit)
    assert consistency.consistent(SimpleNamespace(problem=noisy), None) is believed
