"""A wiring is put right on the accelerations' word, but not against a fit that leaves nothing to put right."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from identification_samples import trials_of

import validate.loop
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from validate.candidates import wirings
from validate.loop import _clearly_nearer, search
from validate.wiring import Wiring


def test_a_wiring_is_not_taken_where_the_declared_one_is_likelier(monkeypatch):
    _, trials = trials_of("catamaran", ("zigzag", "random"), 60.0, 4)
    prepared = prepare(trials, "modulus")
    declared = fit_from_scratch(prepared.structure, prepared.identify)
    wrong = wirings(prepared.structure)[0]
    found = Wiring(wrong, 8.0, 1e-15, (), ((wrong, 8.0),))
    monkeypatch.setattr(validate.loop, "better_wiring", lambda structure, stretches: found)
    outcome = search(prepared, declared)
    assert outcome.wiring is None
    assert outcome.standing == ()


@pytest.mark.parametrize(
    ("length", "chi2", "goes"),
    [(10.0, 5415.0, False), (10.0, 2000.0, True), (20.0, 6000.0, True), (5.0, 100.0, False)],
)
def test_a_wiring_goes_where_the_declared_one_is_clearly_nearer(length, chi2, goes):
    """Far from the noise half a per cent says nothing, and the accelerations have spoken."""

    def fit(length, chi2):
        return SimpleNamespace(problem=SimpleNamespace(length=length), chi2_per_dof=chi2)

    assert _clearly_nearer(fit(length, chi2), fit(10.0, 5446.0)) is goes
