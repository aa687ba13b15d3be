"""The tables that a benchmark prints: goals, confusion, power, calibration, failures."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from benchmarks.blind import scores
from benchmarks.blind.naming import label_of, named_among
from benchmarks.blind.scores import Record, Share

#: Claimed false-alarm rates at which the calibration is looked at.
LEVELS = (0.5, 0.2, 0.1, 0.05, 0.01)


def summary(records: Sequence[Record]) -> str:
    """Return all tables."""
    parts = (goals, timing, confusion, power, intervals, calibration, failures)
    return "\n\n".join(text for part in parts if (text := part(records)))


def goals(records: Sequence[Record]) -> str:
    """Return what is asked for, beside what was reached."""
    done = [r for r in records if "kind" in r]
    clean, one = scores.of_kind(done, "clean"), scores.of_kind(done, "one")
    two, outside = scores.of_kind(done, "two"), scores.of_kind(done, "outside")
    seen = [r for r in one if scores.detectable(r)]
    pairs = [r for r in two if scores.detectable(r)]
    foreign = [r for r in outside if scores.material(r)]
    lines = [
        _line("clean campaigns called adequate", "97 %", scores.share_of(clean, scores.adequate)),
        _line("one detectable effect: named or look-alike", "95 %", scores.share_of(seen, scores.all_named)),
        _line("  taken, whatever the verdict", "", scores.share_of(seen, scores.all_listed)),
        _line("  separable: sole and right", "90 %",
              scores.share_of(filter(scores.told_apart, seen), scores.sole_and_right)),
        _line("two detectable effects: both named", "85 %", scores.share_of(pairs, scores.all_named)),
        _line("  taken, whatever the verdict", "", scores.share_of(pairs, scores.all_listed)),
        _line("outside the library and material: unexplained", "85 %",
              scores.share_of(foreign, scores.owned_up)),
        _line("parameters within their 95 % interval", "92-98 %",
              scores.covered(z for zs in scores.all_deviations(done).values() for z in zs)),
    ]  # fmt: skip
    return "\n".join([f"{'':48}{'goal':>8}  {'reached':>16}  95 % interval", *lines, *_ratios(done)])


def _ratios(records: Sequence[Record]) -> list[str]:
    after = [x for x, _ in scores.after_to_oracle(records)]
    width = scores.width_to_oracle(records)
    within = Share(sum(x <= 1.10 for x in after), len(after))
    middle, high = scores.quantiles(after, (0.5, 0.9))
    wide, widest = scores.quantiles(width, (0.5, 0.9))
    return [
        _line("error after at most 1.10 x the oracle's", "", within)
        + f"  median {middle:.2f}, 90 % {high:.2f}",
        f"{'standard errors over those of the true structure':48}{'1.5':>8}"
        f"  median {wide:.2f}, 90 % {widest:.2f}",
    ]


def _line(what: str, goal: str, share: Share) -> str:
    low, high = share.interval
    value = f"{100 * share.value:5.1f} %" if share.of else "     –"
    misses = " ".join(map(str, share.misses[:12])) + (" …" if len(share.misses) > 12 else "")
    return (
        f"{what:48}{goal:>8}  {share.good:4d}/{share.of:<4d}{value}  {100 * low:5.1f}-{100 * high:5.1f} %"
        + (f"  not: {misses}" if misses else "")
    )


def timing(records: Sequence[Record]) -> str:
    """Seconds per case."""
    wall = scores.quantiles([r["seconds"] for r in records if "seconds" in r], (0.5, 0.9, 1.0))
    cpu = scores.quantiles([r["cpu_seconds"] for r in records if "cpu_seconds" in r], (0.5, 0.9, 1.0))
    return (
        f"seconds per case: median {wall[0]:.1f}, 90 % {wall[1]:.1f}, longest {wall[2]:.1f}"
        f" (processor: {cpu[0]:.1f}, {cpu[1]:.1f}, {cpu[2]:.1f})"
    )


def true_name(record: Record) -> str:
    """Return what a confusion matrix calls the truth."""
    return " + ".join(sorted(_short(t) for t in record.get("truth", ()))) or "(clean)"


def _short(entry: Record) -> str:
    detail = entry.get("stream") or entry.get("form")
    return f"{entry['name']} ({detail})" if detail else str(entry["name"])


def said(record: Record) -> str:
    """Return what was said in a few words."""
    if record["status"] != "ok":
        return "failed"
    names = []
    for n in record["named"]:
        other = f" ~ {', '.join(n['look_alikes'])}" if n["look_alikes"] else ""
        names.append(label_of(n) + other)
    return f"{record['verdict']}: {' + '.join(names)}" if names else str(record["verdict"])


def confusion(records: Sequence[Record]) -> str:
    """Return true effect against verdict."""
    verdicts = ("adequate", "explained", "ambiguous", "unexplained", "failed")
    rows: dict[str, Counter[str]] = {}
    for r in records:
        if "kind" not in r:
            continue
        row = rows.setdefault(
            true_name(r) if r["kind"] in ("clean", "one", "outside") else "(two)", Counter()
        )
        row[r["verdict"] if r["status"] == "ok" else "failed"] += 1
        if r["status"] == "ok" and r["kind"] in ("one", "two"):
            row["right"] += scores.sole_and_right(r)
            row["among"] += all(named_among(t, r) for t in r["truth"])
            row["detectable"] += scores.detectable(r)
            row["wrong"] += bool(r["named"]) and not all(named_among(t, r) for t in r["truth"])
    columns = (*verdicts, "detectable", "right", "among", "wrong")
    head = f"{'truth':40}" + "".join(f"{c:>12}" for c in columns)
    lines = [
        f"{name:40}" + "".join(f"{row[c] or '·':>12}" for c in columns) for name, row in sorted(rows.items())
    ]
    return "\n".join([head, *lines])


def power(records: Sequence[Record]) -> str:
    """Return detection against strength (0 weak, 1 strong), for each effect drawn alone."""
    thirds = ("weak", "middle", "strong")
    cells: dict[str, dict[str, list[bool]]] = {}
    for r in scores.of_kind(records, "one"):
        if r["status"] == "ok":
            third = thirds[min(int(3 * r["strengths"][0]), 2)]
            cells.setdefault(true_name(r), {}).setdefault(third, []).append(scores.all_named(r))
    lines = [
        f"{name:40}" + "".join(f"{_of(row.get(t, [])):>12}" for t in thirds)
        for name, row in sorted(cells.items())
    ]
    return "\n".join([f"{'named or look-alike, by size':40}" + "".join(f"{t:>12}" for t in thirds), *lines])


def _of(good: Sequence[bool]) -> str:
    return f"{sum(good)}/{len(good)}" if good else "·"


def intervals(records: Sequence[Record]) -> str:
    """Coverage of the 95 % intervals by parameter, with the median and the widest deviation."""
    lines = []
    for name, z in sorted(scores.all_deviations(records).items()):
        share, (middle, widest) = scores.covered(z), (scores.quantiles(z, (0.5,))[0], max(z, key=abs))
        lines.append(f"{name:40}{share.good:6d}/{share.of:<4d}  median {middle:+6.2f}  widest {widest:+8.1f}")
    return "\n".join(["(value - truth) / standard error, within 1.96", *lines])


def calibration(records: Sequence[Record]) -> str:
    """Claimed p-values of clean campaigns against how often they come."""
    clean = [r for r in scores.of_kind(records, "clean") if r["status"] == "ok"]
    lines = []
    for level in LEVELS:
        share = scores.share_of(clean, _at_most(level))
        low, high = share.interval
        lines.append(f"{level:10.2f}{share.value:10.2f}  ({low:.2f}-{high:.2f})")
    return "\n".join(
        ["claimed    true false-alarm rate (least p of the first round, clean campaigns)", *lines]
    )


def _at_most(level: float) -> Callable[[Record], bool]:
    return lambda record: scores.least_p(record) <= level


def failures(records: Iterable[Record]) -> str:
    """Cases without an answer, and why."""
    lines = [f"{r['seed']:8d}  {r.get('kind', '?'):8}  {r.get('why', '')}" for r in records if r.get("why")]
    return "\n".join(["no answer, or no oracle:", *lines]) if lines else ""


def each(record: Record) -> str:
    """One line for one case, as it comes."""
    raises = "/".join(f"{e['raises']:.2f}" for e in scores.oracle_effects(record))
    chi2 = [record.get("chi2", {}).get("after", math.nan), record.get("oracle", {}).get("chi2", math.nan)]
    raises += f" chi2 {chi2[0]:.2f}:{chi2[1]:.2f}"
    return (
        f"{record['seed']:8d} {record.get('seconds', 0):6.1f} s  {record.get('vessel', ''):10}"
        f"{true_name(record):48} {raises:24} -> {said(record)} {record.get('why', '')}"
    )
