"""Waves that stand for what is missing: a search that ends without them is made once more without."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from validate import search_in_waves as module
from validate.within import ALL


@dataclass(frozen=True)
class Ready:
    """What a search is prepared with."""

    identify: str = "calm"


def fit(name, total, swell=None):
    return SimpleNamespace(
        name=name, problem=SimpleNamespace(swell=swell), solution=SimpleNamespace(total=total)
    )


@pytest.fixture
def play(monkeypatch):
    """A search in waves ends at one cost, one without them at another; both without waves in the end."""

    def stubs(swell, stands, without):
        known, asked = fit("declared", 50.0, swell), []
        ends = {True: fit("in waves", 20.0, swell), False: fit("without", without)}

        def search(prepared, declared, _pace, within=ALL):
            asked.append((prepared.identify, within.waves))
            return SimpleNamespace(fitted=ends[within.waves])

        for name, stub in {
            "with_waves_known": lambda _: known, "in_swell": lambda stretches, s: s or stretches, "search": search,
            "waves_stand": lambda _: stands, "without_waves": lambda f: f, "under": lambda _, f, __: fit("bare", 40.0),
        }.items():  # fmt: skip
            monkeypatch.setattr(module, name, stub)
        return asked

    return stubs


@pytest.mark.parametrize(
    ("swell", "stands", "without", "found", "asked"),
    [
        (None, False, 10.0, "in waves", [("calm", True)]),
        ("swell", True, 10.0, "in waves", [("swell", True)]),
        ("swell", False, 10.0, "without", [("swell", True), ("calm", False)]),
        ("swell", False, 60.0, "in waves", [("swell", True), ("calm", False)]),
    ],
)
def test_waves_that_do_not_stand_at_the_end_are_searched_without(play, swell, stands, without, found, asked):
    was = play(swell, stands, without)
    bare = fit("bare", 50.0)
    prepared, declared, outcome = module.searched(Ready(), bare, lambda _: None)
    assert was == asked
    assert outcome.fitted.name == found
    assert (declared is bare) is (found == "without")
    assert prepared.identify == ("calm" if found == "without" or swell is None else "swell")
