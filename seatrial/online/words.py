"""The lines that a person on board reads."""

from __future__ import annotations

import numpy as np

from identify.online.surprise import Surprise
from identify.online.suspects import Suspect, Suspicion
from validate.report.words import DEGREES, as_period, quantity

AXES = ("surge", "sway", "yaw")
UNITS = ("m/s²", "m/s²", "°/s²")
#: What a person would call it, by effect.
CALLED = {
    "current": "a current that has set in or turned",
    "wind": "wind that has risen or turned",
    "thrust_asymmetry": "a fouled, damaged or lost propeller",
    "mass_change": "a load taken aboard or put ashore",
    "shallow_water": "shallow water, or drag on the whole hull",
    "actuator_offset": "an actuator that has come off its zero",
    "actuator_delay": "an actuator that follows late",
    "actuator_rate_limit": "an actuator that has become slow",
    "actuator_deadband": "play in an actuator",
    "heading_bias": "a compass that has been turned",
    "gyro_bias": "a rate gyro that has drifted",
    "antenna_offset": "an antenna that has been moved",
    "clock_offset": "a sensor whose clock has been set",
    "port_starboard_asymmetry": "something that pulls to one side",
    "propeller_walk": "a propeller that pushes sideways",
    "quadratic_damping": "more drag",
    "turning_resistance": "more drag in turns",
}


def changed(s: Surprise, at: float) -> str:
    """That the model does not fit any more, and what the errors are like."""
    most = int(np.argmax(np.abs(s.acceleration) * np.array([1.0, 1.0, 5.0])))
    push = f"{s.acceleration[most] * (1.0, 1.0, DEGREES)[most]:+.3g} {UNITS[most]} in {AXES[most]}"
    return (
        f"the model has stopped fitting, since about t = {at:.0f} s: the errors of ten seconds are "
        f"{np.sqrt(s.size / s.freedom):.2f} times what they should be (as if by {push})"
    )


def looks_like(found: Suspicion) -> str:
    """What the change looks like, or that nothing known does."""
    if not found.named:
        return nothing_known(found)
    best, *others = found.named
    line = f"it looks like {said(best)}"
    if others:
        line += f"; or {', or '.join(said(o) for o in others[:3])}"
    return f"{line} (from {found.seconds:.0f} s; odds against chance {odds(best.p_value)})"


def nothing_known(found: Suspicion) -> str:
    """That no effect of the library explains it."""
    if not found.suspects:
        return "it looks like nothing known"
    best = found.suspects[0]
    why = (
        f"the nearest, {best.label}, leaves errors of {best.left:.1f} standard deviations"
        if best.left > 0
        else f"nothing stands out from chance; the nearest is {best.label}"
    )
    return f"it looks like nothing known (from {found.seconds:.0f} s; {why})"


def said(s: Suspect) -> str:
    """An effect as a person would call it, its name, and its numbers."""
    numbers = ", ".join(f"{p.name} {quantity(p, errors=False)}" for p in map(as_period, s.parameters))
    called = CALLED.get(s.active.effect.name)
    return f"{called} ({s.label}: {numbers})" if called else f"{s.label} ({numbers})"


def odds(p_value: float) -> str:
    """A small probability as odds."""
    return f"{1.0 / p_value:.3g} to 1" if p_value > 1e-12 else "beyond doubt"


def fits_again(at: float) -> str:
    """That the model fits as before."""
    return f"the model fits again, at t = {at:.0f} s; the estimate goes on from before the change"


def learning_anew() -> str:
    """That the change is taken for lasting."""
    return "the change has stayed: the model is learned anew from what came since"
