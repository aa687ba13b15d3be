"""How the motion is made of the samples: the default smoother, or the papers' observers on the same good samples."""

from __future__ import annotations

import pandas as pd

from preprocess.chains import Segments
from preprocess.ekf_motion import filtered_motion
from preprocess.eso_motion import observed_motion
from preprocess.smoother import ChainResult, states
from preprocess.trial import Step
from preprocess.vessel import Smoothing


def motion(
    smoothing: Smoothing, track: ChainResult, heading: ChainResult, segments: Segments
) -> tuple[pd.DataFrame, tuple[Step, ...]]:
    """States by the chosen smoother, and what was done beyond the default.

    Parameters
    ----------
    smoothing : Smoothing
    track, heading : ChainResult
        Of the default smoother: their samples in use, of the campaign's origin, and noise levels are the observers'.
    segments : tuple of (start, end)
    """
    if smoothing.smoother == "eso":
        made, bandwidths = observed_motion(track, heading, segments, smoothing.bandwidth)
        return made, (Step("observe", {"smoother": "eso", "bandwidth": bandwidths}),)
    if smoothing.smoother == "ekf":
        made, intensities = filtered_motion(track, heading, segments)
        return made, (Step("observe", {"smoother": "ekf", "intensity": intensities}),)
    return states(track, heading), ()
