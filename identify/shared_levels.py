"""What the rounding of an input's level moves the parameters by in all windows that it is held in together.

The windows' errors are made white each by itself. A level's error is the same in all of them, though, and in all logs
in which the level recurs, so that the scores of windows go together: their sum varies by (Σ s)(Σ s)ᵀ per level, of
which the windows by themselves count Σ s sᵀ. The estimate stays as it is, and its covariance has the rest.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from identify.output_error import Solution
from identify.rounded_inputs import Level, levels_in
from identify.unlogged import Unlogged
from identify.whitening import weighted
from identify.windows import Problem, tangents_of

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def shared_by_windows(problem: Problem, solution: Solution, through: FloatArray) -> FloatArray | None:
    """What (np, np) the scores of the parameters vary by beyond what windows by themselves say; None for nothing.

    ``through`` (w, 8 + np, np) is what of a window's scores goes through to the parameters.
    """
    if problem.unlogged is None or problem.unlogged.over(problem).rounded is None:
        return None
    rows = tangents_of(problem, solution.structure, solution.p, solution.first)
    scores: dict[Level, list[FloatArray]] = defaultdict(list)
    for number, names, answers in _answers(problem, problem.unlogged.over(problem)):
        moved = through[number].T @ np.einsum("mac,mak->ck", rows[number], answers)
        for name, score in zip(names, moved.T, strict=False):
            scores[name].append(score)
    return np.asarray(sum(_beyond(np.array(s)) for s in scores.values()), dtype=float)


def _beyond(scores: FloatArray) -> FloatArray:
    """What the sum of scores (w, np) of one level varies by beyond its parts (np, np)."""
    total = scores.sum(axis=0)
    return np.asarray(np.outer(total, total) - scores.T @ scores, dtype=float)


def _answers(problem: Problem, known: Unlogged) -> Iterator[tuple[int, list[Level], FloatArray]]:
    """Per window its number, levels and what its errors show of them (m, 2, R), times the inverse covariance."""
    assert known.rounded is not None and problem.whitening is not None
    for k, stretch in enumerate(problem.stretches):
        windows = [(number, w) for number, w in enumerate(problem.windows) if w.stretch == k]
        each = levels_in(known.structure, known.p, stretch, [(w.first, w.steps) for _, w in windows])
        for (number, w), found in zip(windows, each, strict=True):
            shown = weighted(problem, known.rounded, w)
            shown = problem.whitening.shrunk_columns(number, k, w.samples, shown)
            yield number, [name for name, _ in found], shown
