"""Units that hang on an input, in that input's own unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from identify.fit import Fit, FittedEffect
from preprocess.columns import input_unit
from validate.diagnosis import Diagnosis, Results

#: What the effects of an actuator are declared in.
PLACEHOLDER = "input's unit"


def with_input_units(results: Results) -> Results:
    """The same results; ``rad/s`` in place of ``input's unit/s`` where an effect belongs to a rudder."""
    units = {i.name: input_unit(i) for i in results.after.inputs}
    found = results.diagnosis
    after = _fit(results.after, units)
    return replace(results, after=after, diagnosis=_diagnosis(found, units) if found else None)


def _fit(fit: Fit, units: Mapping[str, str]) -> Fit:
    return replace(fit, effects=tuple(_effect(e, units) for e in fit.effects))


def _diagnosis(found: Diagnosis, units: Mapping[str, str]) -> Diagnosis:
    return replace(found, effects=tuple(replace(e, fitted=_effect(e.fitted, units)) for e in found.effects))


def _effect(effect: FittedEffect, units: Mapping[str, str]) -> FittedEffect:
    unit = units.get(effect.input or "")
    if unit is None:
        return effect
    return replace(
        effect, parameters=tuple(replace(p, unit=own_unit(p.unit, unit)) for p in effect.parameters)
    )


def own_unit(text: str, unit: str) -> str:
    """A declared unit with the input's in its place; ``1/s`` for one without dimension."""
    return text.replace(PLACEHOLDER, unit)
