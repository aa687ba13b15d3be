"""How much less sure coefficients are than their errors' noise says, where the model lacks something.

Far from the noise the errors of a fit are what the model lacks: they are alike within a run and differ from run to run
in a way that no spectrum of theirs tells. What the coefficients are worth then shows in runs that a fit has not seen.
Each was left out in turn and predicted (``identify.left_out``); the covariance is made so much larger that it accounts
for the errors of those predictions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.chain import spreads
from identify.left_out import CAP, Refit, errors_in_parts
from identify.stretch import Stretch
from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: So many draws tell how the prediction moves, each of this share of a standard deviation: small, to stay linear.
DRAWS, SMALL = 24, 0.05


def misfit_scale(
    structure: Structure, stretches: Sequence[Stretch], refits: Sequence[Refit], covariance: FloatArray
) -> float:
    """Factor on the standard errors, at least 1: errors over runs left out, over what the covariance allows.

    Parameters
    ----------
    structure : Structure
    stretches : sequence of Stretch
    refits : sequence of Refit
    covariance : (np, np)
        Of the parameters, as the noise has it.

    Returns
    -------
    float
        Root mean square over stretches and u, v, r, each of them counting alike.
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    moves = SMALL * np.random.default_rng(0).standard_normal((DRAWS, len(root))) @ root.T
    spread = spreads(stretches)
    ratios = [
        _ratios(structure, r.p, stretches[k], moves, CAP * spread[k])
        for r in refits
        for k in sorted(r.unseen)
    ]
    squares = np.concatenate(ratios) ** 2 if ratios else np.zeros(0)
    known = squares[np.isfinite(squares)]
    return max(1.0, float(np.sqrt(known.mean()))) if len(known) else 1.0


def _ratios(
    structure: Structure, p: FloatArray, stretch: Stretch, moves: FloatArray, most: FloatArray
) -> FloatArray:
    """Error over what is allowed (3,) for one stretch, root mean squares over the stretch; NaN where nothing moves.

    An error counts as at most ``most`` (3,).
    """
    error = errors_in_parts(structure, p, stretch)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        moved = np.array([errors_in_parts(structure, p + m, stretch) for m in moves]) - error
        allowed = np.sqrt(np.nanmean((moved / SMALL) ** 2, axis=(0, 1)))
        capped = np.clip(np.nan_to_num(error, nan=np.inf, neginf=-np.inf), -most, most)
        return np.asarray(np.sqrt(np.mean(capped**2, axis=0)) / np.where(allowed > 0, allowed, np.nan))
