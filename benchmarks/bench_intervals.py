"""``python -m benchmarks.bench_intervals``: whether the intervals of effects' parameters hold, what is missing known.

Cases are drawn as the blind ones are, written in their formats and read again; the declared model with the true effects
in it is fitted from the effects' true values, and goes on as in the program, each effect in its likeliest form.
Backlash is left out: where in its slack a linkage begins, the program finds by a search of its own.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.bench_measured import trials_of
from benchmarks.blind.naming import Entry
from benchmarks.blind.oracle import active_of, start_values
from fixtures.blind import draw_case, write_case
from identify.base_fit import fit_from_scratch
from identify.fit import Estimated, Fit
from identify.fitted import Fitted
from identify.held_inputs import prepare_best
from identify.prepare import Prepared
from identify.report_fit import make_fit
from identify.structure import Structure, null_parameters
from identify.whole_windows import over_whole_logs, sharpest
from ingest.errors import SeatrialError
from validate.exchange import in_likeliest_form

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
#: True values by number of the effect and name.
Values = dict[tuple[int, str], float]


@dataclass(frozen=True)
class Found:
    """One parameter of an effect: off the truth by so many standard errors, these wider than white noise has them."""

    name: str
    off: float
    wider: float


def case_of(seed: int, kind: str) -> list[Found] | None:
    """The parameters of one case's effects; None where the library cannot say what is true."""
    with tempfile.TemporaryDirectory() as folder:
        case = draw_case(seed, kind)
        told = write_case(case, Path(folder) / "case")
        trials = trials_of(Path(folder) / "case" / "campaign.toml")
    effects: list[Entry] = told["effects"]  # type: ignore[assignment]
    if any(e.get("form") == "play" for e in effects):
        return None
    prepared = prepare_best(trials, case.model)
    known = with_truth(prepared, effects)
    if known is None:
        return None
    structure, values = known
    begun = fit_from_scratch(structure, prepared.identify, _begun(structure, values))
    formed = in_likeliest_form(begun)
    return _found(values, _made(prepared, over_whole_logs(formed)), _made(prepared, sharpest(formed)))


def with_truth(prepared: Prepared, effects: Sequence[Entry]) -> tuple[Structure, Values] | None:
    """The declared model with the true effects, and their true values as the program counts them."""
    structure = prepared.structure
    values: Values = {}
    among = sorted({s.name for s in prepared.identify})
    for k, true in enumerate(effects):
        true = {**true, "among": among} if "logs" in true else true
        active = active_of(true, structure)
        if active is None:
            return None
        structure = structure.with_effect(active)
        values |= {(k, n): v for n, v in start_values(true, active).items()}
    return structure, values


def _begun(structure: Structure, values: Values) -> FloatArray:
    """Parameters with the effects at their true values."""
    p = null_parameters(structure)
    for i, slot in enumerate(structure.slots):
        p[i] = np.clip(values.get((slot.effect, slot.name), p[i]), *slot.parameter.bounds)
    return p


def _made(prepared: Prepared, fitted: Fitted) -> Fit:
    return make_fit(prepared, fitted, estimator="output_error", optimiser="auto", seed=0)


def _found(values: Values, plain: Fit, now: Fit) -> list[Found]:
    """Errors over standard errors, and these over what they are without disturbances and the windows' scatter."""
    return [
        Found(f"{one.name}.{q.name}", _off(q, values[k, q.name]) / q.stderr, q.stderr / p.stderr)
        for k, (was, one) in enumerate(zip(plain.effects, now.effects, strict=True))
        for p, q in zip(was.parameters, one.parameters, strict=True)
        if (k, q.name) in values and q.stderr > 0
    ]


def _off(found: Estimated, true: float) -> float:
    """How far a value is off the truth; an angle by the shorter way round."""
    away = found.value - true
    return math.remainder(away, 2.0 * math.pi) if found.unit == "rad" else away


def summary(found: Sequence[Found]) -> str:
    """A row: intervals that hold, root mean square, and how many times wider disturbances and scatter make them."""
    off, wider = np.array([f.off for f in found]), np.array([f.wider for f in found])
    held, before = int(np.sum(np.abs(off) < 1.96)), int(np.sum(np.abs(off * wider) < 1.96))
    low, middle, high = np.percentile(wider, [10, 50, 90])
    return (
        f"{held} of {len(off)} intervals hold ({held / len(off):.3f}), {before} without disturbances and scatter; "
        f"root mean square of error over standard error {np.sqrt(np.mean(off**2)):.2f}; "
        f"wider for them {middle:.2f} times (a tenth less than {low:.2f}, a tenth more than {high:.2f})"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bench_intervals", description=__doc__)
    parser.add_argument("--seed", type=int, default=33000)
    parser.add_argument("--cases", type=int, default=60)
    a = parser.parse_args(arguments)
    every: list[Found] = []
    for seed in range(a.seed, a.seed + a.cases):
        try:
            found = case_of(seed, ("one", "two")[seed % 2])
        except SeatrialError as error:
            print(f"{seed}: {error}", flush=True)
            continue
        if found is not None:
            every += found
            print(f"{seed}: " + ", ".join(f"{f.name} {f.off:+.1f}" for f in found), flush=True)
    print(summary(every))


if __name__ == "__main__":
    main()
