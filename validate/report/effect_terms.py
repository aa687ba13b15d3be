"""What effects do to the equations: the terms that they add, and what they do beside them."""

from __future__ import annotations

from collections.abc import Iterator

from identify.effect import Effect, Setting, Variant
from identify.effects import EFFECTS
from identify.fit import Estimated, Fit, FittedEffect
from identify.term import Term, factors_of
from validate.report.words import effect_words


def declared(effect: FittedEffect) -> Effect | None:
    """The declaration of an effect: of several of one name, the one that has its parameters."""
    alike = [e for e in EFFECTS if e.name == effect.name]
    names = {p.name for p in effect.parameters}
    return max(alike, key=lambda e: len(names & {*e.reported, *(p.name for p in e.parameters)}), default=None)


def terms_of(fit: Fit, effect: FittedEffect) -> dict[str, Term]:
    """Terms that an effect adds to the equations, by the name of the parameter that is their coefficient."""
    of = declared(effect)
    if of is None or of.terms is None:
        return {}
    setting = Setting(fit.vessel, fit.inputs, tuple(map(_term, _of_model(fit))), ())
    found = of.terms(setting, Variant(effect.input, dict(effect.options)))
    return {p.name: found[p.name] for p in effect.parameters if p.name in found}


def _of_model(fit: Fit) -> list[Estimated]:
    return [p for p in fit.coefficients if p.dof and p.term]


def _term(p: Estimated) -> Term:
    """The term of a coefficient."""
    steers = any("δ" in f or f.endswith(":rudder") for f in factors_of(p.term))
    return Term(p.dof, p.term, "rudder" if steers else "hull")


def with_term(p: Estimated, terms: dict[str, Term]) -> tuple[str, str]:
    """Equation and term of a parameter, be it a coefficient or of an effect that adds ``terms``; empty without."""
    term = terms.get(p.name)
    return (term.dof, term.text) if term and not p.term else (p.dof, p.term)


def equations_and_terms(fit: Fit) -> list[tuple[str, str]]:
    """Equation and term of every parameter: coefficients, then those of the effects."""
    own = [(p.dof, p.term) for p in fit.coefficients]
    return own + [
        with_term(p, terms) for e in fit.effects for terms in [terms_of(fit, e)] for p in e.parameters
    ]


def texts(fit: Fit) -> list[str]:
    """All terms that stand in the equations of a fit, those among them whose coefficients an effect gives."""
    own = [term for _, term in equations_and_terms(fit) if term]
    return own + [t.text for e in fit.effects for t in _given(declared(e))]


def _given(effect: Effect | None) -> list[Term]:
    """Terms whose coefficients follow from the parameters of an effect."""
    if effect is None or effect.fixed_terms is None:
        return []
    return [term for term, _ in effect.fixed_terms({p.name: p.null for p in effect.parameters})]


def beside(fit: Fit) -> Iterator[tuple[str, str]]:
    """Effects that do more than add terms, with their numbers, and how they do it."""
    for e in fit.effects:
        of = declared(e)
        if of is not None and not (of.terms and not of.parameters):
            yield effect_words(e), of.equation
