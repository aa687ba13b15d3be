"""The mean of fits over whole logs: of a model and of those that are parts of it, under tight priors and loose ones.

What some logs cannot tell of a rich model, a lean one or a tight prior guesses, each with errors of its own; their mean
is off by less. Accelerations are sums of terms, so that the mean of the coefficients of models that are parts of one is
that model again. Which fits it is of, and how often each, is picked one after the other by how well the mean predicts
logs that none of them has seen (Caruana et al. 2004, "Ensemble selection from libraries of models").
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.chain import spreads
from identify.joined import Joined
from identify.left_out import CAP, Refit, Regularised, by_prior, error_of, geometric_mean, groups_of
from identify.models import MODELS, terms_for
from identify.stretch import Stretch
from identify.structure import Structure
from identify.term import products_of

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A mean is of so many at most, the same fit counted as often as it was picked.
PICKS = 8


@dataclass(frozen=True)
class Expert:
    """A fit of a model under a prior: parameters ``p`` (np,), and ``without`` each group of stretches."""

    model: str
    ridge: float
    p: FloatArray
    without: Mapping[frozenset[int], FloatArray]


@dataclass(frozen=True)
class Mean:
    """The mean (np,) of ``experts``, one as often as it counts, and of their fits that have not seen some stretches.

    ``errors`` (groups,) are those of the groups of logs when they were left out, as ``Regularised`` has them; ``alone``
    is the error of the best of the fits by itself.
    """

    p: FloatArray
    refits: tuple[Refit, ...]
    experts: tuple[Expert, ...]
    errors: FloatArray
    alone: float = np.inf

    @property
    def error(self) -> float:
        """Geometric mean of the errors, each at most 1."""
        return geometric_mean(self.errors)


def averaged(
    structure: Structure, stretches: Sequence[Stretch], worth: Callable[[Joined], bool] = lambda _: True
) -> Mean | None:
    """The mean of fits over whole logs that predicts logs left out best.

    None where there are too few logs to leave any out, where everything runs away once one is left out, or where no
    prior gives a fit of the model itself that is ``worth`` it.
    """
    experts = experts_of(structure, stretches, worth)
    return picked(structure, stretches, experts, unseen_of(stretches)) if experts else None


def unseen_of(stretches: Sequence[Stretch]) -> list[frozenset[int]]:
    """The groups of stretches that are left out in turn."""
    return [frozenset(g) for g in groups_of(stretches)]


def experts_of(
    structure: Structure, stretches: Sequence[Stretch], worth: Callable[[Joined], bool] = lambda _: True
) -> list[Expert]:
    """The fits of a model and of its parts under every prior; none where none of the model's own is ``worth`` it."""
    every = unseen_of(stretches)
    experts = _own(structure, structure, by_prior(structure, stretches, worth), every)
    for part in parts_of(structure) if experts else []:
        experts += _own(structure, part, by_prior(part, stretches), every)
    return experts


def parts_of(structure: Structure) -> list[Structure]:
    """The same vessel, logs and effects with every model whose terms are some of this one's, and that predicts all."""
    whole, found = products_of(structure.setting.terms), []
    for model in MODELS:
        if model.discrete or model.flow or model.predicts != structure.model.predicts:
            continue
        terms, _ = terms_for(model, structure.vessel, structure.inputs)
        if products_of(terms) < whole:
            found.append(replace(structure, model=model, setting=replace(structure.setting, terms=terms)))
    return found if not (structure.model.discrete or structure.model.flow) else []


def _own(
    whole: Structure, own: Structure, fits: Sequence[Regularised], every: Sequence[frozenset[int]]
) -> list[Expert]:
    """The fits of a part of a structure as its own; not a number where they ran away without a group of stretches."""
    found = []
    for fit in fits:
        p = whole.carried(fit.joined.p, own)
        without: dict[frozenset[int], FloatArray] = dict.fromkeys(every, np.full(len(p), np.nan))
        without |= {r.unseen: whole.carried(r.p, own) for r in fit.refits}
        found.append(Expert(own.model.name, fit.ridge, p, without))
    return found


def picked(
    structure: Structure,
    stretches: Sequence[Stretch],
    experts: Sequence[Expert],
    every: Sequence[frozenset[int]],
    most: int = PICKS,
) -> Mean:
    """The mean of up to ``most`` experts, some more than once, that predicts groups of stretches best.

    None of them has seen the group that it is judged by.
    """
    means: list[Mean] = []
    for _ in range(most):
        chosen = means[-1].experts if means else ()
        tried = [mean_of(structure, stretches, (*chosen, e), every) for e in experts]
        means.append(min(tried, key=lambda m: m.error))
    return replace(min(means, key=lambda m: m.error), alone=means[0].error)


def mean_of(
    structure: Structure,
    stretches: Sequence[Stretch],
    experts: tuple[Expert, ...],
    every: Sequence[frozenset[int]],
) -> Mean:
    """The mean of some experts, and what it predicts of groups of stretches that none of them has seen."""
    refits = tuple(Refit(g, np.mean([e.without[g] for e in experts], axis=0)) for g in every)
    spread = spreads(stretches)
    errors = [error_of(structure, stretches, spread, r) if np.isfinite(r.p).all() else CAP for r in refits]
    known = tuple(r for r in refits if np.isfinite(r.p).all())
    return Mean(np.mean([e.p for e in experts], axis=0), known, experts, np.array(errors))


def words_of(mean: Mean) -> str:
    """What a fit that is a mean says of itself."""
    count = Counter(e.model for e in mean.experts)
    models = ", ".join(f"{n} of {name}" for name, n in count.items())
    return (
        f"The coefficients are the mean of those of {len(mean.experts)} fits over whole logs ({models}; under priors "
        f"tight and loose, some counted more than once). It predicts logs left out with an error of {mean.error:.3f} "
        f"of their spread, the best of the fits alone with {mean.alone:.3f}."
    )
