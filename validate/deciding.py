"""Which manoeuvre would tell two causes apart: computed by sailing the standard ones with both fitted models.

The model with one cause sails; its measurements, as this vessel's own sensors would take them, are added to the logs
that there are, and the model with the other cause is fitted to all of them. What its cost grows by is what the
manoeuvre is expected to add to the difference in -2 log likelihood (T-optimality: Atkinson and Fedorov 1975,
Biometrika 62).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.drive import drive
from identify.fitted import Fitted
from identify.noise import dispersed_cost
from identify.output_error import solve
from identify.predict import run, shown, true_first_state
from identify.simulate.helm import helm_for, shape_of
from identify.simulate.order import Order
from identify.simulate.plant import Command, Plant
from identify.simulate.rebuild import Rebuilt
from identify.simulate.zigzag import run_zigzag
from identify.stretch import Samples, Stretch
from identify.windows import Problem, cut, moments
from preprocess.trial import Measurement

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A run is believed up to so many times the largest velocity in the logs: these leave open what is beyond.
BELIEVABLE = 2.0
#: A difference of more than this is as good as this one: of such manoeuvres the simplest is advised.
PLENTY = 1000.0
#: Courses on which every manoeuvre is tried, rad.
COURSES = (0.0, 0.5 * math.pi)
#: Where effects act for which the course matters.
PLACES = ("water", "air", "sensor")
#: Steps of a refit.
BUDGET = 6
#: Every manoeuvre begins with a straight run and lasts so many s, longer for ships.
RUN_IN, DURATION = 10.0, 60.0


@dataclass(frozen=True)
class Deciding:
    """A manoeuvre, the course on which it begins (rad), its duration (s), and the difference that it should make.

    ``separation`` is in -2 log likelihood, the least over the rivals, at most ``PLENTY``.
    """

    manoeuvre: str
    course: float
    duration: float
    separation: float

    @property
    def sentence(self) -> str:
        """What to sail, and what it would tell."""
        course = round(math.degrees(self.course)) % 360
        return (
            f"sail {self.manoeuvre} for {self.duration:.0f} s, beginning on course {course:03d}°: it is expected to "
            f"set them {'more than ' if self.separation >= PLENTY else ''}{self.separation:.0f} apart in -2 log "
            "likelihood"
        )


def deciding_manoeuvre(taken: Fitted, rivals: Sequence[Fitted]) -> Deciding | None:
    """The standard manoeuvre that separates a fit best from all its rivals; None where none can be sailed."""
    found = []
    of_place = any(a.effect.place in PLACES for f in (taken, *rivals) for a in f.solution.structure.actives)
    courses = COURSES if of_place else COURSES[:1]
    for name, inputs, duration in _manoeuvres(taken):
        for course in courses:
            sailed = _sailed(taken, inputs, course, duration)
            if sailed is not None:
                least = min(_separation(rival, sailed) for rival in rivals)
                found.append(Deciding(name, course, duration, min(least, PLENTY)))
    return max(found, key=lambda d: d.separation, default=None)


def _manoeuvres(fitted: Fitted) -> Iterator[tuple[str, Mapping[str, Measurement], float]]:
    """Name, inputs as logged, and duration of every standard manoeuvre that the vessel can sail."""
    structure, template = fitted.solution.structure, fitted.problem.stretches[0]
    helm = helm_for(structure.inputs, shape_of(structure.inputs, _typical(fitted)))
    rebuilt = Rebuilt(structure, fitted.solution.p, np.zeros((len(fitted.solution.p),) * 2))
    speed = max(float(np.median(np.hypot(*template.states[:, 3:5].T))), 0.1)
    plant = Plant(rebuilt, helm, speed, template.h, template.name)
    duration = DURATION * max(1.0, math.sqrt(structure.vessel.length / 7.0))
    for name, commands in _scripts(plant, duration):
        t, angle, throttle = (np.array(c) for c in zip(*commands, strict=True))
        values = helm.commands(angle, throttle)
        yield name, {n: _as_logged(template.inputs[n], t, v) for n, v in values.items()}, duration


def _typical(fitted: Fitted) -> dict[str, float]:
    """Upper quartile of every input over the logs."""
    stretches = fitted.problem.stretches
    return {
        n: float(np.quantile(np.concatenate([s.inputs[n].value[s.inputs[n].good] for s in stretches]), 0.75))
        for n in stretches[0].inputs
    }


def _scripts(plant: Plant, duration: float) -> Iterator[tuple[str, list[Command]]]:
    begin: list[Command] = [(-100.0, 0.0, 1.0)]
    late = RUN_IN + 0.5 * (duration - RUN_IN)
    if plant.helm.steers:
        for degrees in (10.0, 20.0):
            yield f"a zigzag {degrees:.0f}/{degrees:.0f}", begin + _zigzag(plant, degrees, duration)
        angle = math.radians(20.0)
        yield "circles at 20° of helm to both sides", [*begin, (RUN_IN, angle, 1.0), (late, -angle, 1.0)]
        quick = [(RUN_IN + 3.0 * k, angle * (-1) ** k, 1.0) for k in range(int((duration - RUN_IN) / 3.0))]
        yield "helm reversals of 20° every 3 s", begin + quick
    yield "straight on at half throttle, then at full", [*begin, (RUN_IN, 0.0, 0.5), (late, 0.0, 1.0)]
    yield "straight on, then coasting without thrust", [*begin, (RUN_IN, 0.0, 0.0)]


def _zigzag(plant: Plant, degrees: float, duration: float) -> list[Command]:
    """Helm orders of a zigzag as the fitted model sails it."""
    angle = math.radians(degrees)
    times = run_zigzag(plant, Order("zigzag", angle, angle, samples=0)).executes
    return [(RUN_IN + t, angle * (-1) ** k, 1.0) for k, t in enumerate(times) if RUN_IN + t < duration]


def _as_logged(logged: Measurement, t: FloatArray, value: FloatArray) -> Measurement:
    """An input's orders as the log of the vessel would hold them: a sample every so often, whatever changes."""
    often = np.arange(t[0], t[-1] + 2.0 * logged.sample_time, max(logged.sample_time, 1e-2))
    held = value[np.searchsorted(t, often, side="right") - 1]
    return replace(logged, t=often, value=held, good=np.ones(len(often), dtype=bool), held=True)


def _sailed(
    fitted: Fitted, inputs: Mapping[str, Measurement], course: float, duration: float
) -> Stretch | None:
    """What the sensors would show of a manoeuvre of the fitted model, without noise."""
    template, structure, p = fitted.problem.stretches[0], fitted.solution.structure, fitted.solution.p
    steps = int(duration / template.h)
    blank = replace(
        template, role="identify", start=0.0, steps=steps, inputs=inputs, states=np.zeros((steps + 1, 6)),
        sigmas=np.zeros((steps + 1, 3)), wind=np.zeros((steps, 2)), samples=_cadence(fitted.problem, duration),
    )  # fmt: skip
    d = drive(structure, p, blank)
    first = np.zeros(8)
    first[2], first[3] = course, max(float(np.median(template.states[:, 3])), 0.1)
    states = run(structure, d, blank, first)
    fastest = max(float(np.abs(s.states[:, 3:5]).max()) for s in fitted.problem.stretches)
    if not np.abs(states[:, 3:5]).max() < BELIEVABLE * fastest:
        return None
    there = replace(blank, states=shown(structure, d, blank, states))
    plain = Problem((there,), cut([there], 2 * duration).windows, np.ones(4), np.ones(4), duration)
    unit = replace(there.samples, sigma=np.ones(len(there.samples.t)))
    at_zero = replace(plain, stretches=(replace(there, samples=unit, drifts=()),))
    now = moments(at_zero, structure, p, first[None, :])
    return replace(there, samples=replace(there.samples, value=-now.residuals[0]))


def _cadence(problem: Problem, duration: float) -> Samples:
    """Samples (values zero) at the rates of the vessel's own sensors."""
    own = problem.stretches[0].samples
    t, kind, sigma = [], [], []
    for k in np.unique(own.kind):
        mine = own.kind == k
        times = np.arange(0.0, duration, max(float(np.median(np.diff(own.t[mine]))), 1e-3))
        t.append(times)
        kind.append(np.full(len(times), k))
        sigma.append(np.full(len(times), float(np.median(own.sigma[mine]))))
    columns = [np.concatenate(c) for c in (t, kind, sigma)]
    order = np.argsort(columns[0], kind="stable")
    times, kinds, sigmas = (c[order] for c in columns)
    return Samples(times, kinds.astype(np.int64), np.zeros((len(times), 2)), sigmas)


def _separation(rival: Fitted, sailed: Stretch) -> float:
    """What a manoeuvre adds to a rival's -2 log likelihood, refitted to it and to the logs that there are."""
    structure, p = rival.solution.structure, rival.solution.p
    before = replace(rival.problem, unlogged=None)  # orders that are planned hide nothing
    own = solve(before, structure, p, rival.solution.first, rival.prior, budget=BUDGET, tolerance=1.0)
    problem = cut([*before.stretches, sailed], before.length).weighted_as(before)
    d = drive(structure, p, sailed)
    new = [true_first_state(structure, d, sailed, w.first) for w in problem.windows[len(before.windows) :]]
    first = np.vstack([own.first, *new])
    found = solve(problem, structure, own.p, first, rival.prior, budget=BUDGET, tolerance=1.0)
    if not np.isfinite(found.total):
        return 0.0
    return max(0.0, dispersed_cost(problem, found) - dispersed_cost(before, own))
