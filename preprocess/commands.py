"""Judging inputs: commands that step and hold, or feedback that moves; spikes; noise."""

from __future__ import annotations

import numpy as np

from preprocess.feedback import without_noise
from preprocess.outliers import MAD_TO_SIGMA
from preprocess.raw import Raw
from preprocess.rounding import resolution
from preprocess.trial import BoolArray, FloatArray, Measurement

#: A spike stands out by this share of the input's range at least, and by this multiple of its noise.
SPIKE_SHARE = 0.05
SPIKE_SIGMAS = 6.0
#: Of samples that come more seconds apart a single one is no spike: it may be an order, entered as it was given.
SELDOM = 1.5
#: ... and so is one after which none comes for so many of their intervals: orders may be entered when they change.
LASTING = 3.0
#: Kinds of input whose logged values are feedback where they do not hold.
MEASURED = ("rudder", "propeller", "azimuth")


def judge_input(raw: Raw) -> Measurement:
    """Judge the samples of an input.

    Parameters
    ----------
    raw : Raw
        Physical values.

    Returns
    -------
    Measurement
        ``held`` for a command; its noise is then 0. Spikes are set aside only where the values are
        measured: a thruster got what was sent. Feedback is freed of its noise, if that is more than rounding.
    """
    step = float(np.median(np.diff(raw.t))) if len(raw.t) > 1 else 0.0
    held = holds(raw.value)
    sigma = 0.0 if held else feedback_noise(raw.value)
    measured = raw.source.quantity in MEASURED and not held and step <= SELDOM
    spike = spikes(raw.t, raw.value, sigma) if measured else np.zeros(len(raw.t), dtype=bool)
    reasons = {k: int(n) for k, n in (("flagged", raw.flagged.sum()), ("spike", spike.sum())) if n}
    good = ~(raw.flagged | spike)
    value = raw.value
    if measured and not raw.ordered and sigma > resolution(value):
        value = value.copy()
        value[good] = without_noise(raw.t[good], raw.value[good], sigma)
    return Measurement(
        raw.quantity, raw.t, value, sigma, good, raw.source.name, reasons, step, held, unsure=raw.unsure
    )


def holds(value: FloatArray) -> bool:
    """Whether an input's values are steps that hold, rather than a motion.

    Most neighbours are then equal, and most changes stand alone.
    """
    change = np.diff(value) != 0.0
    if len(change) < 3 or not change.any():
        return True
    alone = change[1:-1] & ~change[:-2] & ~change[2:]
    return bool(change.mean() < 0.5 and alone.sum() > 0.5 * change.sum())


def feedback_noise(value: FloatArray) -> float:
    """Return standard deviation of the white noise of feedback: from its third differences, by their median.

    The median passes over the moments at which the actuator starts and stops; rounding is the least.
    """
    if len(value) < 8:
        return 0.0
    third = np.diff(value, n=3)
    noise = MAD_TO_SIGMA * float(np.median(np.abs(third))) / np.sqrt(20.0)
    return float(max(noise, resolution(value) / np.sqrt(12.0)))


def spikes(t: FloatArray, value: FloatArray, sigma: float) -> BoolArray:
    """Single samples, at times ``t`` (n,), that stand out from both sides, which agree, and do not last; (n,) bool."""
    out = np.zeros(len(value), dtype=bool)
    if len(value) < 5:
        return out
    low, high = np.percentile(value, [1.0, 99.0])
    least = max(SPIKE_SIGMAS * sigma, SPIKE_SHARE * float(high - low))
    before, middle, after = value[:-2], value[1:-1], value[2:]
    away = np.minimum(np.abs(middle - before), np.abs(middle - after))
    same_side = (middle - before) * (middle - after) > 0.0
    brief = np.diff(t)[1:] < LASTING * np.median(np.diff(t))
    out[1:-1] = same_side & (away > least) & (np.abs(after - before) < 0.5 * away) & brief
    return out
