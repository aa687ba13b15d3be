"""In which logs an effect on some of them is, to first order: of all ways to choose them the one that promises most.

What an effect does in several logs is the sum of what it does in each. The normal equations of it in every single log
therefore tell what any choice of them would gain; a load that was aboard in three runs of six is seen in all three at
once, where each alone may show less than some other cause does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from identify.effect import Active
from identify.fitted import Fitted
from identify.structure import Structure
from validate.candidates import extended, normal, plainly_read, readings, reduced_to
from validate.first_order import FirstOrder
from validate.log_groups import free_in_logs

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

#: With fewer logs every choice is one log, or all but one, which is the same.
FEWEST = 3
#: Of many logs the choice grows from the best of so many single ones.
BEGINNINGS = 3
#: Less information than this is none that was rounded.
TINY = 1e-100
#: Of up to so many logs every choice is looked at, and counts as one that was tried; of more no more than that.
MOST_COUNTED = 10


@dataclass(frozen=True)
class InEach:
    """Normal equations of an effect in each of ``k`` logs, all else free to follow.

    ``matrix`` (k, q, k, q) and ``score`` (k, q) of its q parameters in every log; ``up`` and ``down`` (q,): whether
    each may grow, and fall, from where it does nothing.
    """

    matrix: FloatArray
    score: FloatArray
    up: BoolArray
    down: BoolArray

    def gain(self, some: BoolArray) -> float:
        """What the effect gains in some logs (k,) at once, in 2 log likelihood; nothing in none, or in all."""
        if some.all() or not some.any():
            return 0.0
        matrix, score = self.matrix[some][:, :, some].sum(axis=(0, 2)), self.score[some].sum(axis=0)
        told = np.diag(matrix)  # rounding may leave less than none
        size = np.where(told > 0.0, 1.0 / np.sqrt(np.maximum(told, TINY)), 0.0)
        scaled = FirstOrder(matrix * size * size[:, None], score * size, self.up, self.down, 0.0)
        return scaled.gain(np.arange(len(size)))

    def likeliest(self) -> BoolArray:
        """The logs (k,) in which it gains most; of many, one after the other let in or out from the best single ones.

        Of what may as well be less in all the others it is the group without the first log.
        """
        each = np.eye(len(self.score), dtype=bool)
        if len(each) <= MOST_COUNTED:
            choices = [np.array(c, dtype=bool) for c in product((False, True), repeat=len(each))]
        else:
            choices = [self._grown(one) for one in sorted(each, key=self.gain, reverse=True)[:BEGINNINGS]]
        found = max(choices, key=self.gain)
        either = bool(self.up.all() and self.down.all())
        return ~found if either and found[0] else found

    def _grown(self, some: BoolArray) -> BoolArray:
        while True:
            other = max((some ^ one for one in np.eye(len(some), dtype=bool)), key=self.gain)
            if not self.gain(other) > self.gain(some):
                return some
            some = other


def in_likeliest_sets(fitted: Fitted, actives: Sequence[Active]) -> list[Active]:
    """Each effect of some logs in those that promise most in one of its forms; none that is a candidate already."""
    some = _one_of_each(actives, fitted.solution.structure)
    names = logs_in(fitted) if some else []
    if len(names) < FEWEST:
        return []
    known, found = {a.label for a in actives}, dict[str, Active]()
    for form in [r for a in some for r in readings(a)]:
        each = _in_each(fitted, [_in(form, (name,)) for name in names])
        if each is not None:
            logs = tuple(n for n, there in zip(names, each.likeliest(), strict=True) if there)
            chosen = plainly_read(_in(form, logs))
            found[chosen.label] = chosen
    return [a for label, a in found.items() if label not in known]


def ways(fitted: Fitted, actives: Sequence[Active]) -> int:
    """How many choices of logs are looked at besides those that are candidates themselves."""
    some = _one_of_each(actives, fitted.solution.structure)
    k = min(len(logs_in(fitted)), MOST_COUNTED) if some else 1
    return max(0, (1 << (k - 1)) - k) * len(some)


def logs_in(fitted: Fitted) -> list[str]:
    """The logs of a fit, in the campaign's order."""
    there = {s.name for s in fitted.problem.stretches}
    return [n for n in fitted.solution.structure.setting.logs if n in there]


def _one_of_each(actives: Sequence[Active], structure: Structure) -> list[Active]:
    """One candidate of every effect whose logs nothing declares."""
    return list({a.effect.name: a for a in actives if free_in_logs(a, structure)}.values())


def _in(active: Active, logs: tuple[str, ...]) -> Active:
    return replace(active, variant=replace(active.variant, options={**active.variant.options, "logs": logs}))


def _in_each(fitted: Fitted, singles: Sequence[Active]) -> InEach | None:
    """The normal equations of an effect in single logs; None where they overflow on the fit's own path."""
    structure, p = fitted.solution.structure, fitted.solution.p
    wide, start, places = extended(structure, p, singles)
    information, score, _ = normal(fitted, wide, start)
    mine = np.concatenate(places)
    if len({len(x) for x in places}) > 1 or not np.isfinite(information).all():
        return None
    matrix, rest, _ = reduced_to(information, score, np.arange(len(p)), mine)
    size, shape = np.sqrt(np.diag(information)[mine]), (len(places), len(places[0]))
    low, high = (np.array([wide.slots[k].parameter.bounds[j] for k in places[0]]) for j in (0, 1))
    at = start[places[0]]
    return InEach(
        (matrix * size * size[:, None]).reshape(*shape, *shape),
        (rest * size).reshape(shape),
        at < high,
        at > low,
    )
