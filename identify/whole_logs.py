"""Whole logs fitted free-running from nothing: by regression, and from where a lean model leads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.chain import chain_of
from identify.joined import Joined, join
from identify.models import MODEL_BY_NAME, terms_for
from identify.output_error import RIDGE, Prior, prior_for
from identify.regression import coefficient_scales, start_by_regression
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: The model that leads others into a good valley: few terms, of which most models have some.
LEAN = "blanke"
#: Jumps between windows where a search begins from another model's solution.
FIRM = (1e-2, 3e-3, 1e-3)


def joined_from_simple(
    structure: Structure, stretches: Sequence[Stretch], ridge: float = RIDGE
) -> Joined | None:
    """Fit whole logs free-running, from the regression and from the solution of a lean model; the better of the two.

    A rich model has many valleys; the one that a lean model leads into is rarely a bad one, and often the best.
    ``ridge`` is how many times its natural size a coefficient may have.
    """
    chain = chain_of(structure, stretches)
    p, prior = regression_start(structure, stretches, ridge)
    found = [join(chain, p, prior)]
    lean = lean_structure(structure)
    if lean is not None:
        q, known = regression_start(lean, stretches)
        leader = join(chain_of(lean, stretches), q, known)
        if leader is not None:
            found.append(join(chain, structure.carried(leader.p, lean), prior, leader.first, jumps=FIRM))
    return min((f for f in found if f is not None), key=lambda f: f.cost, default=None)


def regression_start(
    structure: Structure, stretches: Sequence[Stretch], ridge: float = RIDGE
) -> tuple[FloatArray, Prior]:
    """Coefficients by regression, effects at their null, and what is known beforehand."""
    p = start_by_regression(structure, null_parameters(structure), stretches)
    return p, prior_for(structure, coefficient_scales(structure, p, stretches), ridge)


def lean_structure(structure: Structure) -> Structure | None:
    """The same vessel, logs and effects with the model ``LEAN``; None where that has no more to say."""
    model = MODEL_BY_NAME[LEAN]
    if structure.model.name == LEAN or not structure.setting.of_kind("rudder"):
        return None
    terms, _ = terms_for(model, structure.vessel, structure.inputs)
    return replace(structure, model=model, setting=replace(structure.setting, terms=terms))
