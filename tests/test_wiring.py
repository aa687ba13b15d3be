"""A wiring is put right on the accelerations' word, but not against a fit that leaves nothing to put right."""

from __future__ import annotations

from identification_samples import trials_of

import validate.loop
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from validate.candidates import wirings
from validate.loop import search
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
