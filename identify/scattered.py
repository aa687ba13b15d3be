"""How much the windows' scores scatter against what the covariance allows, and what intervals make of it.

A covariance says how much the noise that was told moves the parameters. Windows have first states of their own and are
as good as independent: what their scores say one against the other needs no such telling ("cluster-robust" covariance,
Liang and Zeger 1986), but a few of them say it poorly. So the covariance is expected to be right as surely as a few
windows would say it (Smyth 2004, moderated variances), and made larger where the windows scatter more than it allows;
never smaller. What is known from so many degrees of freedom is distributed as Student's t: a standard error is given
such that 1.96 of it are a 95 % interval.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import stats

from identify.first_states import first_states, state_precision
from identify.fitted import FAR, Fitted
from identify.reduction import reduce
from identify.windows import moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: That the covariance is right is expected beforehand as surely as so many degrees of freedom would say it.
EXPECTED = 5.0
#: What a window tells nearly alone says nothing of its scatter: at least this share is counted as told by others.
LEAST_LEFT = 0.1


def with_scatter(fitted: Fitted, windowed: Fitted, covariance: FloatArray) -> Fitted:
    """A fit with how much wider its intervals are than its covariance, for what the windows of another fit say.

    Parameters
    ----------
    fitted : Fitted
        What is reported, over windows of any length.
    windowed : Fitted
        The same structure near the noise, over windows that are short against the logs.
    covariance : (np, np)
        Of the parameters of ``windowed``, as the noise has it.
    """
    if not windowed.chi2_per_dof < FAR:
        return fitted
    ratio, degrees = _scatter(windowed, covariance)
    variance = np.maximum(1.0, (EXPECTED + degrees * ratio) / (EXPECTED + degrees))
    wider = np.sqrt(variance) * stats.t.ppf(0.975, EXPECTED + degrees) / stats.norm.ppf(0.975)
    return replace(fitted, wider=np.asarray(wider, dtype=float))


def _scatter(fitted: Fitted, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Variance (np,) of each parameter by its windows' scores over that of the covariance, and degrees of freedom.

    These are one less than windows, where all tell as much of the parameter (Satterthwaite 1946). Of numbers that are
    not finite nothing is said.
    """
    problem, s = fitted.problem, fitted.solution
    nothing = np.ones(len(s.p)), np.zeros(len(s.p))
    now = moments(problem, s.structure, s.p, s.first)
    reduced = reduce(now.matrices, s.first, first_states(problem), state_precision(s.structure))
    information = reduced.information.sum(axis=0) + np.diag(1.0 / fitted.prior.sd**2)
    if not np.isfinite(information).all() or len(problem.windows) < 2:
        return nothing
    root = _root(information)
    shares = root.T @ reduced.information @ root
    influence = _unfitted(shares, reduced.score @ root) @ root.T
    told = np.maximum(np.einsum("ij,wjk,ik->wi", root, shares, root), 0.0)
    scattered, said = np.sum(influence**2, axis=0), np.diag(covariance)
    ratio = np.divide(scattered, said, out=np.ones(len(said)), where=said > 0.0)
    part = told / np.maximum(told.max(axis=0), 1e-300)
    degrees = np.sum(part, axis=0) ** 2 / np.maximum(np.sum(part**2, axis=0), 1e-300) - 1.0
    return np.nan_to_num(ratio, nan=1.0, posinf=1.0), np.maximum(np.nan_to_num(degrees), 0.0)


def _root(information: FloatArray) -> FloatArray:
    """Matrix (np, np) whose product with its own transpose is the inverse of an information matrix."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.divide(
        1.0, size, out=np.zeros(len(size)), where=size > 1e-150
    )  # of what nothing tells, nothing
    values, vectors = np.linalg.eigh(information * scale * scale[:, None])
    return np.asarray(scale[:, None] * vectors / np.sqrt(np.maximum(values, 1e-12 * values[-1])), dtype=float)


def _unfitted(shares: FloatArray, scores: FloatArray) -> FloatArray:
    """Scores (w, np) as they would be had the fit not followed them; ``shares`` (w, np, np) of all information.

    Bell and McCaffrey (2002), "CR2": along what a window alone tells, the fit left nothing of its score.
    """
    known, along = np.linalg.eigh(shares)
    left = np.sqrt(np.maximum(1.0 - known, LEAST_LEFT))
    turned = np.einsum("wij,wi->wj", along, scores) / left
    return np.asarray(np.einsum("wij,wj->wi", along, turned), dtype=float)
