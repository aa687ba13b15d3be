"""A compass that deviates with the heading (iron on board), told by the gyro, and headings without it.

What a heading says less what the gyro's yaw rate adds up to has no motion in it. What of that goes with the heading,
once and twice around, is deviation (its mean is not told so). An adjusted compass keeps some tenths of a degree of it:
in the sway of a vessel under way, and over all that a campaign tells, that counts. What is more than any adjusted
compass keeps is left for the diagnosis: it is a fault of the vessel's, and said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import chi2

from preprocess.integrated import Piece
from preprocess.told_wanders import Told
from preprocess.trial import FloatArray, Trial
from preprocess.wander_likelihood import Errors, columns_of

#: Deviation is believed where chance makes as much in this share of cases.
BELIEVED = 1e-4
#: No more than this is left of an adjusted compass, rad.
ADJUSTED = np.radians(1.0)
#: Of a campaign's compass all is told by this many headings around.
AROUND: FloatArray = np.linspace(0.0, 2.0 * np.pi, 73)


class Deviation(NamedTuple):
    """How much (4,) of the sine and cosine of the heading, and of twice the heading, is in it, rad."""

    parts: FloatArray

    def at(self, heading: FloatArray) -> FloatArray:
        """Deviation (n,) at headings (n,), rad."""
        each = [f(k * heading) for k in (1.0, 2.0) for f in (np.sin, np.cos)]
        return np.asarray(self.parts @ np.array(each), dtype=float)

    @property
    def most(self) -> float:
        """The largest deviation at any heading, rad."""
        return float(np.abs(self.at(AROUND)).max())


def deviation_of(pieces: Sequence[Piece], place: slice, found: Told, missed: float) -> Deviation | None:
    """The deviation that pieces of a heading less the gyro's turns show; None where chance may have made it.

    Parameters
    ----------
    pieces : sequence of Piece
        Whole runs in long blocks, with all that every log has alike.
    place : slice
        Of the four columns of deviation among those.
    found : Told
        Wanders that the same pieces showed.
    missed : float
        How much faster the gyro's noise may add up than its samples say, as a logarithm.
    """
    own, rate = (None if w is None else w.time for w in (found.own, found.rate))
    smooth = found.own is not None and found.own.smooth
    errors = Errors(own, rate, smooth, walks=found.rate is None, missed=missed)
    each, covariance = columns_of(pieces, errors)
    parts, spread = each[place], covariance[place, place]
    if not np.isfinite(spread).all():
        return None
    told = float(parts @ np.linalg.lstsq(spread, parts, rcond=None)[0])
    return Deviation(parts) if told > float(chi2.isf(BELIEVED, len(parts))) else None


def without_deviation(trial: Trial, deviation: Deviation | None) -> Trial:
    """The trial with its headings, and the motion that was smoothed along them, freed of a small deviation; said."""
    if deviation is None or "heading" not in trial.measurements:
        return trial
    degrees = f"{np.degrees(deviation.most):.2g}°"
    if deviation.most > ADJUSTED:
        said = f"The heading deviates from what the gyro turns by up to {degrees}, with the heading: swing the compass."
        return replace(trial, findings=(*trial.findings, said))
    heading = trial.measurements["heading"]
    freed = replace(heading, value=heading.value - deviation.at(heading.value))
    said = f"The compass deviates by up to {degrees}, as the gyro tells: taken off."
    return replace(
        trial,
        measurements={**trial.measurements, "heading": freed},
        states=_turned(trial.states, deviation),
        findings=(*trial.findings, said),
    )


def _turned(states: pd.DataFrame, deviation: Deviation) -> pd.DataFrame:
    """States at headings less the deviation, their velocities along the axes that are meant so."""
    off = deviation.at(states["psi"].to_numpy(dtype=float))
    turned = {"psi": states["psi"] - off}
    for forward, starboard in (pair for pair in (("u", "v"), ("du", "dv")) if pair[0] in states):
        along = (states[forward] + 1j * states[starboard]).to_numpy() * np.exp(1j * off)
        turned |= {forward: along.real, starboard: along.imag}
    return states.assign(**turned)
