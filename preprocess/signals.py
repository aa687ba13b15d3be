"""The closed vocabulary of signals: name, symbol, unit, frame and one sentence each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Signal:
    """One entry of the vocabulary; ``unit`` is SI, angles in radians."""

    name: str
    symbol: str
    unit: str
    frame: str
    sentence: str


VOCABULARY: tuple[Signal, ...] = (
    Signal("t", "t", "s", "log", "time since the log's first record"),
    Signal("x", "x", "m", "earth", "position north of the campaign's origin"),
    Signal("y", "y", "m", "earth", "position east of the campaign's origin"),
    Signal("psi", "ψ", "rad", "earth", "heading, clockwise from north, unwrapped"),
    Signal("u", "u", "m/s", "body", "surge velocity over ground, positive forward"),
    Signal("v", "v", "m/s", "body", "sway velocity over ground, positive to starboard"),
    Signal("r", "r", "rad/s", "body", "yaw rate, positive to starboard"),
    Signal("du", "u̇", "m/s²", "body", "rate of change of surge velocity"),
    Signal("dv", "v̇", "m/s²", "body", "rate of change of sway velocity"),
    Signal("dr", "ṙ", "rad/s²", "body", "yaw acceleration"),
    Signal("position", "(x, y)", "m", "earth", "measured antenna position, north and east"),
    Signal("heading", "ψ", "rad", "earth", "measured heading"),
    Signal("yaw_rate", "r", "rad/s", "body", "measured yaw rate"),
    Signal("velocity", "(Vn, Ve)", "m/s", "earth", "measured velocity over ground, north and east"),
    Signal("wind", "(wn, we)", "m/s", "earth", "velocity of the air over ground, north and east (blows to)"),
    Signal("depth", "h", "m", "earth", "depth of water below the surface"),
)

SIGNALS: dict[str, Signal] = {s.name: s for s in VOCABULARY}

#: Columns of ``Trial.states`` that the model predicts.
STATES = ("x", "y", "psi", "u", "v", "r")
#: Columns of ``Trial.states`` that hold accelerations.
ACCELERATIONS = ("du", "dv", "dr")
