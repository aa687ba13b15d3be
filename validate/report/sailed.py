"""What the model is about: the vessel as it was declared, when and where it sailed, and how fast, how hard, how far."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime

import numpy as np

from identify.fit import Fit
from identify.similar import prime_coefficients
from preprocess.columns import input_unit
from preprocess.trial import FloatArray, Trial
from preprocess.vessel import Vessel
from validate.report.figures import DEG
from validate.report.words import number

#: Quantities that a model may be asked about beyond what was sailed: what it is called, unit for reading.
SPEED, DRIFT, YAW = ("speed over ground", "m/s"), ("drift angle", "°"), ("yaw rate", "°/s")
#: At less than this share of the largest speed the drift angle is that of a vessel that hardly moves.
UNDER_WAY = 0.2


def particulars(vessel: Vessel, trials: Sequence[Trial]) -> list[tuple[str, str]]:
    """The vessel's particulars as declared, and when and where it sailed as far as the logs know."""
    declared = (
        ("length", vessel.length, "m"), ("beam", vessel.beam, "m"), ("draught", vessel.draught, "m"),
        ("mass", vessel.mass, "kg"), ("yaw inertia", vessel.yaw_inertia, "kg m²"),
    )  # fmt: skip
    rows = [(name, f"{number(value)} {unit}") for name, value, unit in declared if value is not None]
    rows += [("sailed", words) for words in [when(trials)] if words]
    return rows + [("about", words) for words in [where(trials)] if words]


def when(trials: Iterable[Trial]) -> str:
    """Day and time (UTC) of the first and the last sample; empty where no log knows."""
    known = [(t.utc_ns, t.states["t"]) for t in trials if t.utc_ns is not None and len(t.states)]
    if not known:
        return ""
    first = _moment(min(utc + 1e9 * float(t.iloc[0]) for utc, t in known))
    last = _moment(max(utc + 1e9 * float(t.iloc[-1]) for utc, t in known))
    day = f"{first.day} {first:%B %Y}"
    if first.date() == last.date():
        return f"{day}, {first:%H:%M} to {last:%H:%M} UTC"
    return f"{day}, {first:%H:%M} to {last.day} {last:%B %Y}, {last:%H:%M} UTC"


def _moment(ns: float) -> datetime:
    return datetime.fromtimestamp(ns * 1e-9, UTC)


def where(trials: Iterable[Trial]) -> str:
    """Latitude and longitude where the first log begins, to about ten metres; empty where positions are in metres."""
    origin = next((t.origin for t in trials if t.origin is not None), None)
    if origin is None:
        return ""
    north, east = origin
    return f"{abs(north):.4f}° {'N' if north >= 0 else 'S'}, {abs(east):.4f}° {'E' if east >= 0 else 'W'}"


def ranges(trials: Sequence[Trial]) -> list[tuple[str, str, str]]:
    """Of speed, drift angle, yaw rate and every input the range in the logs to identify on, and in those held back."""
    sides = [_extents([t for t in trials if t.role == role]) for role in ("identify", "validate")]
    names = dict.fromkeys(k for side in sides for k in side)
    own, other = sides
    return [(_name(*k), _range(own.get(k)), _range(other.get(k))) for k in names]


def _name(what: str, unit: str) -> str:
    return f"{what}, {unit}" if unit else what


def _range(extent: tuple[float, float] | None) -> str:
    return "–" if extent is None else f"{number(extent[0])} to {number(extent[1])}"


def _extents(trials: Sequence[Trial]) -> dict[tuple[str, str], tuple[float, float]]:
    """Smallest and largest value of each quantity, in its unit for reading."""
    parts: dict[tuple[str, str], list[FloatArray]] = {}
    for trial in trials:
        for key, values in {**_motion(trial), **_inputs(trial)}.items():
            parts.setdefault(key, []).append(values[np.isfinite(values)])
    whole = {k: np.concatenate(v) for k, v in parts.items()}
    return {k: (float(v.min()), float(v.max())) for k, v in whole.items() if len(v)}


def _motion(trial: Trial) -> dict[tuple[str, str], FloatArray]:
    u, v, r = (trial.states[c].to_numpy(np.float64) for c in "uvr")
    speed = np.hypot(u, v)
    fastest = float(np.nanmax(speed)) if np.isfinite(speed).any() else 0.0
    drift = np.where(speed > UNDER_WAY * fastest, np.arctan2(-v, u) * DEG, np.nan)
    return {SPEED: speed, DRIFT: np.asarray(drift), YAW: r * DEG}


def _inputs(trial: Trial) -> dict[tuple[str, str], FloatArray]:
    """Values of every input that were not set aside."""
    found = {}
    for one in trial.inputs_declared:
        if (m := trial.inputs.get(one.name)) is not None:
            unit = input_unit(one)
            angle = unit == "rad"
            values = np.asarray(m.value[m.good], dtype=np.float64) * (DEG if angle else 1.0)
            found[one.name, "°" if angle else "" if unit == "1" else unit] = values
    return found


def prime(fit: Fit, trials: Sequence[Trial]) -> tuple[Mapping[int, str], float]:
    """Coefficients without dimension (the prime system), by their place, and the reference speed, m/s.

    That is the model's own, or the median in the logs to identify on; nothing where a unit is no power of metre and
    second.
    """
    speeds = [_motion(t)[SPEED] for t in trials if t.role == "identify" and len(t.states)]
    speed = fit.u0 or (float(np.nanmedian(np.concatenate(speeds))) if speeds else 0.0)
    if not speed > 0:
        return {}, 0.0
    try:
        found = prime_coefficients(fit, speed)
    except ValueError:
        return {}, 0.0
    return {k: number(p.value) for k, p in enumerate(found) if p.dof}, speed
