"""Names of effects as a person reads them, alone and inside of sentences; the labels of candidates."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from identify.effects import EFFECTS
from identify.written import number
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
    """The remark on a candidate as it is shown; of one that was not refitted what a first look promises."""
    if refitted(c):
        return remark_of(c)
    known = math.isfinite(c.promise)
    much = (
        f"a first look promises {number(c.promise)}" if known and c.promise > 0 else "it promises too little"
    )
    return f"{NOT_REFITTED}: {much}"


def _parts(c: Candidate) -> tuple[str, str]:
    """A note is the label, or the label, a colon and a remark, or a remark alone."""
    found = re.fullmatch(rf"({re.escape(c.effect)}(?: \([^()]*\))?)(?:: (.*))?", c.note)
    if found:
        return found[1], found[2] or ""
    return c.effect + (f" ({c.input})" if c.input else ""), c.note


def refitted(c: Candidate) -> bool:
    """Whether the evidence is that of a fit; else a first look is all there was."""
    return not remark_of(c).startswith(NOT_REFITTED)


def in_order(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Candidates that were refitted by their evidence, then the others by what a first look promises."""

    def rank(c: Candidate) -> tuple[bool, float]:
        worth = c.evidence if refitted(c) else c.promise
        return not refitted(c), -worth if math.isfinite(worth) else math.inf

    return sorted(candidates, key=rank)


def ranked(r: Round) -> list[Candidate]:
    """Candidates of a round, best first."""
    return in_order(r.candidates)


def bars(candidates: list[Candidate]) -> list[float]:
    """Length of each candidate's bar, 0 to 1 of the most evidence; nothing where none was measured."""
    known = [c.evidence if refitted(c) and math.isfinite(c.evidence) else 0.0 for c in candidates]
    most = max(known, default=0.0)
    return [max(0.0, x / most) if most > 0 else 0.0 for x in known]


def taken_of(r: Round) -> Candidate | None:
    """The candidate that a round took: of several of that name the best that was refitted."""
    return next((c for c in ranked(r) if c.effect == r.accepted), None)


def taken_words(r: Round) -> str:
    """What a round did with the candidate that it took: of one that does not stand at the end that it did not stay."""
    return "taken" if r.stands else "taken, not kept"


def outcome_words(r: Round) -> str:
    """What a round came to, and what became of that."""
    if r.accepted is None:
        return "nothing taken"
    remark = (
        f" ({in_words(r.remark)})" if r.remark and r.stands else f", {in_words(r.remark)}" * bool(r.remark)
    )
    return f"{in_words(r.accepted)} taken{remark}"
