"""Output error minimised by a population: what Zhao and Li 2021 do with an ant colony, with any optimiser.

The error is that of free-running u, v, r over windows, against the smoothed measurement, each channel in units of its
own spread. A whole generation is run by the compiled code at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify import kernel
from identify.base_fit import fit_states, window_length
from identify.drive import Drive, drive
from identify.fitted import Fitted
from identify.lanes import Compared, Driven, misfits_in_lanes
from identify.noise import calibrated
from identify.optimisers import OPTIMISERS, Minimum, StopReason, minimise
from identify.output_error import Stopped, prior_for
from identify.prepare import Prepared
from identify.regression import coefficient_scales, start_by_regression
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters
from identify.threads import abreast
from identify.true_motion import through_water
from identify.windows import Problem, Window, cut
from preprocess.cores import granted

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Evaluations of a search, per parameter and at most.
PER_PARAMETER, MOST = 500, 15_000
#: An error counts as at most this many spreads, so that a prediction that ran away can still be better or worse.
CAP = 10.0
#: Channels that are compared, by their place in the state.
_COMPARED = (("u", 3), ("v", 4), ("r", 5))


@dataclass(frozen=True)
class Course:
    """A window with what drives it: first state (8,), velocities to compare with (n + 1, 3), and their weight (3,)."""

    drive: Drive
    stretch: Stretch
    window: Window
    first: FloatArray
    measured: FloatArray
    weight: FloatArray


@dataclass(frozen=True)
class Objective:
    """Mean squared windowed error of a population of coefficients.

    Attributes
    ----------
    structure : Structure
    courses : tuple of Course
    places : (d,) int
        Coefficient that each unknown is.
    """

    structure: Structure
    courses: tuple[Course, ...]
    places: tuple[int, ...]
    workers: int = 2

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d)."""
        parts = abreast(lambda c: self._errors(c, candidates), self.courses, self.workers)
        rows = sum(c.window.steps + 1 for c in self.courses)
        return np.asarray(np.sum(parts, axis=0) / rows, dtype=float)

    def _errors(self, course: Course, candidates: FloatArray) -> FloatArray:
        compared = Compared(course.measured, course.weight, CAP)
        coefficients = self._coefficients(course, candidates)
        return misfits_in_lanes(
            self.structure.table.tape, _driven(self.structure, course), coefficients, compared
        )

    def _coefficients(self, course: Course, candidates: FloatArray) -> FloatArray:
        out = np.tile(course.drive.coefficients, (len(candidates), 1))
        places = list(self.places)
        out[:, places] = candidates * course.drive.factor[places]
        return out


def _driven(structure: Structure, course: Course) -> Driven:
    """What drives one window, for the compiled code."""
    d, w = course.drive, course.window
    part = slice(w.first, w.first + w.steps)
    return Driven(
        course.first, course.stretch.h, structure.model.discrete, d.channels[part], d.slopes[part], d.wind[part],
        d.current, d.u0,
    )  # fmt: skip


def objective_for(problem: Problem, structure: Structure, p: FloatArray) -> Objective:
    """The objective over the windows of a problem, effects held at the values in ``p``."""
    spread = np.vstack([s.states[:, 3:6] for s in problem.stretches]).std(axis=0) + 1e-9
    compared = np.array([name in structure.model.predicts for name, _ in _COMPARED], dtype=float)
    drives = [drive(structure, p, s) for s in problem.stretches]
    courses = tuple(_course(problem, w, drives[w.stretch], compared / spread) for w in problem.windows)
    places = tuple(s.coefficient for s in structure.slots if s.coefficient >= 0)
    return Objective(structure, courses, places, granted())


def _course(problem: Problem, w: Window, d: Drive, weight: FloatArray) -> Course:
    stretch = problem.stretches[w.stretch]
    states = through_water(stretch.states[w.first : w.first + w.steps + 1], d.current)
    first = np.zeros(kernel.NX)
    first[:6] = states[0]
    return Course(d, stretch, w, first, states[:, 3:6].copy(), weight)


def box_around(structure: Structure, p: FloatArray, stretches: Sequence[Stretch]) -> FloatArray:
    """Bounds (d, 2) of the search: the regression's coefficient, give or take itself and its natural size."""
    scales = coefficient_scales(structure, p, stretches)
    rows = []
    for k, slot in enumerate(structure.slots):
        if slot.coefficient >= 0:
            width = abs(float(p[k])) + min(float(scales[slot.coefficient]), 1e6)
            low, high = slot.parameter.bounds
            rows.append((max(p[k] - width, low), min(p[k] + width, high)))
    return np.array(rows, dtype=float)


def fit_by_optimiser(
    prepared: Prepared, optimiser: str, seed: int = 0, budget: int | None = None
) -> tuple[Fitted, Minimum]:
    """Coefficients that minimise the windowed free-running error, by any optimiser.

    Parameters
    ----------
    prepared : Prepared
    optimiser : str
        Of ``identify.optimisers.OPTIMISERS``.
    seed : int
    budget : int, optional
        Evaluations; by default 500 per parameter, at most 15,000.

    Returns
    -------
    fitted : Fitted
        With the windows' first states fitted and the noise calibrated, so that a covariance can be had.
    minimum : Minimum
        The search.
    """
    structure, stretches = prepared.structure, prepared.identify
    p = start_by_regression(structure, null_parameters(structure), stretches)
    problem = cut(stretches, window_length(structure.vessel.length))
    objective, box = objective_for(problem, structure, p), box_around(structure, p, stretches)
    found = minimise(
        OPTIMISERS[optimiser], objective, box, budget or min(PER_PARAMETER * len(box), MOST), seed
    )
    p = p.copy()
    p[structure.simple] = found.x
    return with_states(prepared, p, found.stopped), found


def with_states(prepared: Prepared, p: FloatArray, stopped: Stopped | StopReason) -> Fitted:
    """Given parameters as a fit, and why a search ``stopped``: first states fitted, noise calibrated, no more."""
    structure = prepared.structure
    problem = cut(prepared.identify, window_length(structure.vessel.length))
    problem = calibrated(problem, fit_states(problem, structure, p))
    prior = prior_for(structure, coefficient_scales(structure, p, prepared.identify))
    return Fitted(problem, prior, replace(fit_states(problem, structure, p), stopped=stopped))
