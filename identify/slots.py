"""Every place in a structure's vector of parameters: the model's own, each effect's, and when things were logged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from identify import flow
from identify.effect import Active, Parameter
from identify.slot import Slot, clocks, reference_speed
from identify.slowness import slower
from identify.term import Term, brakes
from preprocess.vessel import Vessel

if TYPE_CHECKING:
    from identify.structure import Structure


def slots_of(structure: Structure) -> tuple[Slot, ...]:
    """The layout of a structure's parameter vector."""
    own = structure.setting.terms
    brake = brakes(structure.terms) if structure.slows else frozenset()
    return (
        *(_of_coefficient(t.name, t, -1, k, brake) for k, t in enumerate(own)),
        *_of_flow(structure),
        *([reference_speed(structure.u0)] if structure.u0_is_free else []),
        *_of_effects(structure, len(own) + len(structure.model.fixed), brake),
        *_of_lead(structure),
        *clocks(structure.unsure),
    )


def _of_coefficient(name: str, term: Term, effect: int, at: int, brake: frozenset[Term]) -> Slot:
    """The place of a free coefficient, the ``at``-th of all; one that brakes has no sign but that."""
    limits = (0.0 if term.positive else -np.inf, 0.0 if term in brake else np.inf)
    return Slot(name, effect, Parameter(name, "", 1.0, limits), at, term)


def _of_effects(structure: Structure, first: int, brake: frozenset[Term]) -> Iterator[Slot]:
    """Per effect its free coefficients, then its parameters; ``first`` is the index of the first of the former."""
    k = first
    for e, (active, free) in enumerate(zip(structure.actives, structure.free_terms, strict=True)):
        yield from (_of_coefficient(n, t, e, k + j, brake) for j, (n, t) in enumerate(free))
        for p in active.effect.parameters:
            known = (p.null, p.known) if np.isfinite(p.known) else None
            yield Slot(p.name, e, _bounded(_scaled(p, active, structure), structure.vessel), prior=known)
        k += len(free)
        k += len(active.effect.fixed_terms(active.nulls)) if active.effect.fixed_terms else 0


def _scaled(parameter: Parameter, active: Active, structure: Structure) -> Parameter:
    """The parameter in the unit of the input that it acts on, no farther from its null than is believed of such."""
    on = next((i for i in structure.inputs if i.name == active.variant.input), None)
    if not parameter.relative or on is None:
        return parameter
    half, largest = structure.extents.get(on.name, (1.0, np.inf))
    far, (low, high) = parameter.believed.get(on.kind, np.inf) * largest, parameter.bounds
    least = low * half if low > 0.0 else low
    bounds = (max(least, parameter.null - far), min(high, parameter.null + far))
    starts = tuple(s * half for s in parameter.starts)
    return replace(parameter, scale=parameter.scale * half, starts=starts, bounds=bounds)


def _bounded(parameter: Parameter, vessel: Vessel) -> Parameter:
    """The parameter with the bounds that it has on a vessel; times begin as much longer as that is slower."""
    bounds = parameter.bounds if parameter.within is None else parameter.within(vessel)
    by = {"s": slower(vessel.length), "rad/s": 1.0 / slower(vessel.length)}.get(parameter.unit, 1.0)
    starts = tuple(float(np.clip(by * x, *bounds)) for x in parameter.starts)
    return replace(parameter, bounds=bounds, starts=starts)


def _of_flow(structure: Structure) -> Iterator[Slot]:
    """Parameters of the flow behind the hull, each with what is known of it beforehand."""
    if structure.model.flow:
        known = flow.known_beforehand(structure.vessel)
        for q in flow.PARAMETERS:
            own = Parameter(q.name, "1", q.sd, q.bounds, known[q.name])
            yield Slot(q.name, -1, own, prior=(known[q.name], q.sd))


def _of_lead(structure: Structure) -> Iterator[Slot]:
    """How far the actuators may be ahead of the logged inputs, where that can be told from the effects."""
    if structure.input_lead is not None and structure.lead_is_free:
        mean, sd = structure.input_lead
        limits = (mean - 2.2 * sd, mean + 2.2 * sd)
        yield Slot("input_lead", -1, Parameter("input_lead", "s", sd, limits, mean), prior=(mean, sd))
