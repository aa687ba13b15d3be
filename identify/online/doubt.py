"""Which samples of a window are believed: judged by the model, where the causal observer was in doubt.

An observer that knows nothing of the inputs takes the answer to a hard step for an outlier; leaving such samples out
would bias the estimate. So they come into the window without weight, and the model says whether they fit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.noise import WILD
from identify.online.horizon import fitted_firsts, problem_of, with_noise
from identify.online.knowledge import Noise
from identify.stretch import Samples, Stretch
from identify.structure import Structure
from identify.windows import moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: The σ of a doubtful sample is multiplied by this: it counts nothing.
DOUBTFUL = 1e4
#: A doubtful sample is believed where its error is less than so many σ.
BELIEVED = 5.0


def judged(structure: Structure, p: FloatArray, stretch: Stretch, noise: Noise) -> Stretch:
    """The stretch without the samples that are not believed, the noise of the others set by their stream."""
    samples = stretch.samples
    own = np.array([np.min(samples.sigma[samples.kind == k], initial=np.inf) for k in range(4)])
    doubtful = samples.sigma > 0.5 * DOUBTFUL * own[samples.kind]
    sure = _kept(with_noise(stretch, noise), ~doubtful)
    if len(sure.samples.t) < 10:
        return sure
    first = fitted_firsts(structure, p, (sure,), noise)
    every = with_noise(stretch, noise)
    found = moments(problem_of((every,), noise), structure, p, first)
    if not np.isfinite(found.cost):
        return sure
    error = np.abs(found.residuals[0]).max(axis=1)
    good = np.where(doubtful, error < BELIEVED, ~_lone(samples, error))
    return _kept(every, good)


def _lone(samples: Samples, error: FloatArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Wild samples between neighbours of the same sensor that are not."""
    out = np.zeros(len(error), dtype=bool)
    for k in np.unique(samples.kind):
        mine = np.flatnonzero(samples.kind == k)
        around = np.maximum(np.roll(error[mine], 1), np.roll(error[mine], -1))
        lone = (error[mine] > WILD) & (error[mine] > 2.0 * around)
        out[mine] = lone & (lone.mean() < 0.05)
    return out


def _kept(stretch: Stretch, rows: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Stretch:
    s = stretch.samples
    return replace(stretch, samples=Samples(s.t[rows], s.kind[rows], s.value[rows], s.sigma[rows]))
