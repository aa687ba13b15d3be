"""Where actuators are as logs begin that a fit has not seen: in their slack, or on their way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identify.base_fit import window_length
from identify.fitted import Fitted
from identify.stretch import Stretch
from identify.windows import Problem, cut
from validate.begins import slack_begun
from validate.on_its_way import begun_where_it_was


def begun_in(fitted: Fitted, others: Sequence[Stretch]) -> Fitted:
    """The same fit, its actuators begun in logs that it has not seen where their first seconds say.

    As first states do, it comes of what a prediction begins with: of a window's length, and of nothing after it.
    """
    solution, seen = fitted.solution, {s.name for s in fitted.problem.stretches}
    unseen = [s for s in others if s.name not in seen]
    if not unseen or not any(a.is_slack or a.effect.on_its_way for a in solution.structure.actives):
        return fitted
    length = window_length(solution.structure.vessel.length)
    problem = _first_windows(cut(unseen, length).weighted_as(fitted.problem))
    structure = begun_where_it_was(problem, slack_begun(problem, solution.structure, solution.p), solution.p)
    return replace(fitted, solution=replace(solution, structure=structure))


def _first_windows(problem: Problem) -> Problem:
    """Of each log the first window alone."""
    first = {problem.stretches[w.stretch].name: w for w in reversed(problem.windows)}
    return replace(problem, windows=tuple(w for w in problem.windows if w in first.values()))
