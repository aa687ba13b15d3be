"""From a solution to a Fit: named parameters with standard errors, and the equations as they were fitted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.averaged import words_of
from identify.drift import Drift
from identify.effect import Active
from identify.effects.actuators import ACTUATOR_OFFSET
from identify.fit import Estimated, Fit, FittedEffect
from identify.fitted import Fitted
from identify.kernel import HEADING
from identify.parameter_covariance import noise_and_misfit
from identify.physical import physical_notes
from identify.prepare import Prepared
from identify.same_columns import merged_into, merged_words, merging, same_columns
from identify.slot import Slot
from identify.structure import Structure
from identify.term import unit_of
from identify.wander import drifts_shown, wander_shown

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A coefficient whose standard error is more than this share of it is not identified.
LARGEST_ERROR = 0.5
#: ... and nothing is known of one whose standard error is more than so many times it: it is a number of chance.
UNTOLD = 1e3
#: Of a value that is known by its inverse, half the interval of that is counted as at most this share of it.
MOST_KNOWN = 0.9
#: What a wander is told for, s: size and time constant of a slow one are hardly known apart, but what it does is.
WITHIN = 30.0


def make_fit(prepared: Prepared, fitted: Fitted, *, estimator: str, optimiser: str, seed: int) -> Fit:
    """The data shape of a solution; the inputs' lead and other nuisances go into the notes."""
    structure, same = fitted.solution.structure, fitted.remembered(same_columns)
    merge = merging(same, len(fitted.solution.p))
    alone, misfit = noise_and_misfit(fitted)
    p, covariance = merge @ fitted.solution.p, misfit**2 * (merge @ alone @ merge.T)
    own = [k for k, s in enumerate(structure.slots) if s.effect < 0 and not s.nuisance]
    held = fitted.solution.held & (p == fitted.solution.p)
    told = {k: _coefficient(structure.slots[k], float(p[k]), covariance[k, k], bool(held[k])) for k in own}
    told |= {s.given_up: merged_into(s, told) for s in same}
    effects, jacobians = [], []
    for e in range(len(structure.actives)):
        made, jacobian = fitted_effect(structure, p, covariance, e)
        effects.append(made)
        jacobians.append(jacobian)
    rows = np.vstack([np.eye(len(p))[own], *jacobians])
    mean = () if fitted.mean is None else (words_of(fitted.mean),)
    notes = [
        *prepared.notes,
        *mean,
        *(merged_words(s, told) for s in same),
        *_lead_note(structure, p, covariance),
        *wander_words(wander_shown(fitted.problem)),
        *compass_words(drifts_shown(fitted.problem)),
    ]
    fit = Fit(
        structure.model.name, structure.vessel, structure.inputs, estimator, optimiser, seed, tuple(told.values()),
        tuple(effects), rows @ covariance @ rows.T, fitted.chi2_per_dof, fitted.solution.stopped.value,
        prepared.digest, tuple(notes), structure.u0_at(p), *_typical_and_largest(prepared), misfit,
    )  # fmt: skip
    return replace(fit, notes=(*fit.notes, *physical_notes(fit)))


def _typical_and_largest(prepared: Prepared) -> tuple[dict[str, float], dict[str, float]]:
    """Median of each input over the logs of the fit, and its largest value without sign."""
    values = {
        i.name: np.concatenate([s.inputs[i.name].value for s in prepared.identify])
        for i in prepared.structure.inputs
    }
    return {n: float(np.median(v)) for n, v in values.items()}, {
        n: float(np.abs(v).max()) for n, v in values.items()
    }


def _coefficient(slot: Slot, value: float, variance: float, at_bound: bool) -> Estimated:
    stderr = float(np.sqrt(max(variance, 0.0)))
    if slot.prior is not None:
        return _flow_parameter(slot, value, stderr, at_bound)
    text, dof = (slot.term.text, slot.term.dof) if slot.term else (slot.name, "")
    reason = _reason(value, stderr, at_bound)
    return Estimated(dof, slot.name, value, stderr, unit_of(text, dof), not reason, at_bound, reason, text)


def _flow_parameter(slot: Slot, value: float, stderr: float, at_bound: bool) -> Estimated:
    """A parameter that was known beforehand within limits: identified where the data narrow these down."""
    mean, sd = slot.prior or (0.0, np.inf)
    reason = "at a physical bound" if at_bound else ""
    if not reason and stderr > LARGEST_ERROR * sd:
        reason = f"the data say little beyond what was known beforehand ({mean:g} ± {sd:g})"
    return Estimated("", slot.name, value, stderr, slot.parameter.unit, not reason, at_bound, reason)


def _reason(value: float, stderr: float, at_bound: bool) -> str:
    if at_bound:
        return "at the bound that geometry sets"
    if stderr > LARGEST_ERROR * abs(value):
        if stderr > UNTOLD * abs(value):
            return "these logs say nothing about it"
        return f"the standard error is {100 * stderr / abs(value):.0f} % of the value"
    return ""


def fitted_effect(
    structure: Structure, p: FloatArray, covariance: FloatArray, index: int
) -> tuple[FittedEffect, FloatArray]:
    """One effect as reported, and the Jacobian (k, np) of what is reported with respect to all parameters."""
    active = structure.actives[index]
    mine = [k for k, s in enumerate(structure.slots) if s.effect == index]
    names, values, jacobian = _reported(active, structure, p, mine)
    values = _within_a_turn(active, structure, values)
    variance = jacobian @ covariance @ jacobian.T
    if active.effect.input_delay and structure.input_lead is not None and not structure.lead_is_free:
        variance = variance + structure.input_lead[1] ** 2 * np.eye(len(variance))
    wider = _by_inverse(active, names, values, variance)
    variance = variance * np.outer(wider, wider)
    units = _units(active, structure, mine)
    parameters = tuple(
        Estimated("", n, float(v), float(np.sqrt(max(variance[j, j], 0.0))), units.get(n, ""))
        for j, (n, v) in enumerate(zip(names, values, strict=True))
    )
    options = {k: list(v) if isinstance(v, tuple) else v for k, v in active.variant.options.items()}
    return FittedEffect(active.effect.name, active.variant.input, parameters, options), jacobian


def _within_a_turn(active: Active, structure: Structure, values: FloatArray) -> FloatArray:
    """Values (k,) of an effect, the offset of an azimuth no more than half a turn either way."""
    turned = [i for i in structure.inputs if i.name == active.variant.input and i.kind == "azimuth"]
    if active.effect is not ACTUATOR_OFFSET or not turned:
        return values
    return np.asarray(np.angle(np.exp(1j * values)), dtype=float)


def _by_inverse(active: Active, names: list[str], values: FloatArray, variance: FloatArray) -> FloatArray:
    """Factors (k,) on standard errors: where an inverse is known, 1.96 of them reach the far end of its interval.

    What goes with the inverse's square (an area of a wind whose push is known) reaches where that leads it.
    """
    wider, stderr = np.ones(len(names)), np.sqrt(np.maximum(np.diag(variance), 0.0))
    for k in (names.index(n) for n in active.effect.by_inverse):
        half, size = 1.96 * float(stderr[k]), abs(float(values[k]))
        share = half / size if half < MOST_KNOWN * size else MOST_KNOWN
        wider[k] = 1.0 / (1.0 - share)
        for j in (names.index(n) for n in active.effect.by_its_square):
            along = min(2.0 * share / 1.96 * abs(float(values[j])), float(stderr[j]))
            far = math.sqrt(stderr[j] ** 2 + along**2 * ((1.0 + 0.5 * share) ** 2 - 1.0))
            wider[j] = far / stderr[j] if stderr[j] > 0.0 else 1.0
    return wider


def _units(active: Active, structure: Structure, mine: list[int]) -> dict[str, str]:
    units = dict(active.effect.reported)
    for k in mine:
        slot = structure.slots[k]
        units.setdefault(
            slot.name, unit_of(slot.term.text, slot.term.dof) if slot.term else slot.parameter.unit
        )
    return units


def _reported(
    active: Active, structure: Structure, p: FloatArray, mine: list[int]
) -> tuple[list[str], FloatArray, FloatArray]:
    values = {structure.slots[k].name: float(p[k]) for k in mine}
    report = active.effect.report
    plain = [n for n in values if report is None or n not in {q.name for q in active.effect.parameters}]
    names = plain + (list(report(values)) if report else [])

    def at(v: dict[str, float]) -> FloatArray:
        return np.array([v[n] for n in plain] + (list(report(v).values()) if report else []))

    here = at(values)
    jacobian = np.zeros((len(names), len(p)))
    for k in mine:
        step = 1e-6 * max(1.0, structure.slots[k].parameter.scale)
        moved = at(values | {structure.slots[k].name: values[structure.slots[k].name] + step})
        change = moved - here
        jacobian[:, k] = np.where(np.abs(change) > np.pi, change - np.sign(change) * 2 * np.pi, change) / step
    return names, here, jacobian


def _lead_note(structure: Structure, p: FloatArray, covariance: FloatArray) -> list[str]:
    """What is to be said of the time between log and actuator: nothing where it is zero within its interval."""
    for k, slot in enumerate(structure.slots):
        if slot.name == "input_lead" and slot.effect < 0:
            error = math.sqrt(max(float(covariance[k, k]), 0.0))
            return lead_words(float(p[k]), error, 2 * slot.parameter.null)
    return []


def lead_words(lead: float, error: float, expected: float) -> list[str]:
    """How far the actuators are from the logged inputs, s, where that is more than their logging explains.

    ``expected`` : how far they may be ahead because the inputs are logged seldom; what lies between zero and this,
    within the 95 % interval, is not worth a word.
    """
    reach = 1.96 * error
    if lead < -reach:
        return [f"The actuators are {-lead:.3f} ± {error:.3f} s behind the logged inputs."]
    if lead > expected + reach:
        return [
            f"The actuators are {lead:.3f} ± {error:.3f} s ahead of the logged inputs; only up to {expected:.3f} s of "
            "that follows from how seldom the inputs are logged."
        ]
    return []


def wander_words(drift: Drift | None) -> list[str]:
    """How far positions wander that did so in the errors of the fit; nothing where they do not."""
    if drift is None:
        return []
    far = drift.size * math.sqrt(2.0 - 2.0 * math.exp(-WITHIN / drift.time))
    return [
        f"The errors of the positions wander, by about {far:.2g} m in {WITHIN:.0f} s: the model's own predictions show "
        "it where the motion alone did not. What else is missing is judged beside that."
    ]


def compass_words(drifts: Sequence[Drift]) -> list[str]:
    """What is said of headings whose slow errors a fit knows; nothing where there are none."""
    return [
        f"The errors of the headings are slow in part, by no more than those of any compass ({degrees:.1f}°): the fit "
        "knows of it."
        for degrees in (math.degrees(d.size) for d in drifts if d.kind == HEADING)
    ]


def equations(fitted: Fitted) -> tuple[str, ...]:
    """The fitted equations as text, one per degree of freedom."""
    structure, same = fitted.solution.structure, fitted.remembered(same_columns)
    p, gone = merging(same, len(fitted.solution.p)) @ fitted.solution.p, {s.given_up for s in same}
    lines = []
    for dof, left in (("u", "u̇"), ("v", "v̇"), ("r", "ṙ"), ("e1", "ė₁"), ("e2", "ė₂")):
        parts = [
            (p[k], s.term.text)
            for k, s in enumerate(structure.slots)
            if s.term is not None and s.term.dof == dof and k not in gone
        ]
        if parts:
            lines.append(f"{left} = " + _sum(parts))
    return tuple(lines)


def _sum(parts: list[tuple[float, str]]) -> str:
    signed = (f"{'−' if c < 0 else '+'} {abs(c):.4g}{'' if t == '1' else f' {t}'}" for c, t in parts)
    return " ".join(signed).removeprefix("+ ")
