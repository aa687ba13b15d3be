"""What is taken back where unseen logs speak against what was found: the least of it, as long as that will do."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from validate import borne_out as module
from validate.borne_out import borne_out
from validate.outcome import Outcome


@dataclass(frozen=True)
class Found:
    """A fit with some effects, by label, the least of them last."""

    labels: tuple[str, ...]

    @property
    def solution(self):
        actives = tuple(SimpleNamespace(label=label) for label in self.labels)
        return SimpleNamespace(structure=SimpleNamespace(actives=actives))


def standing(labels):
    return tuple(SimpleNamespace(active=SimpleNamespace(label=label)) for label in labels)


@pytest.mark.parametrize(
    ("labels", "against", "kept", "refuted"),
    [
        (("lag", "roll"), (), ("lag", "roll"), ()),
        (("lag", "roll"), ("roll",), ("lag",), ("roll",)),
        (("lag", "bias", "roll"), ("bias", "roll"), ("lag",), ("roll", "bias")),
        (("lag", "roll"), ("lag",), (), ("lag", "roll")),
        (("lag",), ("lag",), (), ("lag",)),
    ],
)
def test_only_what_unseen_logs_speak_against_is_taken_back(monkeypatch, labels, against, kept, refuted):
    declared, found = Found(()), Found(labels)
    stubs = {
        "in_logs_as_they_say": lambda outcome, _: outcome,
        "told_of_the_odd_logs": lambda outcome: outcome,
        "searched": lambda fitted: list(range(len(fitted.labels))),
        "losses_without": lambda _, some: {k: -float(k) for k in some},
        "dropped": lambda fitted, k: Found(fitted.labels[:k] + fitted.labels[k + 1 :]),
        "spoken_against": lambda _, __, fitted: bool(set(fitted.labels) & set(against)),
        "all_standing": lambda fitted, *_: standing(fitted.labels),
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(module, name, stub)
    outcome, after = borne_out(None, declared, Outcome(found, (), standing(labels), None), found)
    assert after == (Found(kept) if kept else declared)
    assert tuple(s.active.label for s in outcome.standing) == kept
    assert outcome.refuted == refuted
