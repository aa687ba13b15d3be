"""The model that another is with the terms that it was found to lack."""

from __future__ import annotations

from identify.models import MODELS, Model, terms_for
from identify.structure import Structure
from identify.term import products_of


def richer_model(structure: Structure) -> str | None:
    """Name of the model that has the terms of a structure's model and of its effects, and no others; else None.

    A linear model that lacks nothing but quadratic damping is the one with moduli. The bias of an estimator is in
    either.
    """
    pairs = zip(structure.actives, structure.free_terms, strict=True)
    lacked = [t for active, free in pairs if not active.effect.parameters for _, t in free]
    if not lacked or structure.model.discrete or structure.model.flow:
        return None
    own, wanted = products_of(structure.setting.terms), products_of([*structure.setting.terms, *lacked])
    bias = own - _products(structure.model, structure)
    alike = (m for m in MODELS if not m.discrete and not m.flow)
    return next((m.name for m in alike if _products(m, structure) | bias == wanted), None)


def _products(model: Model, structure: Structure) -> set[tuple[str, tuple[str, ...]]]:
    """The terms of a model for the vessel of a structure, as products of their factors."""
    return products_of(terms_for(model, structure.vessel, structure.inputs)[0])
