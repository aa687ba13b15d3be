"""What became of the effects that rounds took: which of them stand at the end, and why the others do not."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from identify.effect import Active
from validate.outcome import Outcome
from validate.report.words import joined
from validate.same_cause import acting

#: How the remark on an effect begins that was left out again.
OUT = "left out again"
#: What is said of an effect that unseen logs, or its own standard error, speak against, or that is any logger's.
REFUTED = "taken back: unseen or whole logs are predicted no better with it"
UNSURE = "not kept: its value may as well be nothing, or it hardly moves the vessel"
SLIGHT = "no more than any logger's stamps are off: the fit knows of it, it is no effect"


@dataclass(frozen=True)
class Became:
    """What an effect that a round took came to: whether it stands, and a remark, empty where it stands as taken.

    ``told`` where other advice has said that it does not stand.
    """

    label: str
    stands: bool
    remark: str = ""
    told: bool = False


def became(outcome: Outcome) -> list[Became | None]:
    """What the effect that each round took came to, round by round; None of a round that took nothing."""
    taken = [t.taken.screened.active if t.taken else None for t in outcome.turns]
    ends = _ends([a for a in taken if a], [s.active for s in outcome.standing if not s.active.effect.rewire])
    apart = [label for label in _labels(outcome) if label not in ends.values()]
    return [_of(a, ends, outcome, apart) if a else None for a in taken]


def _labels(outcome: Outcome) -> list[str]:
    """Labels of the effects that stand, without the wiring, which no round takes."""
    return [s.active.label for s in outcome.standing if not s.active.effect.rewire]


def _ends(taken: Iterable[Active], standing: Collection[Active]) -> dict[str, str]:
    """Label at the end of every effect that was taken and stands, if need be in another form or in other logs."""
    same = {a.label for a in standing}
    ends = {a.label: a.label for a in taken if a.label in same}
    for one in taken:
        others = [a.label for a in standing if a.label not in ends and is_still(one, a)]
        if one.label not in ends and others:
            ends[one.label] = others[0]
    return ends


def is_still(taken: Active, standing: Active) -> bool:
    """Whether an effect that stands is one that was taken: on one of its inputs, read otherwise or in other logs."""
    (name, inputs, options), (other, others, found) = (acting(a, set()) for a in (taken, standing))
    return name == other and options == found and (inputs == others or bool(set(inputs) & set(others)))


def _of(active: Active, ends: Mapping[str, str], outcome: Outcome, apart: list[str]) -> Became:
    """What one effect came to; ``apart`` are those that stand and no round took."""
    label = active.label
    if label in ends:
        return Became(label, True, "" if ends[label] == label else f"at the end {ends[label]}")
    said = ((outcome.refuted, REFUTED), (outcome.unsure, UNSURE), (outcome.slight, SLIGHT))
    known = next((words for labels, words in said if _is_among(active, labels)), "")
    return Became(label, False, known or _left_out(apart, _labels(outcome)), bool(known))


def _is_among(active: Active, labels: Collection[str]) -> bool:
    """Whether an effect is among those of some labels, in any of its forms."""
    effects = {label.split(" (")[0] for label in labels}
    return active.label in labels or (active.effect.forms is not None and active.effect.name in effects)


def _left_out(apart: list[str], standing: list[str]) -> str:
    """Why an effect was left out again: another came in its place, or it explains nothing beside those that stand."""
    if apart:
        return f"{OUT}: {joined(apart)}, which no round took, came in instead"
    beside = f"beside {joined(standing)}" if standing else "looked at once more"
    return f"{OUT}: {beside} it explains no more than chance does"


def left_out_words(outcome: Outcome) -> list[str]:
    """A sentence for each effect that was taken and left out again, where nothing else is said of it."""
    gone = dict.fromkeys((b.label, b.remark) for b in became(outcome) if b and not b.stands and not b.told)
    return [
        f"Taken in a round and {OUT}: {label}: {remark.removeprefix(OUT + ': ')}." for label, remark in gone
    ]
