"""The shape of report.json and model.json; the JSON schemas are made from these models."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from preprocess.vessel import Input, Vessel

REPORT: Literal["seatrial.report/1"] = "seatrial.report/1"
MODEL: Literal["seatrial.model/1"] = "seatrial.model/1"


def finite_or_none(value: object) -> object:
    """NaN and infinity become None: JSON has neither."""
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plain(value: object) -> Any:
    """The same value made of what JSON knows: numpy, tuples and mappings unpacked, NaN as None."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [plain(v) for v in value]
    value = finite_or_none(value)
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)


Number = Annotated[float | None, BeforeValidator(finite_or_none)]
PlainMapping = Annotated[dict[str, Any], BeforeValidator(plain)]


class Entry(BaseModel):
    """Base of all entries: fixed keys, nothing changed in place."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class SignalEntry(Entry):
    """One signal of a log, as it was used."""

    name: str = Field(description="quantity or input, in Seatrial's vocabulary")
    source: str = Field(description="the signal in the log, as `seatrial inspect` prints it")
    rate_hz: Number = Field(description="median rate of the samples, Hz")
    gaps: int = Field(description="intervals longer than 3.5 sample times (of a sensor)")
    outliers: int = Field(description="samples set aside before smoothing")


class LogEntry(Entry):
    """One log: what was read and what was wrong with it."""

    path: str
    role: Literal["identify", "validate", "both"] = Field(
        description="`both` where the last third of each log validates"
    )
    format: str
    duration_s: Number
    messages: int
    bytes_read: int
    bytes_damaged: int
    signals: list[SignalEntry]


class ParameterEntry(Entry):
    """One coefficient of the model, SI units, per unit inertia."""

    dof: str
    name: str
    value: Number
    stderr: Number
    unit: str
    identifiable: bool


class ScoreEntry(Entry):
    """Free-running prediction of one channel; null where the model does not predict it."""

    mse: Number
    rmse: Number
    r2: Number
    nrmse: Number


class LogScoreEntry(Entry):
    """Scores of one log, or of its part with that role."""

    path: str
    role: Literal["identify", "validate"]
    channels: dict[str, ScoreEntry]


class ValidationEntry(Entry):
    """Scores over the logs with role validate, pooled, and of every log."""

    channels: dict[str, ScoreEntry]
    fitness: Number
    position_rmse: Number
    heading_rmse: Number
    logs: list[LogScoreEntry]


class ValidationPair(Entry):
    """The declared model alone, and with the effects taken."""

    before: ValidationEntry
    after: ValidationEntry


class EffectParameterEntry(Entry):
    """One parameter of an effect, SI units."""

    name: str
    value: Number
    stderr: Number
    unit: str


class EffectEntry(BaseModel):
    """An effect that was taken; what is not a number (form, swapped, stream, …) stands beside it."""

    model_config = ConfigDict(extra="allow", frozen=True)

    name: str
    input: str | None
    p_value: Number
    look_alikes: list[str]
    parameters: list[EffectParameterEntry]


class ResidualTestEntry(Entry):
    """One test of one channel's residuals."""

    name: str
    channel: str
    statistic: Number
    p_value: Number


class CandidateEntry(Entry):
    """An effect that was tried in a round; of one that was not refitted what a refit would say is null."""

    effect: str
    input: str | None
    evidence: Number = Field(description="of a refit; null where there was none")
    p_value: Number = Field(description="of a refit; null where there was none")
    rmse_before: dict[str, Number] = Field(description="cross-validated; null where the prediction ran away")
    rmse_after: dict[str, Number] = Field(
        description="cross-validated; null where the prediction ran away, or there was no refit"
    )
    label: str = Field(description="effect with its input, form, stream or logs")
    note: str = Field(
        description="why it was not refitted, that predictions ran away, and the like; else empty"
    )
    promise: Number = Field(
        description="what a first look promised in the place of the evidence; null where it is not known"
    )


class RoundEntry(Entry):
    """One turn of the loop."""

    residual_tests: list[ResidualTestEntry]
    candidates: list[CandidateEntry]
    accepted: str | None
    stands: bool | None = Field(
        description="whether what was accepted is among the effects; null where nothing was"
    )
    note: str = Field(
        description="what became of what was accepted, where it does not stand as it was; else empty"
    )


class DiagnosisEntry(Entry):
    """What the declared model lacks."""

    verdict: Literal["adequate", "explained", "ambiguous", "unexplained"]
    effects: list[EffectEntry]
    rounds: list[RoundEntry]
    unexplained: dict[str, Number]
    advice: str


class Report(Entry):
    """report.json."""

    schema_: Literal["seatrial.report/1"] = Field(alias="schema")
    seatrial_version: str
    campaign: str
    vessel: str
    model: str
    estimator: str
    optimiser: str
    seed: int
    logs: list[LogEntry]
    parameters: list[ParameterEntry]
    validation: ValidationPair
    diagnosis: DiagnosisEntry | None
    timing_s: dict[str, Number]


class ModelParameterEntry(ParameterEntry):
    """One parameter with all that is known of it."""

    at_bound: bool = False
    reason: str = ""
    term: str = ""


class ModelEffectEntry(Entry):
    """An effect that belongs to the model."""

    name: str
    input: str | None
    parameters: list[ModelParameterEntry]
    options: PlainMapping = {}


class ModelFile(Entry):
    """model.json; ``covariance`` is of the parameters followed by those of the effects, in that order."""

    schema_: Literal["seatrial.model/1"] = Field(alias="schema")
    model: str
    vessel: Vessel
    inputs: list[Input]
    parameters: list[ModelParameterEntry]
    covariance: list[list[Number]]
    effects: list[ModelEffectEntry]
    provenance: PlainMapping


def report_schema() -> dict[str, Any]:
    """The JSON schema of report.json."""
    return Report.model_json_schema(by_alias=True, mode="serialization")


def to_json(entry: BaseModel) -> str:
    """Indented JSON, UTF-8, without NaN."""
    return entry.model_dump_json(indent=1, by_alias=True) + "\n"
