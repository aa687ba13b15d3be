"""Where what stands in a structure's parameters and coefficients, worked out once for all that is evaluated with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from identify.effect import Loading
    from identify.structure import Structure

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


@dataclass(frozen=True)
class Layout:
    """Places of a structure's parameters and coefficients.

    ``named`` are, per active effect, its parameters' names and places. ``plain`` (ns,) is the coefficient that each
    simple parameter is; ``given`` (c,) coefficients that the model itself gives (0 elsewhere); per active effect
    ``free`` those of its own that are free, ``fixed`` the first of those that follow from its parameters;
    ``by_equation`` of u, v, r the places of the simple parameters in it, and of their coefficients. ``vessel``,
    ``inertial``, ``hull``, ``added`` (c,): terms in the vessel's own equations, and of these those of its mass, of its
    hull, and of what effects add.
    """

    named: tuple[tuple[tuple[str, int], ...], ...]
    plain: IntArray
    given: FloatArray
    free: tuple[slice, ...]
    fixed: tuple[int, ...]
    by_equation: tuple[tuple[IntArray, IntArray], ...]
    vessel: BoolArray
    inertial: BoolArray
    hull: BoolArray
    added: BoolArray

    def factors(self, by: Loading) -> FloatArray:
        """Factor (c,) that a loading puts on each coefficient."""
        out = np.where(self.inertial, by.inertial, np.where(self.vessel, by.others, 1.0))
        out[self.hull] *= by.hull
        if by.added is not None:
            out[self.added] = by.added
        return out


def layout_of(structure: Structure) -> Layout:
    """The layout of a structure."""
    terms, slots, effects = structure.table.terms, structure.slots, range(len(structure.actives))
    named = tuple(tuple((s.name, k) for k, s in enumerate(slots) if s.effect == e) for e in effects)
    own = len(structure.setting.terms)
    given, own_terms, fixed = np.zeros(len(terms)), [], []
    k = own + len(structure.model.fixed)
    given[own:k] = [value for *_, value in structure.model.fixed]
    for active, free in zip(structure.actives, structure.free_terms, strict=True):
        own_terms.append(slice(k, k + len(free)))
        fixed.append(k + len(free))
        k = fixed[-1] + (len(active.effect.fixed_terms(active.nulls)) if active.effect.fixed_terms else 0)
    vessel = np.array([t.dof not in ("e1", "e2") for t in terms], dtype=bool)
    role = np.array([t.role for t in terms])
    plain = np.array([slots[k].coefficient for k in structure.simple], dtype=np.int64)
    equation = structure.table.equation_of[plain]
    by_equation = tuple((structure.simple[equation == e], plain[equation == e]) for e in range(3))
    return Layout(
        named,
        plain,
        given,
        tuple(own_terms),
        tuple(fixed),
        by_equation,
        vessel,
        vessel & (role == "inertial"),
        vessel & (role == "hull"),
        vessel & (np.arange(len(terms)) >= own + len(structure.model.fixed)),
    )
