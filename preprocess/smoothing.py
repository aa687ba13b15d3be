"""How the motion is made of the samples: the default smoother, or the papers' observers on the same good samples."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from preprocess.chains import Segments
from preprocess.ekf_motion import filtered_motion
from preprocess.eso_motion import observed_motion
from preprocess.nomoto_motion import turned
from preprocess.smoother import ChainResult, states
from preprocess.trial import Measurement, Step
from preprocess.vessel import Smoothing


def motion(
    smoothing: Smoothing,
    track: ChainResult,
    heading: ChainResult,
    segments: Segments,
    rudders: Mapping[str, Measurement] | None = None,
) -> tuple[pd.DataFrame, tuple[Step, ...]]:
    """States by the chosen smoother, and what was done beyond the default.

    Parameters
    ----------
    smoothing : Smoothing
    track, heading : ChainResult
        Of the default smoother: their samples in use, of the campaign's origin, and noise levels are the observers'.
    segments : tuple of (start, end)
    rudders : mapping of str to Measurement, optional
        What the vessel is steered with, for the five-state ESO.
    """
    if smoothing.smoother == "eso":
        made, bandwidths = observed_motion(track, heading, segments, smoothing.bandwidth)
        return made, (Step("observe", {"smoother": "eso", "bandwidth": bandwidths}),)
    if smoothing.smoother == "nomoto_eso":
        observed, bandwidth = turned(heading, segments, rudders or {}, smoothing.bandwidth)
        said = {"smoother": "nomoto_eso", "bandwidth": {"nomoto": bandwidth}}
        return states(track, observed), (Step("observe", said),)
    if smoothing.smoother == "ekf":
        made, intensities = filtered_motion(track, heading, segments)
        return made, (Step("observe", {"smoother": "ekf", "intensity": intensities}),)
    return states(track, heading), ()
