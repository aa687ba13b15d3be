"""The third of the four data shapes: an identified model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@dataclass(frozen=True)
class Estimated:
    """One parameter with what is known of it.

    Attributes
    ----------
    dof : str
        Equation it belongs to: ``u``, ``v``, ``r``, or ``""`` for an effect's own parameters.
    name : str
        ``Y_uv`` for a coefficient (X in surge, Y in sway, N in yaw), the contract's name for an effect's parameter.
    value, stderr : float
        Estimate and standard error, in ``unit``.
    unit : str
        SI.
    identifiable : bool
        False where the data cannot give it; ``reason`` says why.
    at_bound : bool
        True where a physical bound was hit.
    term : str
        The regressor as a person writes it: ``|v|r``.
    """

    dof: str
    name: str
    value: float
    stderr: float
    unit: str
    identifiable: bool = True
    at_bound: bool = False
    reason: str = ""
    term: str = ""


@dataclass(frozen=True)
class FittedEffect:
    """An effect that was added to the declared model, with its parameters.

    ``options`` holds what is not a number: ``{"form": "play"}``, ``{"stream": "heading"}``, ``{"logs": [...]}``,
    ``{"swapped": ["left", "right"]}``, ``{"reversed": ["left"]}``.
    """

    name: str
    input: str | None
    parameters: tuple[Estimated, ...]
    options: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Fit:
    """An identified model: declared terms, effects added, and their joint covariance.

    Attributes
    ----------
    coefficients : tuple of Estimated
        The model's coefficients per unit inertia.
    effects : tuple of FittedEffect
        The effects added; empty for the declared model alone.
    covariance : (p, p)
        Of the coefficients followed by the effects' parameters, in that order; to first order, where a parameter's own
        ``stderr`` reaches the far end of an interval that has two unequal sides.
    chi2_per_dof : float
        Squared residuals over the sensors' own noise, per degree of freedom: 1 where the model lacks nothing.
    stopped : str
        Why the search stopped, as a sentence.
    digest : str
        SHA-256 of the trials that it was identified on.
    notes : tuple of str
        Sentences for the report (merged columns, bounds that were hit, what the data cannot give).
    u0 : float, optional
        Reference speed of terms in Δu, m/s.
    typical_inputs : mapping of str to float
        Median of every input over the logs that it was identified on: where a manoeuvre begins.
    largest_inputs : mapping of str to float
        Largest value of every input there, without sign: what is beyond is an extrapolation.
    speeds : tuple of two float, optional
        Least and greatest speed ahead there, over ground, m/s; likewise.
    misfit : float
        How much larger the standard errors are than the noise alone makes them, so that they account, to first order,
        for the errors of logs left out; 1 near the noise.
    """

    model: str
    vessel: Vessel
    inputs: tuple[Input, ...]
    estimator: str
    optimiser: str
    seed: int
    coefficients: tuple[Estimated, ...]
    effects: tuple[FittedEffect, ...]
    covariance: FloatArray
    chi2_per_dof: float
    stopped: str
    digest: str
    notes: tuple[str, ...] = ()
    u0: float | None = None
    typical_inputs: Mapping[str, float] = field(default_factory=dict)
    largest_inputs: Mapping[str, float] = field(default_factory=dict)
    misfit: float = 1.0
    speeds: tuple[float, float] | None = None
