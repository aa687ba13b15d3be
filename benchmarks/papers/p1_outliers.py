"""Zhu et al. 2019: what 3 % and 10 % of outliers do to the methods of table 4, each relative to itself without any.

    python -m benchmarks.papers.p1_outliers [--seeds 10] [--quick] [--ours]

The experiment is that of `p1_table4`, logged at 5 Hz, of which the paper's methods take every fifth sample: the rudder
goes over within a second, and between samples of 1 s nobody knows where it was. Beside the paper's methods: output
error without the samples that stand out from a robust curve through their neighbours, as the program treats any raw
log; then samples further than 3.5 robust standard deviations from the free run are set aside and the rest fitted anew,
twice. What is an outlier is judged against the prediction, not against the spread of the raw variable. The last row is
told which samples are outliers: no method can do better, for these samples are lost. What a 10/10 zigzag tells of 25/25
differs by a factor of twenty from draw to draw, so that ten draws are too few for ratios of medians; each draw's ratio
to itself without outliers needs fewer. ``--ours`` leaves the paper's methods out, whose searches take long.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.papers.library import RUDDER, Identified, Sensed, free_run, trial_of
from benchmarks.papers.p1_table4 import METHODS, NOISE, measured, zigzag
from benchmarks.papers.p1_table4 import free_run as run_of_pair
from benchmarks.papers.record import Record
from benchmarks.papers.report import command_line, row
from identify.base_fit import fit_from_scratch
from identify.estimators.estimate import FloatArray
from identify.prepare import prepare
from preprocess.outliers import sliding_three_sigma
from preprocess.trial import BoolArray, Trial
from preprocess.vessel import Vessel

SHARES = (0.0, 0.03, 0.10)
SENSED = Sensed(
    Vessel("USV", length=4.15, beam=1.6),
    float(NOISE[0]),
    float(NOISE[1]),
    1e-3,
    smoothing=2.0,
    inputs=(RUDDER,),
)
FAR, ROUNDS = 3.5, 2
RATE = 5  # Hz


def record_of(table: FloatArray) -> Record:
    """Columns v, r, δ, ψ at 1 s and a steady 3 m/s, from a straight course, as a record."""
    v, r, delta, psi = table.T
    states = np.column_stack([np.full(len(v), 3.0), v, r])
    states[0, 1:] = 0.0
    return Record(np.arange(len(v)) / RATE, states, psi, {"rudder": delta})


def output_error(table: FloatArray) -> Identified:
    """Fit without what stands out from its neighbours, and anew without what is far from the prediction.

    A fit that runs away condemns nothing; what stood out from its neighbours stays aside then.
    """
    record, wrong = record_of(table), standing_out(table)
    for _ in range(ROUNDS):
        trial = _cleaned(record, wrong)
        found = _fit(trial)
        error = np.abs(free_run(found, record, SENSED) - record.states)[:, 1:]
        if np.isfinite(error).all():
            wrong = error > FAR * 1.4826 * np.median(error, axis=0) + 1e-12
    return _fit(_cleaned(record, wrong))


def standing_out(table: FloatArray) -> BoolArray:
    """Samples of v and r (l, 2) that stand out from a robust curve through their neighbours, as for any raw log."""
    t = np.arange(len(table)) / RATE
    return np.column_stack([sliding_three_sigma(t, x, FAR) for x in table[:, :2].T])


def _cleaned(record: Record, wrong: BoolArray) -> Trial:
    """The trial of a record with samples of the velocity and of the yaw rate (l, 2) set aside.

    The motion that a search begins from goes straight over them.
    """
    states = record.states.copy()
    for k, bad in enumerate(wrong.T, start=1):
        states[bad, k] = np.interp(record.t[bad], record.t[~bad], states[~bad, k])
    begin = trial_of("zigzag", replace(record, states=states), SENSED).states
    return _marked(replace(trial_of("zigzag", record, SENSED), states=begin), wrong)


def _fit(trial: Trial) -> Identified:
    prepared = prepare([trial], "zhu2019")
    return Identified(prepared, fit_from_scratch(prepared.structure, prepared.identify))


def _marked(trial: Trial, wrong: BoolArray) -> Trial:
    """The trial with samples of the velocity and of the yaw rate (l, 2) set aside."""
    m = trial.measurements
    seen = {n: replace(m[n], good=~wrong[:, k]) for k, n in enumerate(("velocity", "yaw_rate"))}
    return replace(trial, measurements={**m, **seen})


def told(table: FloatArray, clean: FloatArray) -> Identified:
    """Fit without the samples that are known to be outliers."""
    return _fit(_cleaned(record_of(table), np.abs(table - clean)[:, :2] > 0.0))


def predictions(
    training: FloatArray, test: FloatArray, *, ours: bool
) -> dict[str, Callable[[FloatArray, int], FloatArray]]:
    """Free runs v, r (l, 2) on the test from training data and a seed, by method."""
    truth = record_of(test)
    made = {
        name: (
            lambda table, seed, m=method, w=within: run_of_pair(m(table[::RATE], seed), test[::RATE, 2], w)
        )
        for name, (method, within) in METHODS.items()
    }
    own: dict[str, Callable[[FloatArray, int], FloatArray]] = {
        "OE, outliers set aside": lambda table, seed: free_run(output_error(table), truth, SENSED)[
            ::RATE, 1:
        ],
        "OE, outliers known": lambda table, seed: free_run(
            told(table, measured(training, seed, 0.0)), truth, SENSED
        )[::RATE, 1:],
    }
    return own if ours else {**made, **own}


def _cells(found: FloatArray) -> list[str]:
    """Cells of a row from errors (shares, draws, 2)."""
    middle = np.median(found, axis=1)
    pairs = np.exp(np.mean(np.log(found / found[0]), axis=1))
    noise = (NOISE * [1.0, np.degrees(1.0)]) ** 2
    return [
        f"{e:.2e} ({e / column[0]:.2f}, {p:.2f}, {(e + n) / (column[0] + n):.2f})"
        for column, ratio, n in zip(middle.T, pairs.T, noise, strict=True)
        for e, p in zip(column, ratio, strict=True)
    ]


def main() -> None:
    chosen = command_line(__doc__, seeds=10, ours="leave the paper's methods out")
    length = 60 if chosen.quick else 300
    training, test = zigzag(10.0, length, hertz=RATE), zigzag(25.0, length, hertz=RATE)
    print(
        f"MSE of the free run on 25/25, median of {chosen.seeds} draws; in brackets relative to no outliers,"
    )
    print(
        "of the medians, of each draw to itself (geometric mean), and against data with noise but no outliers"
    )
    row("", [f"{name}, {share:.0%}" for name in ("sway m²/s²", "yaw deg²/s²") for share in SHARES], 32)
    for name, predict in predictions(training, test, ours=chosen.ours).items():
        found = np.array([
            [
                np.mean((predict(measured(training, s, share), s) - test[::RATE, :2]) ** 2, axis=0)
                for s in range(chosen.seeds)
            ]
            for share in SHARES
        ])  # fmt: skip
        row(name, _cells(np.nan_to_num(found, nan=np.inf) * [1.0, np.degrees(1.0) ** 2]), 32)


if __name__ == "__main__":
    main()
