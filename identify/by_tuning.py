"""Regression estimators with their hyper-parameters chosen by any optimiser, and the weak form."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from identify.by_optimiser import with_states
from identify.estimators import ESTIMATORS, Estimate, Estimator
from identify.estimators.tuning import Hyper, tune
from identify.fitted import Fitted
from identify.optimisers import OPTIMISERS
from identify.output_error import Stopped
from identify.own_bias import with_own_bias
from identify.prepare import Prepared
from identify.regression import regressors
from identify.slopes import accelerations, averaged, steps_of_slope
from identify.slot import Slot
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters
from preprocess.eso_motion import seen_like_velocity, seen_like_yaw_rate
from preprocess.weak_form import weak_form

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Evaluations of a search for hyper-parameters, each a whole cross-validation.
BUDGET = 40
#: Seconds on both sides of a held-out block that are not used for the fit either.
GAP = 2.0
#: Half the length of a test function of the weak form, in steps.
HALF_STEPS = 15
#: Time in which an observer settles, in units of one over its bandwidth.
SETTLED = 8.0
#: How an observer shows inputs, (n, nc).
Sight = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Rows:
    """A regression problem: ``design`` (n, terms), ``target`` (n, 3), ``groups`` (n,) the stretch of each row."""

    design: FloatArray
    target: FloatArray
    groups: np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def rows_of(structure: Structure, p: FloatArray, stretches: tuple[Stretch, ...], weak: bool = False) -> Rows:
    """The rows of the regression: at every step, or one per test function of the weak form.

    Where observers made the motion, everything else is seen through the same low-passes (``as_observed``).
    """
    both = [(_weak if weak else _strong)(structure, p, *as_observed(s)) for s in stretches]
    made = [(d[settled(s, len(d))], t[settled(s, len(t))]) for s, (d, t) in zip(stretches, both, strict=True)]
    sizes = [len(t) for _, t in made]
    return Rows(
        np.vstack([d for d, _ in made]),
        np.vstack([t for _, t in made]),
        np.repeat(np.arange(len(made)), sizes),
    )


def as_observed(stretch: Stretch) -> tuple[Stretch, Sight | None]:
    """A stretch whose velocities have passed the same low-passes, and those low-passes for its inputs (n, nc).

    An observer shows u and v through one low-pass, r through another, and inputs are logged as they are: a regression
    of one on the others is biased by what lies between them (Xie et al. 2020 filter the regressors for that). Each
    velocity is seen through the other's low-pass too, the inputs through both.
    """
    widths = stretch.observed
    if not widths:
        return stretch, None
    states, t = stretch.states.copy(), stretch.grid
    states[:, 3:5] = seen_like_yaw_rate(widths, t, states[:, 3:5])
    states[:, 5:] = seen_like_velocity(widths, t, states[:, 5:])
    middle = t[:-1] + 0.5 * stretch.h
    return replace(stretch, states=states), lambda inputs: seen_like_velocity(
        widths, middle, seen_like_yaw_rate(widths, middle, inputs)
    )


def settled(stretch: Stretch, rows: int) -> slice:
    """Rows of a stretch in which its observers have settled."""
    if not stretch.observed:
        return slice(None)
    share = SETTLED / (min(stretch.observed.values()) * stretch.h * stretch.steps)
    return slice(int(min(share, 0.5) * rows), None)


def _strong(
    structure: Structure, p: FloatArray, stretch: Stretch, sight: Sight | None = None
) -> tuple[FloatArray, FloatArray]:
    """Accelerations as slopes over some steps either way, and the regressors averaged with the same weights."""
    m = steps_of_slope(stretch)
    inside = slice(m, -m)
    return averaged(regressors(structure, p, stretch, sight), m)[inside], accelerations(stretch, m)[inside]


def _weak(
    structure: Structure, p: FloatArray, stretch: Stretch, sight: Sight | None = None
) -> tuple[FloatArray, FloatArray]:
    """Integrals against test functions: no acceleration is needed (Messenger and Bortz 2021)."""
    middle = stretch.grid[:-1] + 0.5 * stretch.h
    form = weak_form(middle, min(HALF_STEPS, (stretch.steps - 2) // 2) * stretch.h)
    velocities = 0.5 * (stretch.states[1:, 3:6] + stretch.states[:-1, 3:6])
    return form.values @ regressors(structure, p, stretch, sight), -(form.derivatives @ velocities)


def equations_of(structure: Structure) -> Iterator[tuple[int, list[int]]]:
    """Per equation that has any: its number and its slots."""
    for equation in range(3):
        mine = [
            k
            for k, s in enumerate(structure.slots)
            if s.coefficient >= 0 and structure.table.equation_of[s.coefficient] == equation
        ]
        if mine:
            yield equation, mine


def fit_by_tuning(prepared: Prepared, estimator: str, optimiser: str = "auto", seed: int = 0) -> Fitted:
    """Coefficients by a regression estimator, equation by equation.

    Where the estimator has a bias, that is the coefficient of the term 1, which the model then has in every equation.

    Parameters
    ----------
    prepared : Prepared
    estimator : str
        Of ``identify.estimators.ESTIMATORS``, or ``weak_form``.
    optimiser : str
        That which chooses the hyper-parameters by cross-validation; ``auto`` leaves them to the estimator.
    seed : int
    """
    prepared = with_own_bias(prepared, estimator)
    structure = prepared.structure
    p = null_parameters(structure)
    weak = estimator == "weak_form"
    chosen = ESTIMATORS["ls" if weak else estimator]
    rows = rows_of(structure, p, prepared.identify, weak)
    gap = round(GAP / (prepared.identify[0].h * (HALF_STEPS / 2 if weak else 1)))
    for equation, mine in equations_of(structure):
        bias = [k for k in mine if chosen.bias and _is_one(structure.slots[k])]
        others = [k for k in mine if k not in bias]
        design = rows.design[:, [structure.slots[k].coefficient for k in others]]
        found = _estimate(chosen, optimiser, (design, rows.target[:, equation], rows.groups), gap, seed)
        p[others], p[bias] = np.nan_to_num(found.theta), found.bias
    low, high = (np.array([s.parameter.bounds[k] for s in structure.slots]) for k in (0, 1))
    return with_states(prepared, np.clip(p, low, high), Stopped.SOLVED)


def _is_one(slot: Slot) -> bool:
    """Whether a coefficient is that of the term 1."""
    return slot.term is not None and slot.term.text == "1"


def _estimate(chosen: Estimator, optimiser: str, data: tuple[Any, Any, Any], gap: int, seed: int) -> Estimate:
    if optimiser == "auto" or not chosen.hyper:
        return chosen.fit(data[0], data[1], groups=data[2])
    space = [Hyper(name, low, high) for name, (low, high) in chosen.hyper.items()]
    return tune(
        chosen, OPTIMISERS[optimiser], lambda _: data, space, budget=BUDGET, seed=seed, gap=gap
    ).estimate
