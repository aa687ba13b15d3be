"""The model that another is with the terms that it was found to lack."""

from __future__ import annotations

from identify.models import MODELS, terms_for
from identify.structure import Structure
from identify.term import products_of


def richer_model(structure: Structure) -> str | None:
    """Name of the model that has the terms of a structure's model and of its effects, and no others; else None.

    A linear model that lacks nothing but quadratic damping is the one with moduli.
    """
    pairs = zip(structure.actives, structure.free_terms, strict=True)
    lacked = [t for active, free in pairs if not active.effect.parameters for _, t in free]
    if not lacked or structure.model.discrete or structure.model.flow:
        return None
    wanted = products_of([*structure.setting.terms, *lacked])
    alike = (m for m in MODELS if not m.discrete and not m.flow)
    names = (
        m.name for m in alike if products_of(terms_for(m, structure.vessel, structure.inputs)[0]) == wanted
    )
    return next(names, None)
