"""``python -m benchmarks.bench_too_simple``: blind cases under another model than the vessel's own.

What is declared then lacks terms of the hull or of the rudder besides the one effect that was drawn. Told are whether
that effect is named all the same, how far its values are off in their standard errors, and the error of the position on
unseen logs before and after.
"""

from __future__ import annotations

import argparse
import dataclasses
import multiprocessing
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.blind.case import answer_of
from benchmarks.blind.naming import deviations, label_of, named_among, same_cause
from fixtures.blind import Case, draw_case, write_case
from seatrial.campaign import load_campaign
from seatrial.pipeline import run

#: Models that can be declared for a vessel in place of the one that is exact for it.
OTHERS = {
    "usv": ("blanke", "zhu2019", "cybership2"), "cybership": ("zhu2019", "blanke"), "tanker": ("cybership2", "zhu2019"),
    "patrol": ("blanke", "cybership2"), "catamaran": ("linear",), "tug": ("linear",), "raft": ("modulus",),
}  # fmt: skip
#: What is, or may be, a term of the other model.
TERMS = frozenset((
    "quadratic_damping", "turning_resistance", "linear_damping", "cross_terms", "rudder_flow",
    "port_starboard_asymmetry", "thrust_loss_with_speed",
))  # fmt: skip


def drawn(seed: int, cases: int, clean: bool) -> Iterator[Case]:
    """Cases of one effect (or none) that is no term of a model, another model declared."""
    while cases:
        case = draw_case(seed, "clean" if clean else "one")
        if not any(e.name in TERMS for e in case.effects):
            models = OTHERS[case.vessel_name]
            yield dataclasses.replace(case, model=models[seed % len(models)])
            cases -= 1
        seed += 1


def judged(case: Case) -> tuple[str, bool, str]:
    """One line on a case, whether its effect was named, and the verdict."""
    with tempfile.TemporaryDirectory() as folder:
        told = write_case(case, Path(folder) / "case")
        results = run(load_campaign(Path(folder) / "case" / "campaign.toml"), workers=1)
    answer = answer_of(results)
    among = {"among": sorted({t.name for t in results.trials if t.role == "identify"})}
    effects: list[dict[str, Any]] = [e | among if "logs" in e else e for e in told["effects"]]  # type: ignore[attr-defined]
    named = all(named_among(e, answer) for e in effects)
    off = [
        f"{v:+.1f}"
        for e in effects
        for n in answer["named"]
        if same_cause(e, n)
        for v in deviations(e, n).values()
    ]
    before, after = results.validation_before.position_rmse, results.validation_after.position_rmse
    model = f"{case.vessel.model} as {case.model}"
    return (
        f"{case.seed} {case.vessel_name:10}{model:26}{' + '.join(map(label_of, effects)) or '(nothing)':34}"
        f"{answer['verdict']:12}{'named' if named and effects else '':6}{' '.join(off):12}"
        f"position {before:8.3f} -> {after:8.3f} m   {' + '.join(map(label_of, answer['named']))}",
        named,
        str(answer["verdict"]),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seed", type=int, default=62000)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument(
        "--clean", action="store_true", help="vessels that lack nothing but the model's terms"
    )
    parser.add_argument("--workers", type=int, default=2)
    a = parser.parse_args()
    found = []
    with multiprocessing.get_context("spawn").Pool(a.workers, maxtasksperchild=1) as pool:
        for line, named, verdict in pool.imap(judged, drawn(a.seed, a.cases, a.clean)):
            print(line, flush=True)
            found.append((named, verdict))
    verdicts = [v for _, v in found]
    print("\n" + ", ".join(f"{verdicts.count(v)} {v}" for v in sorted(set(verdicts))))
    if not a.clean:
        print(f"named: {sum(n for n, _ in found)} of {len(found)}")


if __name__ == "__main__":
    main()
