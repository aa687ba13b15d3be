"""Whether the errors of a sensor, or of one of its rate, wander: what each of the two is likelier with.

A rate that wanders adds up to an error of the integral without bounds, a value that wanders comes back. A value that
was filtered wanders smoothly: within some minutes that looks like a wander of the rate, and what is known of such
sensors says whose it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from preprocess.integrated import Piece, Sensed
from preprocess.rate_samples import may_wander, shows
from preprocess.wander_likelihood import MISSED, Errors, Likeliest, likeliest

#: Fewer blocks than this in all tell nothing.
TELLING = 40
#: Gain in -2 log likelihood that is believed, also of a wander of the rate over one of the value, for which half of it
#: is then enough (over some minutes they look alike); and gain by which another time constant than the first is.
BELIEVED, CLEARER = 12.0, 4.0
#: Time constants that are tried, s, the first alone where it shows nothing: of a value, and of a rate.
OWN, RATE = (40.0, 10.0, 20.0, 80.0, 160.0), (2.0, 0.5, 1.0, 4.0, 8.0, 32.0, 128.0)


@dataclass(frozen=True)
class Wander:
    """Standard deviation, time constant, s, and gain in -2 log likelihood.

    ``white`` is the white noise beside it where it is quick; None where that is none of what was estimated. ``smooth``
    where it is critically damped noise of second order, not of first.
    """

    size: float
    time: float
    gain: float
    white: float | None = None
    smooth: bool = False


@dataclass(frozen=True)
class Told:
    """The wander of a value and that of its rate; None where there is none."""

    own: Wander | None = None
    rate: Wander | None = None


class Smooth(NamedTuple):
    """What is known of sensors whose errors may wander smoothly, whatever the logs.

    ``times`` are its time constants, s, of which the first is taken where others are no likelier; none has a larger
    standard deviation than ``most``, SI. Of a wander that may as well be the rate's, a ``share`` of the variance is the
    value's own, and the rest its rate's.
    """

    times: tuple[float, ...]
    most: float
    share: float


def told(slow: Sequence[Piece], rates: Sequence[Sensed], smooth: Smooth) -> Told:
    """What long blocks tell of both, with the samples of the ``rates``."""
    if blocks_of(slow) < TELLING:
        return Told()
    walking = Errors(missed=min(MISSED, max(r.missed for r in rates)))
    own = _likelier(slow, walking, [walking._replace(own=t) for t in OWN], CLEARER, least=0.5 * BELIEVED)
    bare = walking._replace(walks=False)
    rate = _likelier(slow, bare, [bare._replace(rate=t) for t in RATE], rates=rates)
    near = own is not None and rate is not None and _hardly_behind(own, rate, rates)
    either = _either(slow, rate, rates, smooth) if rate and not near else None
    if either:
        return either
    if own and own.gain < BELIEVED and not near:
        own = None
    if own is None or rate is None:
        return Told(None if own is None else _own(own), None if rate is None else _rate(rate))
    more, first = [bare._replace(own=t, rate=rate.errors.rate) for t in OWN], rate
    if near:
        more, first = [bare._replace(own=own.errors.own, rate=t) for t in RATE], own
    both = _nearest(_tried(slow, more, first.found.deviance), rates)
    if both is not None and both.gain >= BELIEVED:
        return Told(_own(both), _rate(both))
    return Told(own=_own(own)) if first is own else Told(rate=_rate(rate))


def _either(slow: Sequence[Piece], rate: _Tried, rates: Sequence[Sensed], known: Smooth) -> Told | None:
    """A smooth wander of the value that is nearly as likely as one of its ``rate``, and what is that one's."""
    bare = rate.errors._replace(rate=None)
    smooth = _likelier(slow, bare, [bare._replace(own=t, smooth=True) for t in known.times], CLEARER)
    if smooth is None or smooth.found.own > known.most or not _hardly_behind(smooth, rate, rates):
        return None
    more = [smooth.errors._replace(rate=t) for t in RATE]
    both = _nearest(_tried(slow, more, smooth.found.deviance), rates)
    if both is not None and both.gain >= BELIEVED:
        return Told(_own(both), _rate(both))
    own, other = _own(smooth), _rate(rate)
    return Told(
        replace(own, size=math.sqrt(known.share) * own.size),
        replace(other, size=math.sqrt(1.0 - known.share) * other.size) if known.share < 1.0 else None,
    )


def told_quick(quick: Sequence[Piece], times: Sequence[float], rate: Wander | None) -> Wander | None:
    """A value's wander within seconds, as short blocks tell it beside what is known of its ``rate``."""
    if blocks_of(quick) < TELLING:
        return None
    known = Errors(rate=rate.time, walks=False) if rate else Errors()
    found = _likelier(quick, known, [known._replace(own=t) for t in times], CLEARER)
    return None if found is None else replace(_own(found), white=found.found.white)


def blocks_of(pieces: Sequence[Piece]) -> int:
    """Number of blocks in all."""
    return sum(len(p.t) for p in pieces)


@dataclass(frozen=True)
class _Tried:
    """Errors that were tried, what they are likeliest with, and the gain by them in -2 log likelihood."""

    errors: Errors
    found: Likeliest
    gain: float


def _own(tried: _Tried) -> Wander:
    return Wander(tried.found.own, tried.errors.own or 0.0, tried.gain, smooth=tried.errors.smooth)


def _rate(tried: _Tried) -> Wander:
    return Wander(tried.found.rate, tried.errors.rate or 0.0, tried.gain)


def _likelier(
    pieces: Sequence[Piece],
    bare: Errors,
    others: Sequence[Errors],
    clearer: float = 0.0,
    rates: Sequence[Sensed] = (),
    least: float = BELIEVED,
) -> _Tried | None:
    """The likeliest of ``others``, by so much if it is not the first; None where none gains the ``least``."""
    none = likeliest(pieces, bare).deviance
    first, *_ = tried = _tried(pieces, others[:1], none)
    if first.gain < 0.5 * BELIEVED:
        return None
    tried += _tried(pieces, others[1:], none)
    best = _nearest([replace(t, gain=t.gain + clearer * (t is first)) for t in tried], rates)
    if best is None:
        return None
    best = tried[others.index(best.errors)]
    return best if best.gain >= least else None


def _hardly_behind(own: _Tried, rate: _Tried, rates: Sequence[Sensed]) -> bool:
    """Whether a wander of the value is nearly as likely as one of the rate; as likely, if that one shows in samples."""
    shown = shows(rates, rate.found.rate, rate.errors.rate or 0.0)
    return own.found.deviance < rate.found.deviance + (-CLEARER if shown else BELIEVED)


def _tried(pieces: Sequence[Piece], each: Sequence[Errors], none: float) -> list[_Tried]:
    """Each of some errors, by what it gains over a deviance of ``none`` of them."""
    found = [likeliest(pieces, e) for e in each]
    return [_Tried(e, f, none - f.deviance) for e, f in zip(each, found, strict=True)]


def _nearest(tried: Sequence[_Tried], rates: Sequence[Sensed]) -> _Tried | None:
    """The one that gains most, of those by which rates wander as their samples may."""
    may = [t for t in tried if not rates or may_wander(rates, t.found.rate, t.errors.rate or 0.0)]
    return max(may, key=lambda t: t.gain, default=None)
