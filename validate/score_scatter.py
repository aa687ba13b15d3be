"""How much a gain is worth where the errors are no white noise: by what the windows say one against the other.

A gain in -2 log likelihood is chi-squared by chance where the errors are what the likelihood says. What wanders, or
what no log says of the inputs, makes the windows' scores scatter more than their information; the gain is then by
chance as many times larger (Satterthwaite 1946; Rotnitzky and Jewell 1990: the mean eigenvalue of the information's
inverse against the covariance that the scores themselves have, "sandwich", along the effect's parameters). Windows have
first states of their own, so that their scores are as good as independent. How much they scatter is known as well as
what is expected beforehand and so many windows can say it: the gain is distributed as F, whose tail is the longer the
fewer there are (Smyth 2004, moderated variances).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identify.first_states import first_states, state_precision
from identify.fitted import FAR, Fitted
from identify.reduction import reduce
from identify.windows import moments

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: That errors are what the likelihood says is expected beforehand as surely as so many windows would say it.
EXPECTED = 2.0


@dataclass(frozen=True)
class Scatter:
    """How many times larger than chi-squared a gain is by chance, at least 1, and from how many ``degrees`` of freedom.

    Far from the noise, where errors are the model's and not chance's, nothing is said.
    """

    ratio: float = 1.0
    degrees: float = np.inf


def scatter(fitted: Fitted, index: int) -> Scatter:
    """How much the windows' scores of one effect of a fit scatter."""
    solution, problem = fitted.solution, fitted.problem
    mine = [k for k, s in enumerate(solution.structure.slots) if s.effect == index]
    if fitted.chi2_per_dof > FAR or not mine:
        return Scatter()
    dispersed = replace(problem.dispersed, dispersion=np.ones(4))
    now = moments(dispersed, solution.structure, solution.p, solution.first)
    known = state_precision(solution.structure)
    reduced = reduce(now.matrices, solution.first, first_states(dispersed), known)
    information = reduced.information.sum(axis=0) + np.diag(1.0 / fitted.prior.sd**2)
    windows = len(problem.windows)
    return moderated(_mean_ratio(information, reduced.score, mine) if windows > 1 else 1.0, windows)


def moderated(ratio: float, windows: int) -> Scatter:
    """What a ratio between so many windows and what is expected beforehand say together."""
    degrees = EXPECTED + windows - 1
    return Scatter(max(1.0, (EXPECTED + (windows - 1) * ratio) / degrees), degrees)


def _mean_ratio(information: FloatArray, scores: FloatArray, mine: list[int]) -> float:
    """Mean eigenvalue, along ``mine``, of the scores' (w, np) covariance against that which the information gives."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.divide(
        1.0, size, out=np.zeros(len(size)), where=size > 0.0
    )  # what nothing tells of says nothing
    inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-9, hermitian=True)
    apart = (scores - scores.mean(axis=0)) * scale
    moved = apart @ inverse[:, mine]
    n = len(scores)
    alone = np.linalg.pinv(inverse[np.ix_(mine, mine)], rcond=1e-9, hermitian=True)
    return float(np.trace(alone @ moved.T @ moved) * n / (n - 1) / len(mine))
