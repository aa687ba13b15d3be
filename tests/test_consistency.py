"""A gain from few places counts where it puts them right."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of

from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from identify.windows import cut
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
    monkeypatch.setattr(consistency, "_under_weights_of", lambda base, fit: fit)
    assert consistency.consistent(SimpleNamespace(problem=noisy), None) is believed


def test_a_fit_in_other_windows_gains_what_it_does_in_the_same():
    _, trials = trials_of("usv", ("zigzag", "random"), 60.0, 6)
    prepared = prepare(trials, "modulus")
    base = fit_from_scratch(prepared.structure, prepared.identify, length=15.0, rounds=0)
    elsewhere = replace(base, problem=cut(base.problem.stretches, 12.0))
    gains = consistency.gains_by_time(base, elsewhere)
    assert gains == pytest.approx(np.zeros(len(gains)), abs=0.2)
    assert len(gains) == len(consistency.by_time(base))
