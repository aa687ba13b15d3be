"""A campaign that was read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from preprocess.vessel import Input, Sensor, Smoothing, Vessel


@dataclass(frozen=True)
class LogEntry:
    """One ``[[log]]``.

    Attributes
    ----------
    path : str
        As the campaign writes it.
    file : Path
        Where it is.
    role : str, optional
        ``"identify"`` or ``"validate"``; None where no log of the campaign validates:
        then the last third of each does.
    manoeuvre : str, optional
        What was done.
    start : float, optional
        Campaign time at which the log starts, s.
    slice : (from, to), optional
        s since the log's first record.
    format : str, optional
        Where detection must be overruled.
    dialect : mapping
        How delimited text is written.
    depth : float, optional
        Depth of the water, m.
    """

    path: str
    file: Path
    role: str | None = None
    manoeuvre: str | None = None
    start: float | None = None
    slice: tuple[float, float] | None = None
    format: str | None = None
    dialect: Mapping[str, object] = field(default_factory=dict)
    depth: float | None = None


@dataclass(frozen=True)
class Campaign:
    """One vessel, one day, several logs: what ``campaign.toml`` says, in SI units and radians."""

    path: Path
    vessel: Vessel
    inputs: tuple[Input, ...]
    sensors: tuple[Sensor, ...]
    logs: tuple[LogEntry, ...]
    model: str = "auto"
    estimator: str = "auto"
    optimiser: str = "auto"
    dbc: Path | None = None
    smoothing: Smoothing = field(default_factory=Smoothing)
