"""Logs whose samples come so rarely that their times must be in another unit: said before hours are spent on them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ingest.errors import NotIdentifiable
from ingest.log import Log, Source
from ingest.rarely import RARE, to_be_called
from preprocess.trial import FloatArray

#: Samples of everything that is needed come so far apart, s, and are so many: no vessel's motion is in them.
HOPELESS, ENOUGH = 60.0, 10
HOLD_NOTHING = "Samples that come minutes apart hold no manoeuvre:"


def require_often(name: str, log: Log, needed: Iterable[Source | None]) -> None:
    """Refuse a log in which the records of all that is needed come minutes apart.

    Raises
    ------
    NotIdentifiable
        With the unit that its times seem to be in.
    """
    times = {s.quantity: log.tables[s.topic].index.to_numpy() * 1e-9 for s in needed if s is not None}
    if times and all(len(t) >= ENOUGH and _step(t) >= HOPELESS for t in times.values()):
        quantity, t = next(iter(times.items()))
        raise NotIdentifiable(HOLD_NOTHING + rarely_sampled(name, quantity, t))


def rarely_sampled(name: str, quantity: str, t: FloatArray) -> str:
    """What is to be said of a log whose samples at times (n,) s come seconds apart; empty where they do not."""
    step = _step(t)
    if step < RARE:
        return ""
    return f" {name} has a {quantity} every {step:.3g} s ({1.0 / step:.2g} Hz). {to_be_called(step)}".rstrip()


def _step(t: FloatArray) -> float:
    return float(np.median(np.diff(t))) if len(t) > 1 else 0.0
