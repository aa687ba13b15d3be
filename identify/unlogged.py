"""What the logged inputs hide, and what that leaves open in every window's predictions.

The predictions' errors in a window are no white noise of the sensors alone: the vessel answered to what the inputs
did between their samples (``identify.bridges``), to what was rounded away (``identify.rounded_inputs``), and to gusts
where nothing measured the wind (``identify.gusts``). In units of the sensors' noise the errors' covariance is 1 + G Gᵀ,
with the answers as columns of G. Errors and tangents are made white with it: along its eigenvectors they become smaller
by 1/√(1+λ). How much of the largest possible variance there really is between samples (a log may be written at every
change), and of gusts, is the share that the errors themselves are most likely with. The size of what was rounded away
is known; it counts where the errors are likelier with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from identify import kernel
from identify.bridges import Shapes, shapes_of
from identify.compiled import rows_of, sensing_of
from identify.disturbed import Sizes, pushed_by
from identify.drive import drive
from identify.entry_phases import phases_of
from identify.gusts import gusts_of
from identify.rounded_inputs import rounding_of
from identify.structure import Structure
from identify.tangents import Along, padded
from identify.threads import abreast
from identify.true_motion import through_water
from identify.whitening import LEAST, Part, eigen, weighted, within
from preprocess.cores import granted

if TYPE_CHECKING:
    from identify.windows import Problem, Window

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Shares of the largest possible variance that are tried.
SHARES = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
#: Gain in 2 log likelihood from which a share is believed, and that anything was rounded away.
BELIEVED = 6.0
#: Inputs are logged often at intervals up to this, s.
OFTEN = 0.15
#: What accounts for less of the squared errors is not looked for in inputs that are logged often.
TENTH = 0.1
#: ... by so many windows, all over the logs.
ASKED = 8
#: Smallest share that is believed, of inputs that are logged seldom and often: less is a few ms, as a run's own steps.
SMALLEST = (0.0, 0.03)


@dataclass(frozen=True)
class Unlogged:
    """What answers to the inputs: a structure and its parameters ``p`` (np,); and the share of the largest variance.

    ``answers``: per stretch (m, 2, K), what its samples would show of each shape in the ``windows``, in their units;
    ``phased`` (m, 2, I) and ``rounded`` (m, 2, R) likewise of inputs that are entered as old each time, and of their
    rounding, None where that counts for nothing; ``blown`` (m, 2, G) of the gusts of a wind that nothing measured,
    whose variance is the share ``gusty`` of the largest; ``pushed`` (m, 2, P) of pushes and drifts of the ``pushes``.
    """

    structure: Structure
    p: FloatArray
    share: float
    windows: tuple[Window, ...]
    answers: tuple[FloatArray, ...]
    phased: tuple[FloatArray, ...] | None = None
    rounded: tuple[FloatArray, ...] | None = None
    gusty: float = 0.0
    blown: tuple[FloatArray, ...] | None = None
    pushes: Sizes | None = None
    pushed: tuple[FloatArray, ...] | None = None

    @property
    def sure(self) -> tuple[Part, ...]:
        """What is known of beside the answers."""
        each = (
            (1.0, self.phased),
            (1.0, self.rounded),
            (math.sqrt(self.gusty), self.blown),
            (1.0, self.pushed),
        )
        return tuple((size, part) for size, part in each if part is not None)

    @property
    def parts(self) -> tuple[Part, ...]:
        """All that is hidden."""
        return (*self.sure, (math.sqrt(self.share), self.answers)) if self.share else self.sure

    @property
    def gusts_alone(self) -> Unlogged | None:
        """The same with nothing hidden but gusts; None where there are none."""
        none = tuple(a[:, :, :0] for a in self.answers)
        alone = replace(self, share=0.0, answers=none, phased=None, rounded=None, pushes=None, pushed=None)
        return alone if self.blown is not None else None

    def over(self, problem: Problem) -> Unlogged:
        """The same for a problem's stretches and windows."""
        if problem.windows is self.windows:
            return self
        there = unlogged(problem, self.structure, self.p, self.share)
        if self.blown is not None:
            there = replace(there, gusty=self.gusty, blown=_blown(problem, self.structure, self.p))
        there = with_pushes(problem, there, self.pushes)
        there = there if self.phased is None else _with_phases(problem, there)
        return there if self.rounded is None else _with_rounding(problem, there)


def unlogged(problem: Problem, structure: Structure, p: FloatArray, share: float = 1.0) -> Unlogged:
    """What the inputs may have done between their samples in a problem's windows."""
    return Unlogged(structure, p, share, problem.windows, _of_all(problem, structure, p, shapes_of))


def with_pushes(problem: Problem, known: Unlogged, pushes: Sizes | None) -> Unlogged:
    """The same with pushes and drifts of some sizes; without any where a prediction that they disturb runs away."""
    pushed = None if pushes is None else pushed_by(problem, known.structure, known.p, pushes)
    return known if pushed is None else replace(known, pushes=pushes, pushed=pushed)


def _blown(problem: Problem, structure: Structure, p: FloatArray) -> tuple[FloatArray, ...]:
    """Per stretch (m, 2, G): what its samples would show of the gustiest wind."""
    return _of_all(problem, structure, p, gusts_of)


def _with_phases(problem: Problem, known: Unlogged, raw: Sequence[FloatArray] | None = None) -> Unlogged:
    """The same with inputs that are entered as old each time, where all are not logged very often.

    As it is where that could not account for one in ten of the squared errors ``raw``.
    """
    phased = _of_all(problem, known.structure, known.p, phases_of)
    some = phased[0].shape[2] and (raw is None or _accounts(problem, phased, raw))
    return replace(known, phased=phased) if some else known


def _with_rounding(problem: Problem, known: Unlogged) -> Unlogged:
    """The same with what may have been rounded away, as far as it shows beside the sensors' noise."""
    if not any(m.quantum > 0.0 for s in problem.stretches for m in s.inputs.values()):
        return known
    rounded = _of_all(problem, known.structure, known.p, rounding_of)
    shown = max(_shown(problem, rounded, w) for w in problem.windows)
    return replace(known, rounded=tuple(r[:, :, :shown] for r in rounded)) if shown else known


def _shown(problem: Problem, answers: Sequence[FloatArray], window: Window) -> int:
    """How many of a window's first answers there are up to the last that shows beside the noise."""
    power = np.sum(weighted(problem, answers, window) ** 2, axis=(0, 1))
    return int(np.flatnonzero(np.append(LEAST, power) >= LEAST)[-1])


def most_likely(
    problem: Problem,
    structure: Structure,
    p: FloatArray,
    raw: Sequence[FloatArray],
    fine: bool = True,
    pushes: Sizes | None = None,
) -> Unlogged | None:
    """What errors ``raw`` (m, 2) of each window are likeliest with, beside ``pushes``; None where nothing is hidden.

    Positions are left out: their slow errors may as well be the receiver's. Unless it is to be ``fine``, inputs that
    are logged often hide nothing; nor do any that could not account for one in ten of the squared errors, by some of
    the windows.
    """
    asked = fine or not _often(problem)
    most = (unlogged if asked else nothing_hidden)(problem, structure, p)
    most = most if _accounts(problem, most.answers, raw) else nothing_hidden(problem, structure, p)
    if fine and any(a.effect.air for a in structure.actives):
        most = _with_gusts(problem, most, raw)
    most = with_pushes(problem, most, pushes)
    known, gain = _believed(problem, most, raw)
    for beside in (partial(_with_phases, raw=raw), _with_rounding)[not asked :]:
        other = beside(problem, most)
        found, more = (known, gain) if other is most else _believed(problem, other, raw)
        if more > gain + BELIEVED:
            most, known, gain = other, found, more
    return known if known.share or known.sure else None


def _with_gusts(problem: Problem, known: Unlogged, raw: Sequence[FloatArray]) -> Unlogged:
    """The same with gusts of the size that errors are likeliest with, where that is believed."""
    blown = _blown(problem, known.structure, known.p)
    gains = _gains(problem, replace(known, answers=blown), raw)
    best = int(np.argmax(gains))
    return replace(known, gusty=SHARES[best], blown=blown) if gains[best] > gains[0] + BELIEVED else known


def _often(problem: Problem) -> bool:
    """Whether all inputs are logged so often that little is hidden."""
    return max(m.sample_time for s in problem.stretches for m in s.inputs.values()) <= OFTEN


def nothing_hidden(problem: Problem, structure: Structure, p: FloatArray) -> Unlogged:
    """That inputs hide nothing between their samples."""
    none = tuple(np.zeros((len(s.samples.t), 2, 0)) for s in problem.stretches)
    return Unlogged(structure, p, 1.0, problem.windows, none)


def _accounts(problem: Problem, answers: Sequence[FloatArray], raw: Sequence[FloatArray]) -> bool:
    """Whether the answers, with the noise, could account for a tenth of the squared errors of some windows."""
    some = slice(None, None, max(1, len(problem.windows) // ASKED))
    error = power = 0.0
    for w, e in zip(problem.windows[some], raw[some], strict=True):
        steady, e = problem.kinds(w) != kernel.POSITION, problem.less_known(w, e)
        error += float(np.sum(e[steady] ** 2))
        power += e[steady].size + float(np.sum(weighted(problem, answers, w)[steady] ** 2))
    return power > TENTH * error


def _believed(problem: Problem, known: Unlogged, raw: Sequence[FloatArray]) -> tuple[Unlogged, float]:
    """With the share that errors are likeliest with, none where it is not believed, and its 2 log likelihood."""
    gains = _gains(problem, known, raw)
    best = int(np.argmax(gains))
    best = best if gains[best] > gains[0] + BELIEVED and SHARES[best] >= SMALLEST[_often(problem)] else 0
    return replace(known, share=SHARES[best]), float(gains[best])


def _gains(problem: Problem, known: Unlogged, raw: Sequence[FloatArray]) -> FloatArray:
    """What each share gains in 2 log likelihood (shares,) over no answers at all, beside what is sure."""
    new = [problem.less_known(w, e) for w, e in zip(problem.windows, raw, strict=True)]
    each = list(zip(problem.windows, new, strict=True))
    gains = abreast(lambda x: _gains_in(problem, known.answers, known.sure, *x), each, granted())
    return np.asarray(np.sum(gains, axis=0))


def _gains_in(
    problem: Problem,
    between: Sequence[FloatArray],
    sure: Sequence[Part],
    window: Window,
    error: FloatArray,
) -> FloatArray:
    """The same (shares,) of errors (m, 2) in one window, by answers ``between`` samples and those that are ``sure``."""
    steady = (problem.kinds(window) != kernel.POSITION)[:, None]
    answers, e = weighted(problem, between, window) * steady[:, :, None], error * steady
    beside = within(problem, sure, window) * steady[:, :, None]
    gains, e = np.zeros(len(SHARES)), e.ravel()
    if beside.shape[2]:
        power, vectors = eigen(beside)
        vectors = vectors.reshape(len(e), len(power))
        gains += _gain(vectors.T @ e, power)
        columns = np.column_stack([answers.reshape(len(e), answers.shape[2]), e])
        columns -= vectors @ ((1.0 - 1.0 / np.sqrt(1.0 + power))[:, None] * (vectors.T @ columns))
        answers, e = columns[:, :-1].reshape(answers.shape), columns[:, -1]
    power, vectors = eigen(answers)
    along = vectors.reshape(len(e), len(power)).T @ e
    return gains + _gain(along, np.array(SHARES)[:, None] * power)


def _gain(along: FloatArray, power: FloatArray) -> FloatArray:
    """What errors (k,) along answers of these powers (..., k) gain in 2 log likelihood."""
    return np.asarray(np.sum(along**2 * power / (1.0 + power) - np.log1p(power), axis=-1), dtype=float)


def _of_all(
    problem: Problem, structure: Structure, p: FloatArray, make: Callable[..., Shapes]
) -> tuple[FloatArray, ...]:
    """What the samples of every stretch would show (m, 2, K) of each shape that is made."""
    numbers = range(len(problem.stretches))
    return tuple(abreast(lambda k: _of_stretch(problem, structure, p, k, make), numbers, granted()))


def _of_stretch(
    problem: Problem, structure: Structure, p: FloatArray, number: int, make: Callable[..., Shapes]
) -> FloatArray:
    """What a stretch's samples would show (m, 2, K) of each shape that is made, in their own units."""
    stretch = problem.stretches[number]
    windows = [w for w in problem.windows if w.stretch == number]
    nothing = np.zeros((len(stretch.samples.t), 2, 0))
    if not windows:
        return nothing
    here = drive(structure, p, stretch)
    shapes = make(structure, p, stretch, [(w.first, w.steps) for w in windows])
    if not shapes.count:
        return nothing
    width = padded(kernel.NX + shapes.count)
    first = np.zeros((len(windows), kernel.NX))
    first[:, :6] = through_water(stretch.states[[w.first for w in windows]], here.current)
    sensing = sensing_of(np.ones(4), stretch, here.sensor, np.zeros((kernel.NM, width)))
    columns = slice(kernel.NX, kernel.NX + shapes.count)
    rows = rows_of(structure, here, stretch, windows, first, _along(shapes, width), sensing, columns)
    return rows * stretch.samples.sigma[:, None, None]


def _along(shapes: Shapes, width: int) -> Along:
    """Directions that are the shapes alone, each in all its places."""
    steps, count, places = shapes.mean.shape
    none, nothing = np.zeros(0, dtype=np.int64), np.zeros(0)
    column = kernel.NX + np.arange(count)
    mean, slope = shapes.mean.reshape(steps, -1), shapes.slope.reshape(steps, -1)
    return Along(
        none, none, none, nothing, none, none, none, nothing, column, np.tile(shapes.places, count),
        np.repeat(column, places),
        mean, slope, np.zeros((2, width)),
    )  # fmt: skip
