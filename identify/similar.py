"""An identified model without dimension, and a ship of the same form at another size.

By Froude's law speeds grow with the root of the length, so that times do, too, and revolutions fall with it;
helm angles stay. What grows otherwise (friction) is not in a model that knows no viscosity: as with any prediction
from models.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.fit import Estimated, Fit, FittedEffect
from identify.nondimensional import from_prime, scale_factors, to_prime
from ingest.errors import UsageError
from preprocess.vessel import Input, Vessel

#: Powers of the length that particulars of propeller and rudder grow with; the others are numbers.
_GROWING = {"diameter": 1, "height": 1, "area": 2}


def prime_coefficients(fit: Fit, speed: float | None = None) -> tuple[Estimated, ...]:
    """The derivatives in the prime system (SNAME 1950), with their standard errors.

    Parameters
    ----------
    fit : Fit
    speed : float, optional
        Reference speed, m/s: by default that of the model, about which its logs were sailed. Lengths are measured in
        the vessel's own.

    Raises
    ------
    UsageError
        Where no speed is given and the model has none.
    """
    return to_prime(fit.coefficients, fit.vessel.length, reference_speed(fit, speed))


def reference_speed(fit: Fit, speed: float | None = None) -> float:
    """The speed asked for, or the model's own, m/s; UsageError without either."""
    if speed is not None and not speed > 0:
        raise UsageError(f"the speed to refer to must be positive, found {speed:g} m/s.")
    found = fit.u0 if speed is None else speed
    if not found or found <= 0:
        raise UsageError("the model says no speed to refer to: give one (--speed).")
    return float(found)


def similar(fit: Fit, length: float) -> Fit:
    """The same form at another length: equal prime coefficients at the same Froude number.

    Parameters
    ----------
    fit : Fit
    length : float
        Of the other ship, m.

    Returns
    -------
    Fit
        Coefficients, effects, covariance, particulars, inputs and speeds of the other ship.

    Raises
    ------
    UsageError
        The length is not positive, or something in the model cannot be scaled: it is named.
    """
    if not (math.isfinite(length) and length > 0):
        raise UsageError(f"a ship of {length:g} m is none: expected a length above 0.")
    in_newton = [i.name for i in fit.inputs if i.unit == "N"]
    if in_newton:
        raise UsageError(f"inputs in newtons cannot be scaled without a density: {', '.join(in_newton)}.")
    scale = length / fit.vessel.length
    units = [c.unit for c in fit.coefficients]
    effects = tuple(_effect(e, scale) for e in fit.effects)
    every = units + [p.unit for e in fit.effects for p in e.parameters]
    factor = scale_factors(every, 1.0, 1.0) / scale_factors(every, scale, math.sqrt(scale))
    return replace(
        fit,
        vessel=_vessel(fit.vessel, scale),
        inputs=tuple(_input(i, scale) for i in fit.inputs),
        coefficients=from_prime(to_prime(fit.coefficients, 1.0, 1.0), units, scale, math.sqrt(scale)),
        effects=effects,
        covariance=fit.covariance * np.outer(factor, factor),
        u0=None if fit.u0 is None else fit.u0 * math.sqrt(scale),
        typical_inputs=_inputs(fit, fit.typical_inputs, scale),
        largest_inputs=_inputs(fit, fit.largest_inputs, scale),
        speeds=fit.speeds and (fit.speeds[0] * math.sqrt(scale), fit.speeds[1] * math.sqrt(scale)),
    )


def _effect(effect: FittedEffect, scale: float) -> FittedEffect:
    units = [p.unit for p in effect.parameters]
    try:
        prime = to_prime(effect.parameters, 1.0, 1.0)
        return replace(effect, parameters=from_prime(prime, units, scale, math.sqrt(scale)))
    except ValueError as error:
        raise UsageError(f"the effect '{effect.name}' cannot be scaled: {error}.") from error


def _vessel(vessel: Vessel, scale: float) -> Vessel:
    def grown(value: float | None, power: int) -> float | None:
        return None if value is None else value * scale**power

    def parts(given: Mapping[str, float]) -> dict[str, float]:
        return {k: v * scale ** _GROWING.get(k, 0) for k, v in given.items()}

    added, centre = vessel.added_mass, vessel.centre_of_gravity
    return replace(
        vessel,
        length=vessel.length * scale,
        beam=vessel.beam * scale,
        draught=grown(vessel.draught, 1),
        mass=grown(vessel.mass, 3),
        yaw_inertia=grown(vessel.yaw_inertia, 5),
        centre_of_gravity=None if centre is None else _place(centre, scale),
        antenna=_place(vessel.antenna, scale),
        imu=_place(vessel.imu, scale),
        depth=grown(vessel.depth, 1),
        propeller=parts(vessel.propeller),
        rudder=parts(vessel.rudder),
        added_mass=None if added is None else (added[0] * scale**3, added[1] * scale**3, added[2] * scale**5),
    )


def _place(place: tuple[float, float], scale: float) -> tuple[float, float]:
    return place[0] * scale, place[1] * scale


def _input(one: Input, scale: float) -> Input:
    turning = one.kind == "propeller"
    value = tuple(v / math.sqrt(scale) for v in one.value) if turning else one.value
    return replace(one, position=_place(one.position, scale), value=value)


def _inputs(fit: Fit, values: Mapping[str, float], scale: float) -> dict[str, float]:
    """Values of inputs: revolutions fall with the root of the length, angles and shares stay."""
    turning = {i.name for i in fit.inputs if i.kind == "propeller"}
    return {k: v / math.sqrt(scale) if k in turning else v for k, v in values.items()}
