"""Names of effects as a person reads them, alone and inside of sentences; the labels of candidates."""

from __future__ import annotations

import re

from identify.effects import EFFECTS
from validate.diagnosis import Candidate, Round

#: What has underscores in sentences: effects, and the streams of a sensor.
_NAMES = sorted({e.name for e in EFFECTS if "_" in e.name} | {"yaw_rate"}, key=len, reverse=True)
_NAME = re.compile(rf"(?<![\w./-])(?:{'|'.join(_NAMES)})(?!\w|[./-]\w)")


def in_words(text: str) -> str:
    """A sentence with ``clock_offset`` as ``clock offset``; names of inputs and of files stay as they are."""
    return _NAME.sub(lambda found: found[0].replace("_", " "), text)


def advice_words(advice: str) -> str:
    """Advice as it is read: effects in words, and a capital at its begin."""
    words = in_words(advice)
    return words[:1].upper() + words[1:]


def label_of(c: Candidate) -> str:
    """``clock_offset (inputs)``: the candidate with its input, form, stream or logs, as far as it says them."""
    return _parts(c)[0]


def remark_of(c: Candidate) -> str:
    """What else there is to say of a candidate: why it was not refitted, for one."""
    return _parts(c)[1]


def _parts(c: Candidate) -> tuple[str, str]:
    """A note is the label, or the label, a colon and a remark, or a remark alone."""
    found = re.fullmatch(rf"({re.escape(c.effect)}(?: \([^()]*\))?)(?:: (.*))?", c.note)
    if found:
        return found[1], found[2] or ""
    return c.effect + (f" ({c.input})" if c.input else ""), c.note


def taken_of(r: Round) -> Candidate | None:
    """The candidate that a round took: of several of that name the best that was refitted."""
    named = [c for c in r.candidates if c.effect == r.accepted]
    refitted = [c for c in named if not remark_of(c)] or named
    return max(refitted, key=lambda c: c.evidence, default=None)
