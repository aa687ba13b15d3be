"""Signals of a log that contradict each other as no vessel does: a wrong unit, sign or column, said before anything.

Nothing is changed for it. What only another model or effect could tell, a bias or a scale, is for the diagnosis.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from preprocess.integrated import integral_at
from preprocess.trial import FloatArray, Measurement
from preprocess.turned import pieces
from preprocess.vessel import Input

#: Rudders do not turn farther, rad.
FARTHEST = np.radians(100.0)
#: A rudder that never passes this, rad, does not turn a vessel so far round, rad, …
LITTLE, FAR_ROUND = np.radians(1.05), np.radians(45.0)
#: … where its yaw rate follows this share of the rudder's movement, in so many samples at least.
FOLLOWED, ENOUGH = 0.5, 100
#: One of a unit of thrust, SI: it is hardly worth a log that has no more.
ONE = {"percent": 0.01, "N": 1.0}
#: Turning is compared over so long, s, or a little longer, where it is in this many places at least.
OVER, LONGEST, PLACES = 5.0, 7.5, 8
#: More samples of the yaw rate than so many tell what was turned over that time; alone it tells where as often, s.
TELLS, OFTEN = 1, 1.0
#: It tells where either changes by more than so many of its errors (root mean square) and by this, rad.
CLEAR, LEAST_TURN = 10.0, np.radians(5.0)
#: Less than this is left of whole turns that a yaw rate counts, rad; no product of two turns is so small.
LEFT, TINY = 1.0, 1e-12
#: A yaw rate of this share of the heading's or less, of more than its inverse, or one that goes with it no better.
SHARE, TOGETHER = 0.5, 0.7
#: Under way: a speed of more than this share of what is reached.
UNDER_WAY = 0.3
#: A course that is farther than this from the heading for most of the way, rad.
ACROSS = np.radians(45.0)


def doubts(
    measurements: Mapping[str, Measurement],
    inputs: Mapping[str, Measurement],
    declared: Iterable[Input],
    states: pd.DataFrame,
) -> list[str]:
    """A sentence for each contradiction between the signals of a log.

    Parameters
    ----------
    measurements, inputs : mapping of str to Measurement
    declared : iterable of Input
    states : DataFrame
        The smoothed motion.
    """
    there = [(i, inputs[i.name]) for i in declared if i.name in inputs]
    found = [too_far(m) or too_little(m, states) for i, m in there if i.kind == "rudder"]
    found += [hardly_driven(m, i.unit) for i, m in there]
    found.append(turns_apart(measurements))
    return [words for words in (*found, across(states)) if words]


def too_far(rudder: Measurement) -> str | None:
    """What is said of a rudder that turns farther than one can."""
    most = float(np.max(np.abs(rudder.value[rudder.good]), initial=0.0))
    if most <= FARTHEST:
        return None
    return f"{rudder.name} reaches {np.degrees(most):.0f}°, farther than a rudder turns: is its unit right?"


def too_little(rudder: Measurement, states: pd.DataFrame) -> str | None:
    """What is said of a rudder that turns the vessel far round by next to nothing."""
    t, delta = rudder.t[rudder.good], rudder.value[rudder.good]
    most = float(np.max(np.abs(delta), initial=0.0))
    known = states.dropna(subset=["psi", "r"])
    if most > LITTLE or len(known) < ENOUGH or not np.ptp(delta):
        return None
    round_by = float(np.ptp(known["psi"]))
    at, r = (known[k].to_numpy(dtype=float) for k in ("t", "r"))
    if round_by < FAR_ROUND or followed(at, r, np.interp(at, t, delta)) < FOLLOWED:
        return None
    return (
        f"{rudder.name} never passes {np.degrees(most):.2g}°, and the vessel turns by {np.degrees(round_by):.0f}° "
        "with it: is its unit right?"
    )


def followed(t: FloatArray, r: FloatArray, delta: FloatArray) -> float:
    """Share (0…1) of a rudder's movement (n,) that the yaw rate (n,) follows: T ṙ + r = K δ (Nomoto 1957)."""
    left = delta - delta.mean()
    if not left.any():
        return 0.0
    design = np.column_stack([np.ones(len(t)), r, np.gradient(r, t)])
    fit, *_ = np.linalg.lstsq(design, left, rcond=None)
    return 1.0 - float(np.sum((left - design @ fit) ** 2) / np.sum(left**2))


def hardly_driven(thruster: Measurement, unit: str | None) -> str | None:
    """What is said of a thrust that is declared in percent or newtons and never passes one of them."""
    value = thruster.value[thruster.good]
    most = float(np.max(np.abs(value), initial=0.0))
    if unit not in ONE or not np.ptp(value) or most > ONE[unit]:
        return None
    return (
        f"{thruster.name} never passes {most / ONE[unit]:.2g} {unit}: if that is its share of full thrust, -1…1, "
        "leave its unit out."
    )


def turns_apart(measurements: Mapping[str, Measurement]) -> str | None:
    """What is said of heading and yaw rate where a log has both, and they do not tell the same."""
    if not {"heading", "yaw_rate"} <= set(measurements):
        return None
    return turning_apart(measurements["heading"], measurements["yaw_rate"])


def turning_apart(heading: Measurement, gyro: Measurement) -> str | None:
    """What is said where heading and yaw rate do not go together, or one by far more than the other."""
    turned, told = both_turns(heading, gyro)
    if len(turned) < PLACES:
        return None
    unbiased = turned - turned.mean(), told - told.mean()  # of a bias the diagnosis tells
    quiet = _size(unbiased[1]) < max(LEAST_TURN, CLEAR * adrift(gyro)) or gyro.sample_time > OFTEN
    if quiet and _size(turned) < max(LEAST_TURN, CLEAR * heading.sigma):
        return None
    ratio, alike = max(_together(turned, told), _together(*unbiased), key=lambda found: abs(found[1]))
    if alike < TOGETHER and ratio > -SHARE:
        return "Heading and yaw rate do not go together: is one of them another signal, or in another unit?"
    if SHARE < ratio < 1.0 / SHARE:
        return None
    return f"The yaw rate is {ratio:.3g} times that at which the heading turns: are units and signs of both right?"


def _together(turned: FloatArray, told: FloatArray) -> tuple[float, float]:
    """How many times the turns (n,) of a heading a yaw rate tells, and how well they correlate, -1…1."""
    along = float(turned @ told)
    ratio = along / max(float(turned @ turned), TINY)
    return ratio, along / max(float(np.linalg.norm(turned) * np.linalg.norm(told)), TINY)


def both_turns(heading: Measurement, gyro: Measurement) -> tuple[FloatArray, FloatArray]:
    """Turns (n,) of the heading and of the yaw rate from one heading to another some seconds later, rad."""
    if min(int(m.good.sum()) for m in (heading, gyro)) < PLACES:
        return np.zeros(0), np.zeros(0)
    t, at, rate = heading.t[heading.good], gyro.t[gyro.good], gyro.value[gyro.good].ravel()
    told = integral_at(t, at, rate)
    psi = unwound(heading.value[heading.good].ravel(), told)
    edges, covered = pieces(t, at, OVER, LONGEST, TELLS + 1)
    return np.diff(psi[edges])[covered], np.diff(told[edges])[covered]


def unwound(psi: FloatArray, told: FloatArray) -> FloatArray:
    """Headings (n,) without whole turns that were put between them by a yaw rate which does not fit the rest either.

    ``told`` (n,) is the yaw rate's integral; where units are wrong, what it leaves of a turn is any.
    """
    shortest = np.unwrap(psi)
    moved = np.abs(np.diff(psi - shortest)) > np.pi
    left = np.diff(psi - told)[moved]
    return shortest if len(left) and _size(left) > LEFT else psi


def adrift(gyro: Measurement) -> float:
    """By how much the noise of a yaw rate sets its integral adrift over a piece of time, rad."""
    t, rate = gyro.t[gyro.good], gyro.value[gyro.good].ravel()
    noise = 0.605 * float(np.median(np.abs(np.diff(rate, 2))))  # of normal noise: its standard deviation
    return noise * float(np.sqrt(OVER * np.median(np.diff(t))))


def _size(x: FloatArray) -> float:
    """Root mean square of (n,)."""
    return float(np.sqrt(np.mean(x**2))) if len(x) else 0.0


def across(states: pd.DataFrame) -> str | None:
    """What is said where the vessel moves across its heading for most of the way."""
    u, v = (states[k].to_numpy(dtype=float) for k in ("u", "v"))
    known = np.isfinite(u) & np.isfinite(v)
    speed = np.hypot(u[known], v[known])
    if len(speed) < PLACES or not speed.any():
        return None
    way = speed > UNDER_WAY * np.quantile(speed, 0.95)
    off = np.abs(np.arctan2(v[known], np.abs(u[known])))[way]
    if float(np.mean(off > ACROSS)) < 0.5:
        return None
    return (
        "The track runs across the heading for most of the way: are north and east exchanged, or is the heading "
        "another vessel's, unit's or zero's?"
    )
