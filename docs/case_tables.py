"""The tables of the case studies: every number on those pages comes from here or from the sentences beside it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from case_facts import CHANNELS, Case, short

from validate.report import words
from validate.report.labels import in_words

#: A prediction has run away where its error is so many times the spread of the measurement.
RUNAWAY, LOST = 10.0, "runs away"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], right: int = 1) -> str:
    """A Markdown table; all but the first ``right`` columns hold numbers."""
    rule = ["---"] * right + ["--:"] * (len(head) - right)
    lines = [head, rule, *([c.replace("|", "\\|") for c in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def vessel(case: Case) -> str:
    """What the campaign declares."""
    v, inputs = case.declared["vessel"], case.declared["inputs"]
    placed = {k: f", {along(p)}" for k, i in inputs.items() if (p := i.get("position"))}
    said = words.joined(f"`{k}` ({i['kind']}{placed.get(k, '')})" for k, i in inputs.items())
    return (
        f"{v['name']}, {v['length']:g} m long, {v['beam']:g} m wide; inputs {said}; the model declared is "
        f"[`{case.report['model']}`](../reference/models.md)."
    )


def along(position: Sequence[float]) -> str:
    """Where an actuator sits, in words."""
    x, y = position
    ends = (x, "forward" if x > 0 else "aft"), (y, "starboard" if y > 0 else "port")
    return words.joined(f"{abs(value):g} m {side}" for value, side in ends if value) or "at the origin"


def logs(case: Case) -> str:
    """What was read, and what was wrong with it."""
    rows = []
    name = short(case.names())
    for e in case.report["logs"]:
        count = {k: sum(s[k] for s in e["signals"]) for k in ("gaps", "outliers")}
        role = "held back" if e["role"] == "validate" else "identifies"
        run = case.runs[e["path"]]
        speed = f"{run['u'].min():.2f} to {run['u'].max():.2f}".replace("-", "−")
        rows.append([f"`{name[e['path']]}`", role, words.duration(e["duration_s"]), speed,
                     str(count["gaps"]), str(count["outliers"])])  # fmt: skip
    return table(["run", "role", "length", "surge, m/s", "gaps", "samples set aside"], rows, 2)


def rmse(score: dict | None, scale: float) -> str:
    value = score["rmse"] if score else None
    return words.number(None if value is None else value * scale)


def unseen(case: Case) -> str:
    """Errors on the runs held back, pooled and run by run."""
    name = short(case.names())
    pooled = {w: case.report["validation"][w]["channels"] for w in ("before", "after")}
    runs = [("**all**", pooled["before"], pooled["after"])]
    runs += [
        (f"`{name[n]}`", case.scores("before", n), case.scores("after", n)) for n in case.names("validate")
    ]
    return scores(runs, case.two)


def seen(case: Case) -> str:
    """The same on the runs that identify."""
    name = short(case.names())
    runs = [
        (f"`{name[n]}`", case.scores("before", n), case.scores("after", n)) for n in case.names("identify")
    ]
    return scores(runs, case.two)


def scores(runs: list[tuple[str, dict, dict]], two: bool) -> str:
    """RMSE and R² per channel, before and after where there are two models."""
    head, rows = ["run"], []
    for c, (what, unit, _) in CHANNELS.items():
        head += [f"{c}, {what}: RMSE, {unit}", f"R² of {c}"]
    for name, before, after in runs:
        row = [name]
        for c, (_, _, scale) in CHANNELS.items():
            b, a = before.get(c), after.get(c)
            row.append(f"{rmse(b, scale)} → {rmse(a, scale)}" if two else rmse(a, scale))
            last = words.share(a["r2"] if a else None)
            row.append(f"{words.share(b['r2'] if b else None)} → {last}" if two else last)
        rows.append(row)
    return table(head, rows)


def candidates(case: Case) -> str:
    """The best of what was tried, in the first round and in the last."""
    rounds = case.report["diagnosis"]["rounds"]
    if not rounds:
        return "No candidate was tried."
    parts, name = [], short(case.names())
    if any(e["name"] == "input_wiring" for e in case.report["diagnosis"]["effects"]):
        parts.append("The wiring was settled before these rounds, by a test of its own.")
    for k in dict.fromkeys((0, len(rounds) - 1)):
        r = rounds[k]
        tried = [c for c in r["candidates"] if not (c["note"] or "").startswith("not refitted")][:6]
        rows = [
            [
                candidate(c, name),
                words.number(c["evidence"]),
                words.probability(c["p_value"]).replace(" ", "\u00a0"),
                change(c, case),
            ]
            for c in tried
        ]
        end = f"{in_words(r['accepted'])} taken" if r["accepted"] else "nothing taken"
        parts.append(f"Round {k + 1} of {len(rounds)}, {len(r['candidates'])} candidates, {end}:")
        parts.append(
            table(["candidate", "evidence", "p", "error u, v, r on parts left out of the fit"], rows)
        )
    return "\n\n".join(parts)


def candidate(c: dict, name: dict[str, str]) -> str:
    """A candidate's label with short names of logs."""
    label = in_words(c["label"])
    for path, stem in name.items():
        label = label.replace(path, stem)
    return label.replace(" and ", ", ")


def change(c: dict, case: Case) -> str:
    """Cross-validated errors before and after."""
    out = []
    for k, (_, unit, scale) in CHANNELS.items():
        if k in c["rmse_before"]:
            b, a = (tame(c[f"rmse_{w}"][k], scale, RUNAWAY * case.spread(k)) for w in ("before", "after"))
            out.append(f"{b} → {a} {unit}" if a != b or a != LOST else LOST)
    return LOST if out and set(out) == {LOST} else "; ".join(out)


def tame(value: float | None, scale: float, most: float) -> str:
    """An error; in words where the prediction ran away, of which the report has no number."""
    return words.number(value * scale) if value is not None and value < most else LOST
