"""Numbers of an input that are no value of it: codes that loggers write for none, and single ones far off all others.

An actuator steps, and some are kicked for a moment: only what lies many times as far off as all that is logged besides
is set aside, and what stays for longer than two samples only if it is a known code or far beyond the calibration.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from ingest.codes import FEWEST, LARGEST, codes, off
from preprocess.trial import BoolArray, FloatArray

#: How far what is beyond a calibration and a lone sample lie off, as multiples of its size and of that of the rest.
CALIBRATION_OFF, LONE_OFF = 3.0, 10.0
#: What lasts is the running median of so many samples: one or two in a row are none of it.
WIDTH = 5
#: Of samples that come more seconds apart two may be a kick, and one that lasts so many intervals an order.
SELDOM, LASTING = 0.5, 3.0
#: Values that are named.
NAMED = 3


def wild(t: FloatArray, value: FloatArray, calibrated: tuple[float, ...] = ()) -> BoolArray:
    """Numbers that are no value of an input; (n,) bool.

    Parameters
    ----------
    t : (n,) s
    value : (n,)
        As logged; NaN where there is no number.
    calibrated : (k,)
        Raw values of its calibration, if it has one.
    """
    out = ~np.isnan(value) & ~(np.abs(value) <= LARGEST)
    known = np.flatnonzero(np.isfinite(value) & ~out)
    out[known] = codes(value[known])
    if calibrated:
        beyond = _beyond(value[known], calibrated)
        far = beyond > CALIBRATION_OFF
        out[known] = (out[known] & (beyond > 0.0)) | (
            far & (2 * far.sum() < len(far))
        )  # else it is another's
    known = known[~out[known]]
    out[known] = _lone(t[known], value[known])
    return out


def _beyond(value: FloatArray, calibrated: tuple[float, ...]) -> FloatArray:
    """How far numbers (n,) are beyond a calibration, in its widths; not above 0 within."""
    low, high = min(calibrated), max(calibrated)
    return np.asarray(np.maximum(low - value, value - high) / (high - low), float)


def _lone(t: FloatArray, value: FloatArray) -> BoolArray:
    """One or two samples in a row that are far off all that lasts, and do not last themselves.

    Where that is nothing but zeros they may be all that the actuator did.
    """
    from scipy.ndimage import median_filter

    step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    if len(value) < FEWEST or step > SELDOM:
        return np.zeros(len(value), dtype=bool)
    lasts = median_filter(value, size=WIDTH, mode="mirror")
    brief = np.append(np.diff(t) < LASTING * step, True)
    return brief & off(value, lasts, LONE_OFF) & lasts.any()


def said(name: str, signal: str, value: FloatArray, aside: BoolArray) -> str:
    """What is said of the numbers (n,) of an input that were set aside: how many, which, and what the others are."""
    counts = Counter(value[aside].tolist()).most_common()
    named = ", ".join(f"{n} of {x:g}" for x, n in counts[:NAMED])
    more = f" and {sum(n for _, n in counts[NAMED:])} others" if len(counts) > NAMED else ""
    rest = value[~aside & np.isfinite(value)]
    among = (
        f"the other {len(rest)} go from {rest.min():g} to {rest.max():g}"
        if len(rest)
        else "there is no other"
    )
    return f"{name}: {named}{more} in '{signal}' were set aside as no value of it; {among}."
