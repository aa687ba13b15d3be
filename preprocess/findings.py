"""What a person should know of a trial, as sentences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import pandas as pd

from preprocess.chains import Segments
from preprocess.inertial import Worth
from preprocess.judge import Judged
from preprocess.manoeuvres import Found, classify_stretch
from preprocess.offsets import ClockOffset
from preprocess.stated import Word
from preprocess.trial import Measurement
from preprocess.wander_kalman import Wander

#: How a finding begins by which the errors of a position wander.
POSITION_WANDERS = "The errors of the position wander"
#: Reasons that are things, and are counted so.
THINGS = ("outlier", "spike")
#: What is said of a log of which nothing can be used.
BROKEN = "No unbroken stretch of five seconds with ten samples of position and of heading"


def manoeuvres_of(
    states: pd.DataFrame,
    segments: Segments,
    inputs: Mapping[str, Measurement],
    length: float,
    angles: frozenset[str] = frozenset(),
    declared: str | None = None,
) -> list[Found]:
    """Return the manoeuvres of all stretches, in order, as ``declared``; ``angles``: inputs whose values are angles."""
    out: list[Found] = []
    for low, high in segments:
        part = states[(states["t"] >= low) & (states["t"] <= high)]
        out += classify_stretch(part, inputs, length, angles, declared)
    return out


def longest_kind(found: Sequence[Found]) -> str | None:
    """Return the kind that takes most of the time under way; "idle" where all is; None if nothing is."""
    total: dict[str, float] = {}
    for f in found:
        total[f.kind] = total.get(f.kind, 0.0) + f.end - f.start
    under_way = {k: n for k, n in total.items() if k != "idle"}
    total = under_way or total
    return max(total, key=lambda k: total[k], default=None)


def without_numbers(inputs: Iterable[Measurement]) -> list[str]:
    """Return the inputs that say nothing, each in words: what acted cannot be known."""
    return [f"{m.name} (signal '{m.source}') has no number" for m in inputs if not m.good.any()]


def contradiction(declared: str | None, found: str | None) -> list[str]:
    """A sentence where the campaign calls idle what moves, or the other way round; none else."""
    if declared is None or found is None or (declared == "idle") == (found == "idle"):
        return []
    return [f"The campaign calls it {declared}, and the motion is {found}."]


def in_words(reasons: Mapping[str, int]) -> str:
    """Why samples were set aside, and how many for each reason."""
    return ", ".join(f"{n} {reason}{'s' * (n > 1 and reason in THINGS)}" for reason, n in reasons.items())


def wandering(size: float, time: float, smooth: bool = False) -> str:
    """That a position's errors wander, by how much, m, and over what time, s."""
    return f"{POSITION_WANDERS} {'smoothly ' * smooth}({size:.2g} m, over {time:.0f} s)"


def said(
    judged: Mapping[str, Judged],
    segments: Segments,
    offsets: Sequence[ClockOffset],
    found: Sequence[Found],
    wander: Wander | None = None,
    words: Mapping[str, Word] | None = None,
    worth: Worth | None = None,
    silent: Sequence[str] = (),
    part: str = "log",
) -> list[str]:
    """Sentences for the report; ``part``: what they are about."""
    broken = () if segments else (BROKEN,)
    out = [f"{reason}: nothing of this {part} can be used." for reason in silent or broken]
    if len(segments) > 1:
        out.append(f"Split into {len(segments)} stretches where too much was missing to bridge.")
    for name, j in judged.items():
        share = 1.0 - j.good.mean() if len(j.good) else 0.0
        if share > 0.02:
            out.append(f"{share:.1%} of the samples of {name} were set aside ({in_words(j.reasons)}).")
    if "yaw_rate" not in judged:
        out.append("No yaw rate was logged: it follows from the heading alone.")
    if wander is not None:
        out.append(f"{wandering(wander.sigma, wander.time)}: velocities are less sure for it.")
    out += [
        f"Samples of {k} count by what the sensor states of their accuracy."
        for k, w in (words or {}).items()
        if w.power > 0.0
    ]
    out += [str(worth)] if worth is not None else []
    out += [str(o) for o in offsets if o.seen]
    out += [f"{f.kind} {f.detail}, {f.start:.0f}-{f.end:.0f} s.".replace(" ,", ",") for f in found]
    return out
