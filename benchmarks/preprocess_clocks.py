# ruff: noqa: ANN001, ANN201
"""Clock offsets as preprocessing tells them, beside the Cramér-Rao bound of the truth's own equations."""

from __future__ import annotations

import numpy as np

from benchmarks.preprocess_bound import bound
from benchmarks.preprocess_cases import NOISE, SAILED, Imperfect, sampled, trial_of, truth_of
from preprocess.trial import Trial

#: True offsets, s, in turn; length of a log, s; rates of the sensors, Hz.
DELAYS, DURATION = (-0.2, 0.1, 0.3), 150.0
RATES = {"position": 5, "heading": 10, "yaw_rate": 20}
#: Interval at which the inputs are logged, s.
LOGGED = 0.1
#: Streams and the names that findings have for them.
STREAMS = {"yaw_rate": "yaw_rate", "position": "position", "inputs": "the inputs"}


def clocks(seeds: int, sailed=SAILED) -> None:
    """Offsets of each stream in turn; inputs are logged at 10 Hz by a logger that knows nothing of the helm's ticks."""
    print("\nclock offsets at 5 Hz position (true −0.2, 0.1, 0.3 s in turn): bias ± scatter of those told, s")
    print(
        "(their mean standard error; least possible with the structure known / with every term of the simulator);"
    )
    print("share of 95 % intervals that hold the truth; told in so many logs")
    for vessel, manoeuvre in sailed:
        shown = [f"  {vessel} {manoeuvre}"]
        truth = truth_of(vessel, manoeuvre, DURATION, 0)
        least = [bound(truth, every) for every in (False, True)]
        for stream in STREAMS:
            found = [offset_of(vessel, manoeuvre, seed, stream) for seed in range(seeds)]
            told = np.array([f for f in found if f is not None]).reshape(-1, 2)
            best = "/".join(f"{getattr(b, stream):.4f}" for b in least)
            shown.append(f"    {stream:9s}{in_words(told)} ({best}); {len(told)} of {seeds}")
        print("\n".join(shown), flush=True)


def in_words(told) -> str:
    """Bias, scatter, stated error and coverage of errors and standard errors (n, 2)."""
    if not len(told):
        return "not told"
    error, stated = told.T
    held = np.mean(np.abs(error) < 1.96 * stated)
    return f"{error.mean():+.3f} ± {error.std():.3f} ({stated.mean():.3f}); {held:.2f}"


def offset_of(vessel: str, manoeuvre: str, seed: int, stream: str):
    """Error and standard error of the offset found in one log; None where none is told."""
    delay = DELAYS[seed % len(DELAYS)]
    (step,) = [
        s for s in delayed(vessel, manoeuvre, seed, stream, delay).history if s.action == "clock_offsets"
    ]
    told = step.arguments.get(STREAMS[stream])
    late = lateness(seed) - 0.5 * LOGGED if stream == "inputs" else 0.0
    return None if told is None else (told[1] - delay - late, told[2])


def lateness(seed: int) -> float:
    """How late steps of the helm stand in the log of this seed, s: its logger knows nothing of the helm's ticks.

    Half the interval is what is taken off them; the rest, which nobody can tell from an offset, is no error.
    """
    return float(np.random.default_rng(seed + 5).integers(0, 10)) * LOGGED / 10.0


def delayed(vessel: str, manoeuvre: str, seed: int, stream: str, delay: float) -> Trial:
    """A trial in which the stamps of one stream are late."""
    sensors = {k: Imperfect(rate, NOISE[k], delay=delay * (k == stream)) for k, rate in RATES.items()}
    truth = truth_of(vessel, manoeuvre, DURATION, seed)
    made = sampled(truth, seed, **sensors)
    table = made.log.tables["act"]
    first = round(10.0 * lateness(seed) / LOGGED)  # in hundredths of a second after a tick
    stamps = truth.t[first::10] + delay * (stream == "inputs")
    late = stamps >= 0.0
    index = type(table.index)(np.round(stamps[late] * 1e9).astype("int64"), name=table.index.name)
    made.log.tables["act"] = type(table)(truth.inputs[first::10][late], index, table.columns)
    return trial_of(made)
