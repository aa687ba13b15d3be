"""In which of its own logs a fit's effect on some logs is: any of them may have been loaded, or over a shoal."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from identify.effect import Active
from identify.effects.water_and_air import SHALLOW_WATER
from identify.fitted import FAR, Fitted
from identify.in_common import in_common
from identify.structure import Structure
from preprocess.cores import side_by_side
from validate.refits import under, went_on
from validate.search_ends import total

#: Steps of every choice of logs, then of the nearest few.
BRIEFLY, NEAREST, TO_THE_END = 4, 2, 16
#: So many times more a fit is gone on with before its logs are looked at.
PATIENCE = 6
#: Far from the noise a log is let in or out only for this share of the cost.
WORTH_A_LOG = 0.03


def in_likeliest_logs(fitted: Fitted, clearly: float) -> Fitted:
    """The fit with its last effect in those of its logs in which the measurements clearly want it.

    Candidates are the later logs, or one alone; from the best of these one log after the other is let in, or out, as
    long as that lowers the cost by more than ``clearly``, far from the noise by a share of it. Effects that are in all
    logs, or where declared depths tell, stay as they are.
    """
    structure = fitted.solution.structure
    if not structure.actives or not free_in_logs(structure.actives[-1], structure):
        return fitted
    names = sorted({s.name for s in fitted.problem.stretches})
    while True:
        fitted = _at_rest(fitted, clearly)
        here = set(logs_of(fitted.solution.structure.actives[-1]))
        groups = [here ^ {name} for name in names]
        some = [logs for logs in groups if 0 < len(logs & set(names)) < len(names)]
        shared = in_common(fitted)
        others = side_by_side(partial(_refitted, fitted), some, shared=shared)
        nearest = sorted(others, key=lambda f: total(f.solution))[:NEAREST]
        target = fitted.solution.total - _least(fitted, clearly)
        on = side_by_side(partial(_taken_on, target), nearest, shared=shared)
        best = min(on, key=lambda f: total(f.solution), default=fitted)
        if not best.solution.total < target:
            return fitted
        fitted = best


def _at_rest(fitted: Fitted, clearly: float) -> Fitted:
    """A fit that gains nothing more by itself: what it would is no log's."""
    for _ in range(PATIENCE):
        on = went_on(fitted, TO_THE_END)
        if on is fitted or not on.solution.total < fitted.solution.total - _least(fitted, clearly):
            return on
        fitted = on
    return fitted


def _refitted(fitted: Fitted, logs: set[str]) -> Fitted:
    return under(fitted.problem, in_logs(fitted, -1, logs), BRIEFLY)


def _taken_on(target: float, fitted: Fitted) -> Fitted:
    return went_on(fitted, TO_THE_END, target)


def _least(fitted: Fitted, clearly: float) -> float:
    """What another choice of logs must gain."""
    return clearly if fitted.chi2_per_dof < FAR else max(clearly, WORTH_A_LOG * fitted.solution.cost)


def free_in_logs(active: Active, structure: Structure) -> bool:
    """Whether an effect is in some logs, and nothing that was declared says in which."""
    if not isinstance(active.variant.options.get("logs"), tuple):
        return False
    return active.effect is not SHALLOW_WATER or not structure.setting.depths_tell


def in_logs(fitted: Fitted, index: int, logs: set[str]) -> Fitted:
    """The same values with an effect in other logs."""
    solution = fitted.solution
    actives = list(solution.structure.actives)
    variant = actives[index].variant
    named = tuple(n for n in solution.structure.setting.logs if n in logs)
    actives[index] = replace(
        actives[index], variant=replace(variant, options={**variant.options, "logs": named})
    )
    structure = replace(solution.structure, actives=tuple(actives))
    return replace(fitted, solution=replace(solution, structure=structure))


def logs_of(active: Active) -> tuple[str, ...]:
    """The logs that an effect is in; none of one that is in all."""
    logs = active.variant.options.get("logs")
    return logs if isinstance(logs, tuple) else ()
