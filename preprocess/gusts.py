"""Wind without the noise of its anemometer: gusts that come and go, beside white noise, at their likeliest sizes.

An anemometer scatters by some tenths of a metre a second and by some per cent of the wind. Taken as measured that would
push the model, and not the vessel. Gusts are first-order Gauss-Markov about a mean; their precision is tridiagonal, so
that likelihood and smoothed wind are a banded solution each (Rue and Held 2005, sections 2.4 and 3.1).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize

from preprocess.trial import FloatArray

#: Fewer samples than this tell no gusts from noise; those that come sooner one after the other than this share of their
#: usual interval count as that far apart.
FEWEST, SOON = 20, 0.02
#: Logarithms of gusts over noise and of their time constant over the samples' interval are sought within these.
OVER_NOISE, LASTING = (-6.0, 6.0), (0.0, 8.0)
#: Where the search begins, as such logarithms, and its first steps.
BEGIN, STEP = (0.0, 3.0), (1.5, 1.5)


def without_noise(t: FloatArray, wind: FloatArray) -> tuple[FloatArray, float]:
    """Velocities of the air (n, 2) at times ``t`` (n,), s, smoothed; and the noise that was in each component, m/s."""
    if len(t) < FEWEST or not np.ptp(wind, axis=0).any():
        return wind, 0.0
    gusts = wind - wind.mean(axis=0)
    every = np.maximum(np.diff(t) / float(np.median(np.diff(t))), SOON)

    def objective(x: FloatArray) -> float:
        return _smoothed(every, gusts, *np.exp(x))[0]

    simplex = np.array([BEGIN, (BEGIN[0] + STEP[0], BEGIN[1]), (BEGIN[0], BEGIN[1] + STEP[1])])
    best = minimize(
        objective, simplex[0], method="Nelder-Mead", bounds=[OVER_NOISE, LASTING],
        options={"initial_simplex": simplex, "xatol": 0.02, "fatol": 0.02},
    )  # fmt: skip
    _, smoothed, noise = _smoothed(every, gusts, *np.exp(best.x))
    return wind.mean(axis=0) + smoothed, noise


def _smoothed(
    every: FloatArray, gusts: FloatArray, over_noise: float, lasting: float
) -> tuple[float, FloatArray, float]:
    """-2 log likelihood at the likeliest noise, smoothed gusts (n, 2), that noise; intervals (n - 1,) are relative."""
    kept = np.exp(-every / lasting)
    free = np.maximum(1.0 - kept**2, 1e-12)
    prior = np.zeros((2, len(gusts)))
    prior[0, 1:] = -kept / free
    prior[1, :-1] += kept**2 / free
    prior[1] += 1.0
    prior[1, 1:] += 1.0 / free - 1.0
    prior /= over_noise**2
    posterior = prior.copy()
    posterior[1] += 1.0
    root = cholesky_banded(posterior, check_finite=False)
    smoothed = np.asarray(cho_solve_banded((root, False), gusts, check_finite=False), dtype=float)
    n, columns = gusts.shape
    variance = float(np.sum(gusts * (gusts - smoothed))) / (n * columns)
    log_prior = -float(np.log(free).sum()) - 2.0 * n * float(np.log(over_noise))
    logs = 2.0 * float(np.log(root[1]).sum()) - log_prior
    return (
        columns * (logs + n * float(np.log(max(variance, 1e-12)))),
        smoothed,
        float(np.sqrt(max(variance, 0.0))),
    )
