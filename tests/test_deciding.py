"""The manoeuvre that is advised is one that would tell the two causes apart."""

from __future__ import annotations

from functools import cache

from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import Fitted
from identify.prepare import prepare
from identify.structure import Structure
from validate.candidates import candidates
from validate.deciding import PLENTY, deciding_manoeuvre


def _with(structure: Structure, name: str) -> Structure:
    return structure.with_effect(next(a for a in candidates(structure) if a.effect.name == name))


@cache
def fits() -> tuple[Fitted, Fitted]:
    """A current that was met on short straight runs of one course, fitted as what it is and as an asymmetry."""
    current = Effect("current", {"speed": 0.1, "direction": 1.0})
    ship, trials = trials_of("usv", ("straight", "zigzag10", "straight"), 40.0, 5, (current,))
    prepared = prepare(trials, ship.model)
    one, other = (
        fit_from_scratch(_with(prepared.structure, name), prepared.identify, rounds=1)
        for name in ("current", "port_starboard_asymmetry")
    )
    return one, other


def test_a_manoeuvre_is_found_that_separates_two_causes():
    taken, rival = fits()
    found = deciding_manoeuvre(taken, [rival])
    assert found is not None
    assert 20.0 < found.separation <= PLENTY
    assert found.sentence.startswith(f"sail {found.manoeuvre} for ")


def test_no_manoeuvre_separates_a_model_from_itself():
    taken, _ = fits()
    found = deciding_manoeuvre(taken, [taken])
    assert found is not None
    assert found.separation < 1.0
