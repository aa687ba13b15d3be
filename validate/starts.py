"""Where a candidate is begun: values of an effect whose cost has no slope at its null."""

from __future__ import annotations

import numpy as np

from identify.acting import lead_slot
from identify.effect import Active
from identify.fitted import Fitted
from identify.input_sizes import between, sizes_of
from identify.structure import Structure

#: What a fit believes to be hidden between an input's samples may be what that is late by: at these shares of their
#: distance.
OF_A_SAMPLE = (0.25, 0.5, 0.75, 1.0)


def starts_of(fitted: Fitted, active: Active) -> list[dict[str, float]]:
    """Values of the effect's parameters to begin with: each of its lists taken side by side, singles repeated."""
    wide = fitted.solution.structure.with_effect(active)
    mine = [s.parameter for s in wide.slots if s.effect == len(wide.actives) - 1 and s.coefficient < 0]
    lists = [p.starts or (p.null,) for p in mine]
    n = max(len(x) for x in lists)
    columns = [x if len(x) == n else x * n for x in lists]
    starts = [dict(zip([p.name for p in mine], row, strict=True)) for row in zip(*columns, strict=True)]
    if active.effect.stepwise and active.effect.stepwise(active.variant.options):
        sizes = sizes_of(fitted.problem.stretches, *active.variant.inputs)
        starts += [{mine[0].name: size} for size in between(sizes, mine[0].bounds[1])]
    return starts + as_far_ahead(fitted, wide) + within_samples(fitted, wide)


def as_far_ahead(fitted: Fitted, wide: Structure) -> list[dict[str, float]]:
    """Where inputs that may all be late are as far ahead of their logs as the fit found them, without saying so."""
    structure, late = fitted.solution.structure, wide.actives[-1].effect
    lead, known = lead_slot(structure), structure.input_lead
    if lead is None or known is None or lead_slot(wide) is not None or not late.input_delay:
        return []
    [own] = [s.parameter for s in wide.slots if s.effect == len(wide.actives) - 1]
    value = (known[0] - fitted.solution.p[lead]) / late.input_delay({own.name: 1.0})
    return [{own.name: float(np.clip(value, *own.bounds))}]


def within_samples(fitted: Fitted, wide: Structure) -> list[dict[str, float]]:
    """Where an input is late by less than the time between its samples, if the fit believes that these hide something.

    Whatever it does late is then hidden to the fit, which is at the noise without: no slope, and no start that is
    longer, shows that it is always as late.
    """
    effect, names = wide.actives[-1].effect, wide.actives[-1].variant.inputs
    own = [s.parameter for s in wide.slots if s.effect == len(wide.actives) - 1]
    known = fitted.problem.unlogged
    if known is None or not (known.share or known.phased) or not names or len(own) != 1 or own[0].unit != "s":
        return []
    apart = max(s.inputs[n].sample_time for s in fitted.problem.stretches for n in names)
    per = effect.input_delay({own[0].name: 1.0}) if effect.input_delay else 1.0
    return [{own[0].name: float(np.clip(x * apart / per, *own[0].bounds))} for x in OF_A_SAMPLE]
