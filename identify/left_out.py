"""How well logs are predicted that a fit over whole logs has not seen, and how tight a prior that asks for.

Each log is left out in turn, the rest fitted again, and the log predicted free-running in thirds, each from its own
smoothed beginning: over the whole of a gentle log the course of an unstable vessel may be lost whatever the model, and
then it would say nothing of it. Logs count alike, by the ratio of their errors (a Gaussian likelihood with an error of
its own for each); one that is predicted no better than by its mean is not predicted, and how badly does not matter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice, pairwise

import numpy as np

from identify.drive import drive
from identify.joined import Joined, join
from identify.output_error import Prior
from identify.predict import run, shown, true_first_state
from identify.stretch import Stretch
from identify.structure import Structure
from identify.whole_logs import FIRM, joined_from_simple, regression_start
from preprocess.cores import side_by_side

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: How many times its natural size a coefficient may have, from tight to loose.
RIDGES = (1.0, 3.0, 10.0, 30.0)
#: At most so many groups of logs are left out in turn; with fewer logs than this nothing is left out.
MOST_GROUPS, LEAST_LOGS = 8, 3
#: Jumps between windows, from loose to tight, where a log was left out and the rest is fitted again.
AGAIN = (3e-2, 1e-2, 3e-3)
#: A log that was left out is predicted in so many parts.
PARTS = 3
#: An error counts as at most so many spreads: a prediction that ran away is bad, not infinitely so.
CAP = 3.0


@dataclass(frozen=True)
class Refit:
    """Parameters ``p`` (np,) of a fit that has not seen these stretches."""

    unseen: frozenset[int]
    p: FloatArray


@dataclass(frozen=True)
class Regularised:
    """A fit over whole logs with the prior that predicts logs left out best.

    ``errors`` (groups,) root mean square over u, v, r of the errors of each group of logs when it was left out, in
    units of each log's own spread; empty where there were too few logs. ``refits`` are the fits to the others, but for
    those that ran away.
    """

    joined: Joined
    ridge: float
    errors: FloatArray
    refits: tuple[Refit, ...] = ()

    @property
    def error(self) -> float:
        """Geometric mean of the errors, each at most 1."""
        return geometric_mean(self.errors) if len(self.errors) else np.inf


def geometric_mean(errors: FloatArray) -> float:
    """Geometric mean of errors (groups,), each at most 1."""
    return float(np.exp(np.mean(np.log(np.minimum(errors, 1.0)))))


def joined_regularised(
    structure: Structure, stretches: Sequence[Stretch], worth: Callable[[Joined], bool] = lambda _: True
) -> Regularised | None:
    """Fit whole logs free-running with the prior that predicts logs left out best.

    None where the model runs away, or where no prior gives a fit that is ``worth`` leaving logs out for.
    """
    if not groups_of(stretches):
        found = joined_from_simple(structure, stretches)
        return None if found is None else Regularised(found, np.inf, np.zeros(0))
    return min(by_prior(structure, stretches, worth), key=lambda r: r.error, default=None)


def by_prior(
    structure: Structure, stretches: Sequence[Stretch], worth: Callable[[Joined], bool] = lambda _: True
) -> list[Regularised]:
    """The fits with every prior that do not run away, from tight to loose; none where nothing can be left out."""
    groups = groups_of(stretches)
    fits = _with_priors(structure, stretches) if groups else []
    if not any(worth(found) for found, _ in fits):
        return []
    ways = [partial(_refitted, found, prior, g) for found, prior in fits for g in groups]
    refits = iter(side_by_side(lambda way: way(), ways))
    return [_judged(found, prior.ridge, list(islice(refits, len(groups)))) for found, prior in fits]


def groups_of(stretches: Sequence[Stretch]) -> list[set[int]]:
    """Stretches by log, joined to a few groups; none where there are too few logs."""
    names = list(dict.fromkeys(s.name for s in stretches))
    if len(names) < LEAST_LOGS:
        return []
    groups = [
        {k for k, s in enumerate(stretches) if names.index(s.name) % MOST_GROUPS == g}
        for g in range(MOST_GROUPS)
    ]
    return [g for g in groups if g]


def _with_priors(structure: Structure, stretches: Sequence[Stretch]) -> list[tuple[Joined, Prior]]:
    """The fits with every prior, each begun from that with the one before where there is one."""
    fits: list[tuple[Joined, Prior]] = []
    for ridge in RIDGES:
        _, prior = regression_start(structure, stretches, ridge)
        if fits:
            before = fits[-1][0]
            found = join(before.chain, before.p, prior, before.first, jumps=FIRM)
        else:
            found = joined_from_simple(structure, stretches, ridge)
        if found is not None:
            fits.append((found, prior))
    return fits


def _judged(found: Joined, ridge: float, refits: Sequence[Refit | None]) -> Regularised:
    """A fit with what those to the other logs predict of the one left out."""
    chain = found.chain
    errors = [
        CAP if r is None else error_of(chain.structure, chain.stretches, chain.spread, r) for r in refits
    ]
    return Regularised(found, ridge, np.array(errors), tuple(r for r in refits if r is not None))


def _refitted(found: Joined, prior: Prior, group: set[int]) -> Refit | None:
    """The fit gone on with without a group of stretches; None where it runs away."""
    kept = [k for k, w in enumerate(found.chain.pieces) if w.stretch not in group]
    again = join(found.chain.without(group), found.p, prior, found.first[kept], jumps=AGAIN, budget=8)
    return None if again is None else Refit(frozenset(group), again.p)


def error_of(structure: Structure, stretches: Sequence[Stretch], spread: FloatArray, refit: Refit) -> float:
    """Root mean square error, in units of each log's own ``spread`` (stretches, 3), of stretches that were left out."""
    errors = [errors_in_parts(structure, refit.p, stretches[k]) / spread[k] for k in sorted(refit.unseen)]
    capped = np.clip(np.nan_to_num(np.vstack(errors), nan=CAP), -CAP, CAP)
    return float(np.sqrt(np.mean(capped**2)))


def errors_in_parts(structure: Structure, p: FloatArray, stretch: Stretch, parts: int = PARTS) -> FloatArray:
    """Free-running errors (m, 3) of u, v, r over parts of a stretch, each from its first smoothed state."""
    d = drive(structure, p, stretch)
    edges = np.linspace(0, stretch.steps, parts + 1).astype(int)
    found = []
    for a, b in pairwise(edges.tolist()):
        with np.errstate(over="ignore", invalid="ignore"):
            states = run(structure, d, stretch, true_first_state(structure, d, stretch, a), a, b - a)
            predicted = shown(structure, d, stretch, states)
        found.append(predicted[:, 3:6] - stretch.states[a : b + 1, 3:6])
    return np.vstack(found)
