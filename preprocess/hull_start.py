"""Where the search for a hull begins: coefficients by regression of the smoothed motion, and priors of natural size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from preprocess.hull_data import forces, motion_at
from preprocess.hull_fit import Guess, Problem
from preprocess.hull_run import STATE, free_terms, terms_of
from preprocess.trial import FloatArray

#: Natural size of what one term does, as a multiple of the accelerations' rms; ridge of the first regression.
NATURAL, RIDGE = 3.0, (1e-4, 1e-2, 1.0)
#: Natural size of an antenna's place, as a share of speed over yaw rate, and of a compass's error, rad.
ELSEWHERE, ASKEW = 0.2, 0.1


def first_guess(
    problem: Problem, states: pd.DataFrame, offsets: tuple[float, float], current: FloatArray, ridge: float
) -> tuple[Guess, Problem]:
    """Coefficients by regression of the smoothed motion's changes; and the problem with the priors that belong to it.

    ``offsets`` are those of the inputs and of the position.
    """
    late, off = offsets
    terms, changes = [], []
    for w in problem.windows:
        motion = motion_at(states, w.edges, off, current, np.zeros(3))[:, 3:]
        terms.append(terms_of(0.5 * (motion[1:] + motion[:-1]), forces(problem.inputs, w.edges + late)[0]))
        changes.append(np.diff(motion, axis=0) / w.step)
    x, y = np.vstack(terms), np.vstack(changes)
    size, rms = (np.sqrt(np.mean(z**2, axis=0)) + 1e-12 for z in (x, y))
    equation, term = free_terms(len(problem.inputs))
    theta = np.zeros((3, x.shape[1]))
    for e in range(3):
        use = term[equation == e]
        a = x[:, use] / size[use]
        theta[e, use] = (
            np.linalg.solve(a.T @ a + ridge * len(a) * np.eye(len(use)), a.T @ y[:, e]) / size[use]
        )
    guess = Guess(theta, late, current, off, np.zeros(3), np.zeros(3), np.empty((0, STATE)))
    arm = ELSEWHERE * float(np.sqrt(np.mean(states["u"] ** 2) / max(np.mean(states["r"] ** 2), 1e-12)))
    mounting = 1.0 / np.array([arm + 1e-12, arm + 1e-12, ASKEW])
    problem = replace(problem, prior=size[term] / (NATURAL * rms[equation]), mounting=mounting)
    return begun_at(problem, guess, states), problem


def begun_at(problem: Problem, guess: Guess, states: pd.DataFrame) -> Guess:
    """The guess with the smoothed motion at the start of every window as the first states."""
    starts = np.array([w.start for w in problem.windows])
    return replace(guess, firsts=motion_at(states, starts, guess.off, guess.current, guess.mounting))
