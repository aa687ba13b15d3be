"""One case in detail: what is true, what every round saw, what was said."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.blind.naming import deviations, same_cause
from benchmarks.blind.scores import Record, oracle_effects
from benchmarks.blind.tables import said


def told(record: Record) -> str:
    """Return a record as text."""
    return "\n".join([*_truth(record), *_oracle(record), *_rounds(record), *_answer(record)])


def _truth(record: Record) -> Iterator[str]:
    yield f"seed {record['seed']}  kind {record.get('kind')}  {record.get('why', '')}"
    yield (
        f"vessel {record.get('vessel')} ({record.get('exact_model')},"
        f" declared {record.get('declared_model')}),"
        f" {record.get('format')}, {record.get('duration')} s of {', '.join(record.get('manoeuvres', ()))}"
    )
    for true, strength in zip(record.get("truth", ()), record.get("strengths", ()), strict=True):
        yield f"  true: {_entry(true)}   strength {strength:.2f}"


def _entry(entry: Record) -> str:
    values = {k: _rounded(v) for k, v in entry["parameters"].items()}
    rest = {k: v for k, v in entry.items() if k not in ("name", "parameters", "p_value", "look_alikes") and v}
    return f"{entry['name']} {values} {rest or ''}"


def _rounded(value: object) -> object:
    if isinstance(value, list):
        return " ± ".join(f"{v:.4g}" for v in value)
    return f"{value:.4g}" if isinstance(value, float) else value


def _oracle(record: Record) -> Iterator[str]:
    oracle = record.get("oracle", {})
    if "error" in oracle:
        yield f"oracle: error {oracle['error']:.4f}, chi2/dof {oracle['chi2']:.3f}  {oracle.get('share', '')}"
    for e in oracle_effects(record):
        rivals = ", ".join(f"{k} {v:+.1f}" for k, v in e["rivals"].items())
        yield f"  leaving it out: error x {e['raises']:.2f}, -2logL +{e['gain']:.1f}"
        yield f"  rivals lose: {rivals or '(not tried)'}"
        values = {k: _rounded(v) for k, v in e["parameters"].items()}
        yield f"  its parameters: {values}  z: {_z(e['deviations'])}"


def _z(values: Record) -> str:
    return ", ".join(f"{k} {v:+.1f}" for k, v in values.items())


def _rounds(record: Record) -> Iterator[str]:
    for number, turn in enumerate(record.get("rounds", ()), 1):
        yield f"round {number}: accepted {turn['accepted']}"
        for c in turn["candidates"]:
            rmse = " ".join(f"{k} {b:.4g}>{a:.4g}" for k, (b, a) in c["rmse"].items() if a is not None)
            where = f" ({c['input']})" if c["input"] else ""
            weight = f"{c['evidence']:+12.1f}  p {c['p_value']:.2g}"
            yield f"   {c['effect'] + where:38} {weight}  {rmse}  {c['note']}"
        yield "   residuals, p: " + ", ".join(f"{k} {p:.2g}" for k, p in turn["tests"].items())


def _answer(record: Record) -> Iterator[str]:
    if "verdict" not in record:
        return
    yield f"said: {said(record)}   unexplained {record['unexplained']}"
    for named in record["named"]:
        z = [_z(deviations(t, named)) for t in record["truth"] if same_cause(t, named)]
        yield f"  named: {_entry(named)}  p {named['p_value']:.2g}  z: {'; '.join(z)}"
    errors, chi2 = record["errors"], record["chi2"]
    yield (
        f"errors {errors['before']:.4f} > {errors['after']:.4f};"
        f" chi2/dof {chi2['before']:.2f} > {chi2['after']:.2f}"
    )
    yield f"advice: {record['advice']}"
    yield f"{record['seconds']} s ({record['cpu_seconds']} s of processor), {record['timing']}"
