"""The bias of an estimator that has one, as the term 1 in the equations of the model."""

from __future__ import annotations

from dataclasses import replace

from identify.estimators import ESTIMATORS
from identify.prepare import Prepared
from identify.structure import Structure
from identify.term import Term

_WORDS = {"u": "surge", "v": "sway", "r": "yaw"}


def has_own_bias(estimator: str) -> bool:
    """Whether an estimator of this name fits a bias whatever the model says."""
    return estimator in ESTIMATORS and ESTIMATORS[estimator].bias


def with_own_bias(prepared: Prepared, estimator: str) -> Prepared:
    """The same with the estimator's bias as the term 1 of every equation that has none, and a note that says so.

    An LSSVM's coefficients are found beside its bias, and predict nothing without it.
    """
    lacking = _without_a_constant(prepared.structure) if has_own_bias(estimator) else []
    if not lacking:
        return prepared
    setting = prepared.structure.setting
    ones = (Term(dof, "1", "bias") for dof in lacking)
    structure = replace(prepared.structure, setting=replace(setting, terms=(*setting.terms, *ones)))
    return replace(prepared, structure=structure, notes=(*prepared.notes, _said(estimator, lacking)))


def _without_a_constant(structure: Structure) -> list[str]:
    """Equations (u, v, r) that have terms, and not the term 1 among them."""
    terms = [(t.dof, t.text) for t in structure.terms]
    return [dof for dof in _WORDS if any(d == dof for d, _ in terms) and (dof, "1") not in terms]


def _said(estimator: str, lacking: list[str]) -> str:
    named = [_WORDS[dof] for dof in lacking]
    where = " and ".join([", ".join(named[:-1]), named[-1]] if named[1:] else named)
    return f"The estimator {estimator} has a bias: the term 1 was added to the model in {where}."
