"""``simulate``: an identified model in a standard manoeuvre, with what its uncertainty makes of the measures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from identify.effect import Active
from identify.fit import Fit
from identify.simulate.circle import measure_circle, run_circle, short_of_circle
from identify.simulate.drawn import drawn
from identify.simulate.helm import BEYOND, assumed, driven, helm_for, require_steering, shape_of
from identify.simulate.intervals import measure_of, remarks
from identify.simulate.measures import Measure, imo_limits
from identify.simulate.order import Order, ordered
from identify.simulate.plant import GRAVITY, Plant, Track, balanced_speed, sail, throttle_for
from identify.simulate.rebuild import Rebuilt, rebuild
from identify.simulate.spiral import measure_spiral, run_spiral, short_of_spiral
from identify.simulate.stopping import measure_stopping, run_stopping, short_of_stop
from identify.simulate.zigzag import measure_zigzag, run_zigzag, short_of_zigzag
from identify.stretch import step_for
from ingest.errors import DataError, UsageError, nearest

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Froude number of the approach where nothing says how fast.
FROUDE = 0.2
#: Effects of place and day, and of what was logged: not part of a standard manoeuvre.
_LOGGING = ("sensor", "clock")
_WEATHER = ("current", "wind")


@dataclass(frozen=True)
class Manoeuvre:
    """A manoeuvre that was simulated.

    Attributes
    ----------
    order : Order
        What was asked for.
    t : (n,) s
        From the first order of the helm or the engine.
    states : (n, 6)
        x, y (m, from the place of the first order, x along the approach), psi, u, v, r over ground.
    inputs : mapping of str to (n,)
        As ordered.
    measures : tuple of Measure
    speed : float
        Approach speed, m/s.
    tracks : (k, m, 2)
        Tracks of some of the draws, for a plot; NaN after their end.
    failed : float
        Share of the draws that ran away or did not come to an end.
    notes : tuple of str
        Sentences.
    """

    order: Order
    t: FloatArray
    states: FloatArray
    inputs: Mapping[str, FloatArray]
    measures: tuple[Measure, ...]
    speed: float
    tracks: FloatArray
    failed: float = 0.0
    notes: tuple[str, ...] = field(default_factory=tuple)

    def __getitem__(self, name: str) -> Measure:
        """The measure of that name."""
        return next(m for m in self.measures if m.name == name)


def simulate(fit: Fit, manoeuvre: Order | str = "zigzag 20/20", seed: int = 0) -> Manoeuvre:
    """Run an identified model through a standard manoeuvre.

    Parameters
    ----------
    fit : Fit
        From ``load_model`` or a run.
    manoeuvre : Order or str
        ``"zigzag 20/20"``, ``"zigzag 10/10 port"``, ``"circle 35"``, ``"spiral"``, ``"stopping"``, or an ``Order``.
    seed : int
        Of the draws from the parameters' covariance.

    Returns
    -------
    Manoeuvre

    Raises
    ------
    UsageError
        The manoeuvre is not known, or the vessel has nothing to steer or to stop with.
    DataError
        The model runs away from the approach on.
    """
    order = ordered(manoeuvre)
    plant, notes = plant_for(fit, order)
    track, values, short = perform(plant, order)
    if not track.finite:
        raise DataError(f"{order.title}: the model runs away; it cannot be simulated here.")
    draws = drawn(
        plant, values, lambda one: perform(one, order)[:2], order.samples, seed, linear=fit.misfit > 1.0
    )
    limits = imo_limits(order.kind, order.helm, fit.vessel.length, plant.speed)
    measures = tuple(
        measure_of(
            n, v, draws.values.get(n, np.zeros(0)), limits.get(n), 0.0 if n in draws.positive else -math.inf
        )
        for n, v in values.items()
    )
    return Manoeuvre(
        order, track.t, track.states, track.inputs, measures, plant.speed, draws.tracks, draws.failed_share,
        (*notes, *([short] if short else []), *remarks(draws, measures)),
    )  # fmt: skip


def plant_for(fit: Fit, order: Order) -> tuple[Plant, list[str]]:
    """The vessel of a fit, its approach speed and throttle, and sentences about what had to be assumed."""
    whole = rebuild(fit)
    _check_log(order.log, whole.structure.setting.logs)
    rebuilt = whole.keeping(lambda a: _belongs(a, order))
    left = [a.label for a in whole.structure.actives if not _belongs(a, order)]
    notes = [f"Left out, since they are not the vessel's: {', '.join(left)}."] if left else []
    helm = helm_for(fit.inputs, shape_of(fit.inputs, fit.typical_inputs), fit.largest_inputs)
    if order.kind == "stopping" and not driven(fit.inputs):
        raise UsageError("stopping: none of the inputs gives thrust.")
    if order.kind != "stopping":
        require_steering(helm, order.kind)
    notes += _extrapolation(rebuilt, order)
    plant = Plant(rebuilt, helm, 1.0, step_for(fit.vessel.length), order.log or "", order.helm_rate)
    plant, said = _approach(plant, order, fit.typical_inputs)
    plant = _turned_to_starboard(plant, order)
    return plant, [
        *notes,
        *said,
        *_applied(plant, order, fit.largest_inputs),
        *_beyond_the_speeds(plant, fit.speeds),
    ]


def _applied(plant: Plant, order: Order, largest: Mapping[str, float]) -> list[str]:
    """How the order is applied, and which commands the logs do not have."""
    if order.kind == "stopping":
        return plant.helm.beyond(0.0, -order.reverse, largest)
    return [*plant.helm.beyond(order.helm, 1.0, largest), *plant.helm.words(order.helm)]


def _beyond_the_speeds(plant: Plant, speeds: tuple[float, float] | None) -> list[str]:
    """What is said of an approach at a speed that the logs do not have."""
    low, high = speeds or (-math.inf, math.inf)
    if low / BEYOND <= plant.speed <= BEYOND * high:
        return []
    return [
        f"An approach at {plant.speed:.3g} m/s is an extrapolation: the logs have {low:.3g} to {high:.3g} m/s."
    ]


def _check_log(name: str | None, known: tuple[str, ...]) -> None:
    """A log that no effect names has no loading or depth of its own: it may be misspelt."""
    if name is None or name in known:
        return
    there = f"it names {', '.join(nearest(name, known) or known[:5])}" if known else "it names none"
    raise UsageError(
        f"manoeuvre: no effect of this model names the log '{name}'; {there}. "
        "Without a log, the loading and depth of all others hold."
    )


def _belongs(active: Active, order: Order) -> bool:
    effect = active.effect
    if effect.place in _LOGGING or effect.rewire:
        return False
    return order.conditions or effect.name not in _WEATHER


def _extrapolation(rebuilt: Rebuilt, order: Order) -> list[str]:
    model = rebuilt.structure.model
    if "u" not in model.predicts:
        if order.kind == "stopping":
            raise UsageError(f"stopping: the model '{model.name}' has no surge equation.")
        return [f"The model '{model.name}' has no surge equation: the speed stays as it is, drift is zero."]
    return ["Thrust astern is an extrapolation where no log had it."] if order.kind == "stopping" else []


def _approach(plant: Plant, order: Order, typical: Mapping[str, float]) -> tuple[Plant, list[str]]:
    """Speed and throttle of the approach."""
    length = plant.rebuilt.structure.vessel.length
    froude = FROUDE * math.sqrt(GRAVITY * length)
    if order.speed is None and typical:
        speed = balanced_speed(plant, 15.0 * froude)
        if speed is not None:
            return replace(plant, speed=speed), assumed(plant.helm.inputs, typical)
    speed = order.speed or froude
    said = (
        []
        if order.speed
        else [f"No speed was given and none is known: {speed:.3g} m/s (Froude number {FROUDE})."]
    )
    plant = replace(plant, speed=speed)
    if not driven(plant.helm.inputs) or "u" not in plant.rebuilt.structure.model.predicts:
        return plant, said
    factor = throttle_for(plant, speed)
    if factor is None:
        return plant, [
            *said,
            f"No thrust holds {speed:.3g} m/s: the run begins there and finds a speed of its own.",
        ]
    ahead = {n: factor * v for n, v in plant.helm.ahead.items()}
    return replace(plant, helm=replace(plant.helm, ahead=ahead)), said


def _turned_to_starboard(plant: Plant, order: Order) -> Plant:
    """The plant with the sign of its helm such that positive turns to starboard."""
    if not plant.helm.steers:
        return plant
    time = 3.0 * plant.rebuilt.structure.vessel.length / plant.speed
    small = min(order.helm, math.radians(10.0)) or math.radians(10.0)
    both = [sail(plant, [(0.0, s * small, 1.0)], time).states[-1, 2] for s in (1.0, -1.0)]
    sign = 1.0 if not both[0] < both[1] else -1.0
    return replace(plant, helm=replace(plant.helm, sign=sign))


def perform(plant: Plant, order: Order) -> tuple[Track, dict[str, float], str]:
    """Run the manoeuvre once; its track, its measures, and why it did not come to its end, if so."""
    if order.kind == "zigzag":
        zigzag = run_zigzag(plant, order)
        return zigzag.track, measure_zigzag(zigzag, order), short_of_zigzag(zigzag, order)
    run, measure, short = {
        "circle": (run_circle, measure_circle, short_of_circle),
        "spiral": (run_spiral, measure_spiral, short_of_spiral),
        "stopping": (run_stopping, measure_stopping, short_of_stop),
    }[order.kind]
    track = run(plant, order)
    return track, measure(track, order), short(track, order)
