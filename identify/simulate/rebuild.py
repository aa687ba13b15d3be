"""From a Fit, as model.json holds it, back to the structure and the parameter vector that the kernel runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.effect import Active, Effect, Setting, Variant
from identify.effects import EFFECTS
from identify.fit import Estimated, Fit, FittedEffect
from identify.models import MODEL_BY_NAME, model_for, terms_for
from identify.slot import U0
from identify.structure import Structure
from identify.term import Term, factors_of
from ingest.errors import UsageError, nearest

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Streams that a sensor effect may speak of; a simulation has no sensors, so all count as there.
_STREAMS = ("position", "heading", "yaw_rate", "velocity")


@dataclass(frozen=True)
class Rebuilt:
    """A structure with its parameters.

    Attributes
    ----------
    structure : Structure
        The model's terms as they were fitted, and the effects that were taken.
    p : (np,)
        Parameters in the order of the structure's slots, in the coordinates that are searched.
    covariance : (np, np)
        Of ``p``.
    """

    structure: Structure
    p: FloatArray
    covariance: FloatArray

    def keeping(self, wanted: Callable[[Active], bool]) -> Rebuilt:
        """The same with only those effects that are wanted."""
        keep = [e for e, active in enumerate(self.structure.actives) if wanted(active)]
        slots = [k for k, s in enumerate(self.structure.slots) if s.effect < 0 or s.effect in keep]
        fewer = replace(self.structure, actives=tuple(self.structure.actives[e] for e in keep))
        return Rebuilt(fewer, self.p[slots], self.covariance[np.ix_(slots, slots)])


def rebuild(fit: Fit) -> Rebuilt:
    """Rebuild structure and parameters of an identified model.

    Raises
    ------
    UsageError
        The model or an effect is not known, or a reference speed that its terms need is missing.
    """
    structure = _structure(fit)
    k = len(fit.coefficients)
    p: list[FloatArray] = [np.array([c.value for c in fit.coefficients])]
    jacobian: list[FloatArray] = [np.eye(k)]
    for effect, active in zip(fit.effects, structure.actives, strict=True):
        turn = partial(Searched(active, structure).values, tuple(e.name for e in effect.parameters))
        reported = np.array([e.value for e in effect.parameters])
        p.append(turn(reported))
        jacobian.append(_slopes(turn, reported))
    block = _block_diagonal(jacobian)
    return Rebuilt(structure, np.concatenate(p), block @ np.nan_to_num(fit.covariance) @ block.T)


def _structure(fit: Fit) -> Structure:
    if fit.model not in MODEL_BY_NAME:
        raise UsageError(f"the model '{fit.model}' is not known here; there are {', '.join(MODEL_BY_NAME)}.")
    model = model_for(fit.model, fit.vessel, fit.inputs)
    declared = {(t.dof, t.text): t for t in terms_for(model, fit.vessel, fit.inputs)[0]}
    by_name = {t.name: t for t in declared.values()}
    terms = tuple(_term(c, declared, by_name) for c in fit.coefficients if c.dof)
    if any("Δu" in factors_of(t.text) for t in terms) and fit.u0 is None:
        raise UsageError(
            f"the model '{fit.model}' has terms in Δu, and its file does not say about which speed."
        )
    setting = Setting(fit.vessel, fit.inputs, terms, _logs(fit.effects), streams=_STREAMS)
    actives = tuple(_active(e, setting) for e in fit.effects)
    found = any(c.name == U0 and not c.dof for c in fit.coefficients)
    return Structure(model, fit.vessel, fit.inputs, setting, fit.u0 or 0.0, actives, u0_found=found)


def _term(c: Estimated, declared: Mapping[tuple[str, str], Term], by_name: Mapping[str, Term]) -> Term:
    """The term of a coefficient: as declared, or one that an estimator added."""
    if not c.term and c.name in by_name:
        return by_name[c.name]
    return declared.get((c.dof, c.term)) or Term(c.dof, c.term, "bias" if c.term == "1" else "hull")


def _logs(effects: tuple[FittedEffect, ...]) -> tuple[str, ...]:
    names = [n for e in effects for n in _as_tuple(e.options.get("logs", ()))]
    return tuple(dict.fromkeys(map(str, names)))


def _as_tuple(value: object) -> tuple[object, ...]:
    return tuple(value) if isinstance(value, list | tuple) else (value,)


def _inputs_of(effect: Effect, setting: Setting) -> set[str | None]:
    """The inputs that an effect could be on."""
    return {v.input for v in effect.variants(setting)}


def _active(fitted: FittedEffect, setting: Setting) -> Active:
    """The declared effect, in the variant that was fitted."""
    options = {k: tuple(v) if isinstance(v, list) else v for k, v in fitted.options.items()}
    variant = Variant(fitted.input, options)
    named = {p.name for p in fitted.parameters}
    same = [e for e in EFFECTS if e.name == fitted.name]
    for effect in same:
        acts_on_inputs = options.get("stream") == "inputs"
        wrong_clock = effect.place == "clock" and bool(effect.input_delay) != acts_on_inputs
        among_others = effect.place == "propulsion" and fitted.input not in _inputs_of(effect, setting)
        if named <= reported_names(effect, setting, variant) and not wrong_clock and not among_others:
            return Active(effect, variant)
    if same:
        raise UsageError(f"the effect '{fitted.name}' has parameters that are not known: {sorted(named)}.")
    near = nearest(fitted.name, [e.name for e in EFFECTS])
    raise UsageError(f"the effect '{fitted.name}' is not known.{f' Did you mean {near[0]}?' if near else ''}")


def reported_names(effect: Effect, setting: Setting, variant: Variant) -> set[str]:
    """Names of an effect's parameters as a report has them."""
    free = set(effect.terms(setting, variant)) if effect.terms else set()
    return free | set(effect.reported or {p.name: "" for p in effect.parameters})


class Searched:
    """The parameters of one active effect, from those reported to those searched, in the order of its slots."""

    def __init__(self, active: Active, structure: Structure) -> None:
        self.effect = active.effect
        free = [name for name, _ in structure.free_terms[structure.actives.index(active)]]
        self.absent = dict.fromkeys(free, 0.0) | {q.name: q.null for q in active.effect.parameters}

    def values(self, names: tuple[str, ...], reported: FloatArray) -> FloatArray:
        """Searched values (k,) from the reported ones (k,)."""
        known = dict(zip(names, map(float, reported), strict=True))
        own = known if self.effect.report is None else known | self._turned_back(known)
        return np.array([own.get(n, absent) for n, absent in self.absent.items()])

    def _turned_back(self, known: Mapping[str, float]) -> dict[str, float]:
        """North and east from speed and direction, whichever way the direction is meant."""
        first, second = (q.name for q in self.effect.parameters)
        speed, angle = known["speed"], known["direction"]
        for sign in (1.0, -1.0):
            found = {first: sign * speed * math.cos(angle), second: sign * speed * math.sin(angle)}
            said = self.effect.report(found)["direction"] if self.effect.report else angle
            if abs(math.remainder(said - angle, 2 * math.pi)) < 1e-6:
                return found
        return {first: 0.0, second: 0.0}


def _slopes(function: Callable[[FloatArray], FloatArray], x: FloatArray) -> FloatArray:
    """Jacobian (k, k) by central differences."""
    columns = []
    for j in range(len(x)):
        step = np.zeros(len(x))
        step[j] = 1e-5 * max(abs(float(x[j])), 1e-3)
        columns.append((function(x + step) - function(x - step)) / (2 * step[j]))
    return np.column_stack(columns) if columns else np.zeros((0, 0))


def _block_diagonal(blocks: list[FloatArray]) -> FloatArray:
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*blocks), dtype=float)
