"""Names of effects as a person reads them, alone and inside of sentences; the labels of candidates."""

from __future__ import annotations

import re

import numpy as np

from identify.effects import EFFECTS
from validate.diagnosis import Candidate, Round

#: How the remark on a candidate that was only looked at begins.
NOT_REFITTED = "not refitted"
#: What has underscores in sentences: effects, and the streams of a sensor.
_NAMES = sorted({e.name for e in EFFECTS if "_" in e.name} | {"yaw_rate"}, key=len, reverse=True)
_NAME = re.compile(rf"(?<![\w./-])(?:{'|'.join(_NAMES)})(?!\w|[./-]\w)")
#: An effect in words, or any letter at all, at the begin of advice; an effect that begins a later sentence of it.
_WORDS = "|".join(e.name.replace("_", " ") for e in EFFECTS)
_BEGIN = re.compile(rf"^[a-z]|(?<=[.?] )(?:{_WORDS})(?=:| of [^:.]+:)")


def in_words(text: str) -> str:
    """A sentence with ``clock_offset`` as ``clock offset``; names of inputs and of files stay as they are."""
    return _NAME.sub(lambda found: found[0].replace("_", " "), text)


def finding_words(finding: str) -> str:
    """A finding as it is read: streams in words, and a true minus before a number."""
    return re.sub(r"(?<![\w.])-(?=\d)", "−", in_words(finding))


def advice_words(advice: str) -> str:
    """Advice as it is read: effects in words, and a capital where one begins a sentence."""
    return _BEGIN.sub(lambda found: found[0].capitalize(), finding_words(advice))


def label_of(c: Candidate) -> str:
    """``clock_offset (inputs)``: the candidate with its input, form, stream or logs, as far as it says them."""
    return _parts(c)[0]


def remark_of(c: Candidate) -> str:
    """What else there is to say of a candidate: why it was not refitted, for one."""
    return _parts(c)[1]


def short_remark_of(c: Candidate) -> str:
    """The remark beside a number that stands for itself: one that promises much did not gain too little."""
    if refitted(c):
        return remark_of(c)
    return f"{NOT_REFITTED}: a first look" if c.evidence > 0 else f"{NOT_REFITTED}: it promises too little"


def _parts(c: Candidate) -> tuple[str, str]:
    """A note is the label, or the label, a colon and a remark, or a remark alone."""
    found = re.fullmatch(rf"({re.escape(c.effect)}(?: \([^()]*\))?)(?:: (.*))?", c.note)
    if found:
        return found[1], found[2] or ""
    return c.effect + (f" ({c.input})" if c.input else ""), c.note


def refitted(c: Candidate) -> bool:
    """Whether the evidence is that of a fit; else it is what a first look promises."""
    return not remark_of(c).startswith(NOT_REFITTED)


def ranked(r: Round) -> list[Candidate]:
    """Candidates of a round: those refitted by their evidence, then the others by what a first look promises."""
    return sorted(
        r.candidates, key=lambda c: (not refitted(c), -c.evidence if np.isfinite(c.evidence) else np.inf)
    )


def bars(candidates: list[Candidate]) -> list[float]:
    """Length of each candidate's bar, 0 to 1 of the most evidence of those that were refitted."""
    known = [c.evidence for c in candidates if refitted(c) and c.evidence > 0]
    most = max(known or [c.evidence for c in candidates], default=0.0)
    return [
        min(1.0, max(0.0, c.evidence / most)) if most > 0 and np.isfinite(c.evidence) else 0.0
        for c in candidates
    ]


def taken_of(r: Round) -> Candidate | None:
    """The candidate that a round took: of several of that name the best that was refitted."""
    return next((c for c in ranked(r) if c.effect == r.accepted), None)
