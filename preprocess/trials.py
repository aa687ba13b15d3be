"""``make_trials``: the logs of a campaign become trials."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ingest.log import Log, Source
from ingest.sender import sender_of
from preprocess import frames
from preprocess.accelerations import Accelerations, find_accelerations
from preprocess.actuators import read_input
from preprocess.compass import with_heading_wander
from preprocess.cores import side_by_side
from preprocess.cutting import cut_at_manoeuvres
from preprocess.doubts import doubts
from preprocess.excitation import with_excitation
from preprocess.findings import contradiction
from preprocess.guessed_units import in_one_unit, with_common_units
from preprocess.gyro_range import within_range
from preprocess.rarely import require_often
from preprocess.raw import Raw, read_raw
from preprocess.receiver import with_velocity_wander
from preprocess.resolve import chosen, of_one_receiver, require, source_of
from preprocess.rounding import resolution
from preprocess.run_of_log import LoggedRun
from preprocess.same_day import said_of_day
from preprocess.trial import Step, Trial
from preprocess.vessel import Input, Sensor, Smoothing, Vessel

#: Quantities that a log must have, and those that help.
NEEDED = ("position", "heading")
HELPFUL = ("yaw_rate", "velocity", "wind", "depth")
#: Share of a log that validates where no log of the campaign says which does.
VALIDATION_SHARE = 1.0 / 3.0
#: Of a meridian, for the rounding of geodetic positions.
METRES_PER_DEGREE = 111_200.0


@dataclass(frozen=True)
class Gathered:
    """One log's samples in SI units, whole, before anything is judged."""

    run: LoggedRun
    sensors: Mapping[str, Raw]
    inputs: Mapping[str, Raw]
    history: tuple[Step, ...]
    accelerations: Accelerations | None = None


def make_trials(
    runs: Sequence[LoggedRun],
    vessel: Vessel,
    inputs: Sequence[Input],
    sensors: Mapping[str, Sensor],
    tell: Callable[[str, float], None] = lambda _name, _share: None,
    smoothing: Smoothing | None = None,
    *,
    by_response: bool = True,
) -> tuple[Trial, ...]:
    """Clean, align and smooth the logs of a campaign.

    Parameters
    ----------
    runs : sequence of LoggedRun
        In the order of the campaign; the first good fix of the first one is the origin.
    vessel : Vessel
    inputs : sequence of Input
    sensors : mapping of quantity to Sensor
        Where detection is not enough.
    tell : callable
        Told the name of each log as it begins, and the share (0…1) of the work that is done.
    smoothing : Smoothing, optional
        The smoother, where it is not the default.
    by_response : bool
        Tell clocks by a model of the response too: not worth its time where a diagnosis follows, which does so better.

    Returns
    -------
    tuple of Trial
        One per log; two (identify, then validate, of the same name) where a log's role is None; of a long log one
        per manoeuvre, all of the same name, in order.

    Raises
    ------
    MissingSignal
        A signal that the campaign names is not in a log.
    MissingQuantity
        A log has no position or no heading.
    CampaignError
        An input needs a calibration.
    NotIdentifiable
        A log's samples come minutes apart.
    """
    for run in runs:
        require_often(run.name, run.log, (source_of(run.log, k, sensors.get(k)) for k in NEEDED))
    runs = with_common_units(runs, vessel)
    read_as = in_one_unit(inputs, [r.log for r in runs])
    gathered = [gather(run, vessel, read_as, sensors) for run in runs]
    ranged = within_range([g.sensors for g in gathered])
    gathered = [replace(g, sensors=s) for g, s in zip(gathered, ranged, strict=True)]
    origin = origin_of(gathered)
    first_utc = next((g.run.log.utc_ns for g in gathered if g.run.log.utc_ns is not None), None)
    local = [in_metres(g, origin) for g in gathered]
    todo = [(g, part) for g in local for part in parts(g)]

    def made(one: tuple[Gathered, tuple[str, float, float]]) -> list[Trial]:
        g, (role, low, high) = one
        whole = make_trial(
            g, vessel, tuple(inputs), role, (low, high), origin, first_utc, smoothing, by_response=by_response
        )
        named = g.run.manoeuvre is not None or g.run.slice is not None
        return [whole] if named else list(cut_at_manoeuvres(whole))

    names = [g.run.name for g in local]
    trials = side_by_side(
        made, todo, lambda one: tell(one[0].run.name, names.index(one[0].run.name) / len(names))
    )
    return with_excitation(with_velocity_wander(with_heading_wander([t for each in trials for t in each])))


def gather(
    run: LoggedRun, vessel: Vessel, inputs: Sequence[Input], sensors: Mapping[str, Sensor]
) -> Gathered:
    """Return samples of every quantity and input that the log has."""
    log, found, steps = run.log, dict[str, Raw](), []
    for quantity in (*NEEDED, *HELPFUL):
        sensor = sensors.get(quantity)
        source = source_of(log, quantity, sensor)
        if source is not None and quantity == "velocity" and not chosen(sensor):
            source = of_one_receiver(log, source, found["position"].sender or "")
        if source is None and quantity in NEEDED:
            require(log, quantity, source)
        if source is not None:
            sensor = _one_clock(found.get("position"), source, sensor, sensors, log)
            found[quantity] = read_raw(log, source, sensor, vessel, accuracy=True)
            if quantity in NEEDED and found[quantity].flagged.all():
                require(log, quantity, None)
            rivals = [s.name for s in log.sources if s.quantity == quantity and s.name != source.name]
            steps.append(Step("take", _take(quantity, source.name, source.unit, sensor, rivals)))
    actuators = {}
    for declared in inputs:
        actuators[declared.name], how = read_input(log, declared)
        steps.append(
            Step("take", {"input": declared.name, "source": actuators[declared.name].source.name, "by": how})
        )
    return Gathered(run, found, actuators, tuple(steps), find_accelerations(log))


def _one_clock(
    position: Raw | None, source: Source, sensor: Sensor | None, sensors: Mapping[str, Sensor], log: Log
) -> Sensor | None:
    """What is declared of a sensor; a velocity is as late as the position of its receiver, if nothing else is said."""
    late = sensors["position"].latency if "position" in sensors else None
    said = sensor is not None and sensor.latency is not None
    if source.quantity != "velocity" or position is None or said or late is None:
        return sensor
    if sender_of(log, source) != position.sender:
        return sensor
    return replace(sensor or Sensor(source.quantity), latency=late)


def _take(quantity: str, name: str, unit: str, sensor: Sensor | None, rivals: list[str]) -> dict[str, object]:
    out: dict[str, object] = {
        "quantity": quantity,
        "source": name,
        "unit": unit,
        "declared": bool(sensor and sensor.signals),
    }
    if sensor is not None and (sensor.offset or sensor.latency):
        out |= {"offset": sensor.offset, "latency": sensor.latency or 0.0}
    return out | ({"not_taken": rivals} if rivals else {})


def origin_of(gathered: Sequence[Gathered]) -> tuple[float, float] | None:
    """Return the first good fix of the first log, degrees; None where positions are in metres."""
    for g in gathered:
        raw = g.sensors["position"]
        good = np.flatnonzero(~raw.flagged)
        if raw.geodetic and len(good):
            latitude, longitude = raw.value[good[0]]
            return float(latitude), float(longitude)
    return None


def in_metres(g: Gathered, origin: tuple[float, float] | None) -> Gathered:
    """Positions in the tangent plane at the origin."""
    raw = g.sensors["position"]
    if not raw.geodetic or origin is None:
        return g
    value = frames.geodetic_to_ned(raw.value[:, 0], raw.value[:, 1], origin)
    quantum = METRES_PER_DEGREE * max(resolution(raw.value[:, 0]), resolution(raw.value[:, 1]))
    step = Step("geodetic_to_ned", {"latitude": origin[0], "longitude": origin[1]})
    return replace(
        g,
        sensors={**g.sensors, "position": replace(raw, value=value, quantum=quantum)},
        history=(*g.history, step),
    )


def parts(g: Gathered) -> list[tuple[str, float, float]]:
    """Role and bounds of each part of a log."""
    t = g.sensors["position"].t
    low, high = g.run.slice or (-np.inf, np.inf)
    if g.run.role is not None:
        return [(g.run.role, low, high)]
    first, last = max(low, float(t.min(initial=0.0))), min(high, float(t.max(initial=0.0)))
    border = last - VALIDATION_SHARE * (last - first)
    return [("identify", low, float(np.nextafter(border, -np.inf))), ("validate", border, high)]


def make_trial(
    g: Gathered,
    vessel: Vessel,
    inputs: tuple[Input, ...],
    role: str,
    bounds: tuple[float, float],
    origin: tuple[float, float] | None,
    first_utc: int | None,
    smoothing: Smoothing | None = None,
    *,
    by_response: bool = True,
) -> Trial:
    """One part of one log, cleaned and smoothed."""
    from preprocess.assembly import process

    made = process(g, vessel, bounds, smoothing, by_response=by_response)
    return Trial(
        name=g.run.name,
        role=role,
        vessel=vessel,
        inputs_declared=inputs,
        measurements=made.measurements,
        inputs=made.inputs,
        states=made.states,
        segments=made.segments,
        start=start_of(g.run, first_utc),
        utc_ns=g.run.log.utc_ns,
        origin=origin,
        manoeuvre=g.run.manoeuvre or made.manoeuvre,
        findings=(
            *doubts(made.measurements, made.inputs, inputs, made.states),
            *contradiction(g.run.manoeuvre, made.manoeuvre),
            *(words for raw in g.inputs.values() for words in raw.remarks),
            *said_of_day(g.run),
            *made.findings,
        ),
        history=(*g.history, *made.history),
        depth=g.run.depth if g.run.depth is not None else vessel.depth,
    )


def start_of(run: LoggedRun, first_utc: int | None) -> float:
    """Campaign time at t = 0, s: UTC where known, else as declared, else 0."""
    if run.log.utc_ns is not None and first_utc is not None:
        return (run.log.utc_ns - first_utc) * 1e-9
    return run.start if run.start is not None else 0.0
