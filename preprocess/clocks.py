"""Offsets between the clocks of a log, from the motion itself: reported, never removed.

An offset is stamp less true time. Between heading and yaw rate it is found by the likelihood of the heading chain with
the yaw rate's stamps moved. Position and heading share no kinematic equation, and neither do inputs and motion: there
it is found beside a model of the response. Whether an offset is a fault of the log is for the diagnosis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from preprocess.chains import Segments, Stream
from preprocess.gyro_clock import yaw_rate_offset
from preprocess.offsets import ClockOffset
from preprocess.response_clock import response_offsets
from preprocess.smoother import ChainResult
from preprocess.trial import Measurement


def clock_offsets(
    heading: ChainResult,
    track: ChainResult,
    states: pd.DataFrame,
    segments: Segments,
    inputs: Mapping[str, Measurement] | None,
    *,
    apart: bool = False,
) -> tuple[ClockOffset, ...]:
    """Tell all offsets that the motion of one trial can tell; see the module.

    Parameters
    ----------
    heading, track : ChainResult
        Of the campaign's origin.
    states : DataFrame
        Smoothed, as in a trial.
    segments : tuple of (start, end)
    inputs : mapping of str to Measurement or None
        None where only the kinematics are to speak: models of the response are not wanted, or cannot follow, as where
        forces turn with an azimuth.
    apart : bool
        Heading and yaw rate do not tell the same turns: a wrong sign or unit looks like a clock.
    """
    found = [None if apart else yaw_rate_offset(heading, segments)]
    if inputs is not None:
        sensors = [*in_step(heading, found[0]), levelled(track)[0]]
        found += response_offsets(states, segments, inputs, track.streams[0], sensors)
    return tuple(f for f in found if f is not None and np.isfinite(f.stderr))


def beyond_order(
    found: ClockOffset, sensors: Mapping[str, Measurement], inputs: Mapping[str, Measurement]
) -> ClockOffset:
    """An offset whose standard error has in it how little the order of the records says of the stamps compared."""
    compared = [m.unsure for m in inputs.values()] if found.stream == "the inputs" else []
    compared += [sensors[s].unsure for s in (found.stream, found.against) if s in sensors]
    return replace(
        found, stderr=float(np.hypot(found.stderr, np.hypot.reduce([0.0, *compared]) / np.sqrt(3.0)))
    )


def levelled(chain: ChainResult) -> list[Stream]:
    """The streams of a chain with the noise that was found."""
    return [replace(s, sigma=float(x)) for s, x in zip(chain.streams, chain.levels.sigma, strict=True)]


def in_step(heading: ChainResult, gyro: ClockOffset | None) -> list[Stream]:
    """Heading and yaw rate, the stamps of the latter less their offset."""
    shift = 0.0 if gyro is None else gyro.offset
    return [replace(s, t=s.t - shift) if s.name == "yaw_rate" else s for s in levelled(heading)]
