"""How far rounded inputs bend a path beyond what answers that go with them say."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identify import kernel

if TYPE_CHECKING:
    from identify.windows import Problem, Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def bent(problem: Problem) -> float:
    """How far rounded inputs bend a path beyond what answers that go with them say, in σ of a position.

    A course that is off by an angle ψ that grows moves the path aside by a in proportion, and back by ⅔ a² over its
    length: the second order, which no covariance counts. The median over the windows of the largest of each.
    """
    known = None if problem.unlogged is None else problem.unlogged.over(problem)
    if known is None or known.rounded is None:
        return 0.0
    return float(np.median([_bent(problem, known.rounded[w.stretch], w) for w in problem.windows]))


def _bent(problem: Problem, answers: FloatArray, window: Window) -> float:
    """The same of one window, whose stretch's samples show answers (m, 2, R) of one standard deviation."""
    stretch, mine = problem.stretches[window.stretch], problem.kinds(window) == kernel.POSITION
    path = stretch.states[window.first : window.first + window.steps + 1, :2]
    run = np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
    since = (stretch.samples.t[window.samples][mine] - stretch.start) / stretch.h - window.first
    aside = np.sum(answers[window.samples][mine] ** 2, axis=(1, 2))
    far = np.maximum(np.interp(since, np.arange(window.steps + 1), run), np.sqrt(aside) + 1e-9)
    off = aside / far / stretch.samples.sigma[window.samples][mine]
    return float(np.max(off, initial=0.0)) * 2.0 / 3.0
