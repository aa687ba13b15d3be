"""The pieces of a chain, each run free from a first state of its own, with its sensitivities.

While coefficients alone move, what drives a stretch stays as it is: it is worked out once, for a whole search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.chain import UVR, Chain, Piece
from identify.compiled import nothing_along
from identify.drive import Drive, drives
from identify.kernel import NX
from identify.stretch import Stretch
from identify.structure import Structure
from identify.tangents import Along, Run, run_for, sensitivities
from identify.threads import abreast
from identify.true_motion import through_water
from preprocess.cores import granted

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Stretches are run on threads from so many steps times columns on.
WORTH_SHARING = 400_000


@dataclass(frozen=True)
class Ready:
    """A stretch and what drives it, with places to work in.

    ``numbers`` (w,) of its ``pieces`` in the chain; ``states`` (n, 8) the smoothed ones, through the water; ``spread``
    (3,) of u, v, r; ``along`` the coefficients (m,) that are free.
    """

    structure: Structure
    stretch: Stretch
    numbers: IntArray
    pieces: tuple[Piece, ...]
    drive: Drive
    states: FloatArray
    spread: FloatArray
    along: Along
    work: Run

    @property
    def smoothed(self) -> FloatArray:
        """First u, v, r (w, 3) of every piece."""
        return self.states[[w.begin for w in self.pieces], UVR]


@dataclass(frozen=True)
class Paths:
    """What pieces gave, each of w, in units of the spread but for the end.

    ``moment`` (w, 3 + m + 1 square) of first state, coefficients and errors; ``end`` (w, 3), ``slope`` (w, 3, 3 + m) of
    the end.
    """

    moment: FloatArray
    end: FloatArray
    slope: FloatArray


def ready(chain: Chain, p: FloatArray) -> list[Ready]:
    """The stretches of a chain, for any coefficients beside what else is in ``p`` (np,)."""
    used = sorted({w.stretch for w in chain.pieces})
    driven = drives(chain.structure, p, [chain.stretches[k] for k in used])
    return [_ready(chain, k, d) for k, d in zip(used, driven, strict=True)]


def _ready(chain: Chain, number: int, d: Drive) -> Ready:
    structure, stretch = chain.structure, chain.stretches[number]
    mine = [k for k, w in enumerate(chain.pieces) if w.stretch == number]
    pieces = tuple(chain.pieces[k] for k in mine)
    tape, plain, free = structure.table.tape, structure.layout.plain, len(structure.simple)
    along = nothing_along(NX + free + 1)._replace(
        column=NX + np.arange(free), value=tape.value.astype(np.int64)[plain],
        equation=structure.table.equation_of[plain], weight=d.factor[plain],
    )  # fmt: skip
    work = run_for(tape, max(w.steps for w in pieces), along.current.shape[1], d.channels.shape[1])
    states = through_water(stretch.states, d.current)
    return Ready(
        structure, stretch, np.array(mine), pieces, d, states, chain.spread[number], along, work
    )  # fmt: skip


def paths_of(stretches: Sequence[Ready], p: FloatArray, first: FloatArray) -> Paths | None:
    """Run all pieces from ``first`` (pieces, 3) in the order of the chain; None where one runs away."""
    free = len(stretches[0].structure.simple)
    size = (NX + free) * sum(s.stretch.steps for s in stretches)
    runs = abreast(lambda s: _run(s, p, first), stretches, granted() if size > WORTH_SHARING else 1)
    found = [run for run in runs if run is not None]
    if len(found) < len(runs):
        return None
    return Paths(*(np.concatenate(x) for x in zip(*found, strict=True)))


def _run(s: Ready, p: FloatArray, first: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    structure, d, tape = s.structure, s.drive, s.structure.table.tape
    plain, free = structure.layout.plain, len(structure.simple)
    coefficients = d.coefficients.copy()
    coefficients[plain] = d.factor[plain] * p[structure.simple]
    rows, state = tape.rows(coefficients), np.zeros(NX)
    width = NX - UVR.start + free
    moment = np.empty((len(s.pieces), width + 1, width + 1))
    end, slope = np.empty((len(s.pieces), 3)), np.empty((len(s.pieces), 3, width))
    for k, w in enumerate(s.pieces):
        state[:6] = s.states[w.begin]
        state[UVR] = first[s.numbers[k]]
        done = sensitivities(
            state, w.begin, w.steps, s.stretch.h, structure.model.discrete, d.channels, d.slopes, d.wind, d.current,
            d.u0, tape.steps, rows, s.along, s.work,
        )  # fmt: skip
        if done < w.steps:
            return None
        errors = s.states[w.begin + 1 : w.begin + w.steps + 1, UVR] - s.work.states[1 : w.steps + 1, UVR]
        slopes = s.work.s[1 : w.steps + 1, UVR, UVR.start : UVR.start + width + 1] / s.spread[:, None]
        slopes[:, :, -1] = errors / s.spread
        both = slopes.reshape(-1, width + 1)
        moment[k], end[k], slope[k] = both.T @ both, s.work.states[w.steps, UVR], slopes[-1, :, :-1]
    kept = np.r_[:3, NX - UVR.start : width]
    square = np.append(kept, width)
    return moment[:, square[:, None], square], end, slope[:, :, kept]
