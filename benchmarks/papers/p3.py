"""Zhao and Li 2021: the experiment behind tables 2, 3, 5 and 6, the paper's two methods and ours.

What the paper leaves out, and what is assumed: Skjetne's published coefficients (rows a of table 2 are theirs at a step
of 0.1 s; the yaw rows of table 5 are 0.11-0.22 of theirs, so that the paper's yaw plant was another); white noise of
0.002 m/s and rad/s on u, v, r and the heading; 300 s of everything; ants search between the LS estimate less and plus
itself and its natural size. The published ship is directionally unstable, so that the surge run needs a helm, and ours
predicts over windows of 8 s. Eq. 14-15 are read with |r|r, eq. 24 as a Gaussian.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.papers.cybership import STEP, coefficients, sensed, surge_training, zigzag_training
from benchmarks.papers.library import Identified, trial_of
from benchmarks.papers.record import Record
from benchmarks.papers.report import command_line
from identify.base_fit import fit_from_scratch
from identify.by_optimiser import Objective, box_around, objective_for, with_states
from identify.estimators import ESTIMATORS
from identify.estimators.estimate import FloatArray
from identify.optimisers import OPTIMISERS, minimise
from identify.output_error import Stopped
from identify.prepare import Prepared, prepare
from identify.stretch import stretches_of
from identify.structure import null_parameters
from identify.windows import cut

NOISE = 0.002  # m/s and rad/s
WINDOW = 8.0  # s
SURGE = ("u", "|u|u", "u³", "|n|n", "|n|u")  # what the first step of the paper identifies
#: The paper's numbering of the parameters, by equation and term.
NUMBERED: Mapping[str, tuple[str, str]] = {
    "a1": ("u", "u"), "a2": ("u", "|u|u"), "a3": ("u", "u³"), "a4": ("u", "r²"), "a5": ("u", "vr"),
    "a6": ("u", "|n|n"), "a7": ("u", "|n|u"),
    **{
        f"{letter}{k}": (dof, term)
        for letter, dof in (("b", "v"), ("c", "r"))
        for k, term in enumerate(
            ("uv", "ur", "v", "r", "|v|v", "|v|r", "|r|v", "|r|r", "|u|uδ", "|u|u|δ|δ"), start=1
        )
    },
}  # fmt: skip
OWN = ("a1", "b3", "c4")  # these carry the 1 of x(k + 1) = x(k) + ...


@dataclass(frozen=True)
class Data:
    """The two training runs as measured."""

    surge: Record
    zigzag: Record
    noise: float


def data(noise: float, seed: int, duration: float = 300.0) -> Data:
    """Both runs with their noise."""
    sigma = (noise, noise, noise)
    return Data(
        surge_training(duration).noisy(sigma, 2 * seed), zigzag_training(duration).noisy(sigma, 2 * seed + 1), noise
    )  # fmt: skip


def straightened(record: Record) -> Record:
    """The surge run without what its helm did: the couplings left out, as for eq. 16."""
    states = record.states * [1.0, 0.0, 0.0]
    return replace(
        record, states=states, psi=0.0 * record.psi, inputs={**record.inputs, "rudder": 0.0 * record.t}
    )


def terms(record: Record) -> dict[str, FloatArray]:
    """Every term of eq. 13-15 at every sample."""
    (u, v, r), d, n = record.states.T, record.inputs["rudder"], record.inputs["n"]
    return {
        "u": u, "|u|u": np.abs(u) * u, "u³": u**3, "vr": v * r, "r²": r**2, "|n|n": np.abs(n) * n,
        "|n|u": np.abs(n) * u, "ur": u * r, "uv": u * v, "v": v, "|v|v": np.abs(v) * v, "|r|v": np.abs(r) * v,
        "r": r, "|v|r": np.abs(v) * r, "|r|r": np.abs(r) * r, "|u|uδ": np.abs(u) * u * d,
        "|u|u|δ|δ": np.abs(u) * u * np.abs(d) * d,
    }  # fmt: skip


def _prepared(given: Data, model: str) -> Prepared:
    how = sensed(given.noise or 1e-4)
    return prepare([trial_of("surge", given.surge, how), trial_of("zigzag", given.zigzag, how)], model)


def _differences(record: Record, names: list[str], dof: str, known: FloatArray | float = 0.0) -> FloatArray:
    """Coefficients of the named terms by LS on the steps from sample to sample."""
    design = np.column_stack([terms(record)[name] for name in names])[:-1]
    target = np.diff(record.states[:, "uvr".index(dof)]) / STEP - known
    return ESTIMATORS["ls"].fit(design, target, covariance="none").theta


def least_squares(given: Data, seed: int = 0) -> Identified:
    """Two steps as in the paper: surge from the surge run, the rest from the zigzag."""
    prepared = _prepared(given, "zhao2021")
    found = dict(zip(SURGE, _differences(given.surge, list(SURGE), "u"), strict=True))
    of_zigzag = terms(given.zigzag)
    known = sum((c * of_zigzag[name] for name, c in found.items()), np.zeros(len(given.zigzag.t)))[:-1]
    p = null_parameters(prepared.structure)
    for dof in "uvr":
        mine = [k for k, s in enumerate(prepared.structure.slots) if s.term is not None and s.term.dof == dof]
        texts = [s.term.text for k in mine if (s := prepared.structure.slots[k]).term is not None]
        rest = [t for t in texts if dof != "u" or t not in SURGE]
        values = dict(
            zip(rest, _differences(given.zigzag, rest, dof, known if dof == "u" else 0.0), strict=True)
        )
        values |= found if dof == "u" else {}
        p[mine] = [values[t] for t in texts]
    return Identified(prepared, with_states(prepared, p, Stopped.SOLVED))


def colony(generations: tuple[int, int] = (500, 1000)) -> Callable[[Data, int], Identified]:
    """ACO with the printed settings (tables 1 and 4) on the whole free run, step by step as in the paper."""

    def method(given: Data, seed: int = 0) -> Identified:
        start = least_squares(given)
        prepared, p = start.prepared, start.fitted.solution.p.copy()
        box = box_around(prepared.structure, p, prepared.identify)
        for run, (ants, archive), count in zip((0, 1), ((20, 10), (30, 15)), generations, strict=True):
            own = _objective(prepared, p, run, given)
            places = list(own.places)
            found = minimise(
                OPTIMISERS["aco_r"], own, box[places], archive + ants * count, seed,
                population=ants, archive=archive, q=1e-3, xi=0.75,
            )  # fmt: skip
            p[places] = found.x
        return Identified(prepared, with_states(prepared, p, found.stopped))

    return method


def _objective(prepared: Prepared, p: FloatArray, run: int, given: Data) -> Objective:
    """Eq. 17 (run 0: u of the surge run) or eq. 20 (run 1: u, v, r of the zigzag), over the whole run."""
    straight = trial_of("straight", straightened(given.surge), sensed(given.noise or 1e-4))
    stretch = stretches_of(straight, STEP)[0] if run == 0 else prepared.identify[1]
    whole = objective_for(cut([stretch], stretch.h * stretch.steps), prepared.structure, p)
    weight = np.array([1.0, 0.0, 0.0]) if run == 0 else np.ones(3)
    first = [
        s.coefficient
        for s in prepared.structure.slots
        if s.term and s.term.text in SURGE and s.term.dof == "u"
    ]
    places = first if run == 0 else [k for k in whole.places if k not in first]
    courses = tuple(replace(c, weight=weight) for c in whole.courses)
    return replace(whole, courses=courses, places=tuple(places))


def ours(given: Data, seed: int = 0) -> Identified:
    """Continuous model, both runs at once, windowed output error with exact sensitivities."""
    prepared = _prepared(given, "cybership2")
    return Identified(prepared, fit_from_scratch(prepared.structure, prepared.identify, length=WINDOW))


Methods = Mapping[str, Callable[[Data, int], Identified]]


def methods(generations: tuple[int, int] = (500, 1000)) -> Methods:
    """The paper's two and ours, by name."""
    return {"LS": least_squares, "ACO as printed": colony(generations), "output error": ours}


def numbered(found: Identified) -> dict[str, float]:
    """Parameters of the discrete model by the paper's numbers (eq. 13-15)."""
    values = {
        (s.term.dof, s.term.text): float(v)
        for s, v in zip(found.prepared.structure.slots, found.fitted.solution.p, strict=True)
        if s.term is not None
    }
    return {k: STEP * values[where] + (k in OWN) for k, where in NUMBERED.items()}


def true_numbers() -> dict[str, float]:
    """The published coefficients by the paper's numbers."""
    return {k: STEP * coefficients()[where] + (k in OWN) for k, where in NUMBERED.items()}


def uncertainties(found: Identified) -> dict[str, float]:
    """Standard error of each parameter's rate over the size of its true value."""
    stderr = {(c.dof, c.term): c.stderr for c in found.fit.coefficients}
    return {k: stderr[where] / abs(coefficients()[where]) for k, where in NUMBERED.items()}


def options(
    description: str | None, generations: tuple[int, int] = (500, 1000)
) -> tuple[int, Methods, float]:
    """Seeds, methods and duration from the command line."""
    chosen = command_line(description)
    if chosen.quick:
        return 1, methods((5, 5)), 60.0
    return chosen.seeds, methods(generations), 300.0


def surge_only(description: str | None) -> tuple[int, Methods, float]:
    """The same for the tables of the first step, which need no ants for the second."""
    return options(description, (500, 0))
