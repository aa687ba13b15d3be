"""From records to shares with their intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.blind.naming import TWO_SIDED, deviations, named_among, same_cause
from benchmarks.blind.oracle import separable

Record = Mapping[str, Any]

#: Leaving an effect out must raise the prediction error by this factor for it to be detectable.
DETECTABLE = 1.2
#: … and what the logs to identify on say for it, in -2 log likelihood: without that nothing can be found there.
SHOWN = 6.0
#: Share of a channel's standard deviation above which what is missing is material.
MATERIAL = 0.10


@dataclass(frozen=True)
class Share:
    """How many of how many, with the seeds of the others."""

    good: int
    of: int
    misses: tuple[int, ...] = ()

    @property
    def value(self) -> float:
        """The share; NaN of nothing."""
        return self.good / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval."""
        return wilson(self.good, self.of)


def wilson(good: int, of: int, z: float = TWO_SIDED) -> tuple[float, float]:
    """Interval of a share (Wilson 1927)."""
    if of == 0:
        return 0.0, 1.0
    share = good / of
    centre = share + z * z / (2 * of)
    half = z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return (centre - half) / (1 + z * z / of), (centre + half) / (1 + z * z / of)


def share_of(records: Iterable[Record], good: Callable[[Record], bool]) -> Share:
    """How many of the records are good."""
    told = [(r["seed"], r["status"] == "ok" and good(r)) for r in records]
    return Share(sum(ok for _, ok in told), len(told), tuple(s for s, ok in told if not ok))


def of_kind(records: Iterable[Record], kind: str) -> list[Record]:
    """Return the records of one kind."""
    return [r for r in records if r.get("kind") == kind]


def oracle_effects(record: Record) -> Sequence[Record]:
    """Return what the oracle says of each true effect: nothing where it was not asked, or knows none."""
    effects: Sequence[Record] = record.get("oracle", {}).get("effects", ())
    return effects


def detectable(record: Record) -> bool:
    """Whether leaving out any true effect raises the prediction error, and the logs to identify on show it."""
    effects = oracle_effects(record)
    return bool(effects) and all(e["raises"] >= DETECTABLE and e["gain"] > SHOWN for e in effects)


def told_apart(record: Record) -> bool:
    """Whether the oracle can separate every true effect from its rivals."""
    return detectable(record) and all(separable(e) for e in oracle_effects(record))


def adequate(record: Record) -> bool:
    """Whether the verdict is that nothing is missing."""
    return bool(record["verdict"] == "adequate")


def all_named(record: Record) -> bool:
    """Whether every true effect is named, or is a look-alike under the verdict ambiguous."""
    if record["verdict"] == "ambiguous":
        return all(named_among(t, record) for t in record["truth"])
    return record["verdict"] == "explained" and all_listed(record)


def all_listed(record: Record) -> bool:
    """Whether every true effect is among those taken, whatever the verdict."""
    return all(any(same_cause(t, n) for n in record["named"]) for t in record["truth"])


def sole_and_right(record: Record) -> bool:
    """Whether the true effects, and no others, are named without look-alikes."""
    return (
        record["verdict"] == "explained"
        and all_listed(record)
        and len(record["named"]) == len(record["truth"])
    )


def owned_up(record: Record) -> bool:
    """Whether the verdict is that no known effect explains it."""
    return bool(record["verdict"] == "unexplained")


def material(record: Record) -> bool:
    """Whether what is missing from outside the library matters for the prediction."""
    share = record.get("oracle", {}).get("share")
    return share is not None and max(share.values()) > MATERIAL


def all_deviations(records: Iterable[Record]) -> dict[str, list[float]]:
    """Deviations from the truth in standard errors, by ``effect.parameter``, of all effects rightly named."""
    found: dict[str, list[float]] = {}
    for r in records:
        for true in r.get("truth", ()):
            for named in r.get("named", ()):
                if same_cause(true, named):
                    for name, z in deviations(true, named).items():
                        found.setdefault(f"{true['name']}.{name}", []).append(z)
    return found


def covered(deviation: Iterable[float]) -> Share:
    """How many deviations are within their 95 % interval."""
    z = np.abs(list(deviation))
    return Share(int(np.sum(z <= TWO_SIDED)), len(z))


def after_to_oracle(records: Iterable[Record]) -> list[tuple[float, int]]:
    """Prediction error after over that of the oracle, with the seed, of cases with detectable effects."""
    return sorted(
        (r["errors"]["after"] / r["oracle"]["error"], r["seed"])
        for r in records
        if r["status"] == "ok" and detectable(r) and r["oracle"]["error"] > 0
    )


def width_to_oracle(records: Iterable[Record]) -> list[float]:
    """Return standard errors reported over those of the true structure, of all effects rightly named."""
    found = []
    for r in records:
        for true, oracle in zip(r.get("truth", ()), oracle_effects(r), strict=False):
            for named in r.get("named", ()):
                if same_cause(true, named):
                    pairs = [(named["parameters"].get(k), v) for k, v in oracle["parameters"].items()]
                    found += [p[1] / v[1] for p, v in pairs if p and v[1] > 0]
    return found


def least_p(record: Record) -> float:
    """Return the smallest p-value of the first round: what a diagnosis would go by."""
    rounds = record.get("rounds") or [{"candidates": []}]
    return min((c["p_value"] for c in rounds[0]["candidates"]), default=1.0)


def quantiles(values: Sequence[float], at: Sequence[float]) -> list[float]:
    """Quantiles; NaN of nothing."""
    return [float(np.quantile(values, q)) for q in at] if values else [math.nan] * len(at)
