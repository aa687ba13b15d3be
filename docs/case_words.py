"""The sentences of the case studies that carry numbers: what was found, what became of the errors, what is left."""

from __future__ import annotations

import numpy as np
from case_facts import CHANNELS, Case, short

from validate.diagnosis import Verdict
from validate.report import words
from validate.report.labels import advice_words, in_words

#: An error counts as changed from this share on.
CHANGE = 0.02


def verdict(case: Case) -> str:
    """The verdict, what was taken, and the advice."""
    d = case.report["diagnosis"]
    fitted = {(e.name, e.input): e for e in case.model.effects}
    lines = [f"**{d['verdict'].capitalize()}.** {meaning(d['verdict'])}", ""]
    for entry in d["effects"]:
        effect = fitted.get((entry["name"], entry["input"]))
        what = words.effect_words(effect) if effect else in_words(entry["name"])
        alike = words.joined([in_words(x) for x in entry["look_alikes"]], "or")
        tail = (
            f"on these data {alike} would look the same"
            if alike
            else "nothing else in the library looks like it here"
        )
        lines.append(f"- Taken: {what}; p {words.probability(entry['p_value'])}; {tail}.")
    if not d["effects"]:
        lines.append("- No effect was taken.")
    if any(e["name"] == "input_wiring" for e in d["effects"]) and worse(case):
        lines.append(
            "- The runs held back are predicted worse with it (below). Any other effect would be taken back for that; "
            "a wiring stands, because it was found by a test of its own that needs no prediction."
        )
    if d["advice"]:
        lines.append(f"- Advice: {advice_words(d['advice'])}")
    return "\n".join(lines)


def worse(case: Case) -> bool:
    """Whether the runs held back are predicted worse with what was taken, each channel by its own spread."""
    pooled = [case.report["validation"][w]["channels"] for w in ("before", "after")]
    before, after = (sum((c[k]["nrmse"] or 0.0) ** 2 for k in CHANNELS if k in c) for c in pooled)
    return after > before


def meaning(name: str) -> str:
    """The verdict's sentence."""
    return Verdict[name.upper()].value


def outcome(case: Case) -> str:
    """What became of each channel on unseen runs, in sentences that spare nothing."""
    said = changes(case) if case.two else as_declared(case)
    return " ".join(s for s in (*said, weak_points(case), drift(case)) if s)


def as_declared(case: Case) -> list[str]:
    """Where nothing was taken: the weakest run, and the position."""
    begin = "Nothing was taken, so there is no before and after; these are the errors of the declared model."
    scores = [(s["r2"], c, n) for n in case.names("validate") for c, s in case.scores("after", n).items()]
    known = [s for s in scores if s[0] is not None]
    if not known:
        return [begin]
    r2, channel, log = min(known)
    off = case.report["validation"]["after"]["position_rmse"]
    place = "" if off is None else f" The position is off by {words.number(off)} m (root mean square)."
    where = f"{CHANNELS[channel][0]} in run `{short(case.names())[log]}`"
    return [f"{begin} The weakest is {where}, with an R² of {words.share(r2)}.{place}"]


def changes(case: Case) -> list[str]:
    """How each error changed, pooled; and in how many runs."""
    v, said = case.report["validation"], []
    for c, (what, unit, scale) in CHANNELS.items():
        b, a = (v[w]["channels"].get(c, {}).get("rmse") for w in ("before", "after"))
        if b and a is not None:
            said.append(f"that of {what} {moved(b, a, scale)} {unit}")
    b, a = (v[w]["position_rmse"] for w in ("before", "after"))
    track = f"; that of the position {moved(b, a, 1.0)} m" if b and a is not None else ""
    together = words.joined(said).removeprefix("that ")
    return [f"On the runs held back, taken together, the error {together}{track}.", better_runs(case)]


def moved(before: float, after: float, scale: float) -> str:
    """``falls from … to …``, with a rise in bold."""
    last = words.number(after * scale)
    if abs(after / before - 1) < CHANGE:
        return f"stays at {last}"
    return f"{'falls' if after < before else '**rises**'} from {words.number(before * scale)} to {last}"


def drift(case: Case) -> str:
    """The mean error of the yaw rate, which velocities hardly show and the heading adds up."""
    mean = {role: mean_error(case, "r", case.names(role)) for role in ("identify", "validate")}
    if not all(np.isfinite(m) for m in mean.values()):
        return ""
    heading = case.report["validation"]["after"]["heading_rmse"]
    said = (
        "" if heading is None else f": it is off by {words.number(np.degrees(heading))}° (root mean square)"
    )
    return (
        f"The mean of measured minus predicted yaw rate is {signed(mean['validate'])} on the runs held back and "
        f"{signed(mean['identify'])} on those that identify. A mean hardly shows in an R², but the heading adds it "
        f"up{said}."
    )


def mean_error(case: Case, channel: str, names: list[str]) -> float:
    """Mean of measured minus predicted, SI, over some runs."""
    runs = [case.runs[n] for n in names]
    return float(np.nanmean(np.concatenate([(t[channel] - t[f"{channel}_after"]).to_numpy() for t in runs])))


def signed(rate: float) -> str:
    return f"{np.degrees(rate):+.3f} °/s".replace("-", "−")


def better_runs(case: Case) -> str:
    """In how many runs each channel improved."""
    counted = []
    for c, (what, _, _) in CHANNELS.items():
        pairs = [
            (case.scores("before", n).get(c), case.scores("after", n).get(c)) for n in case.names("validate")
        ]
        pairs = [
            (b["rmse"], a["rmse"])
            for b, a in pairs
            if b and a and b["rmse"] is not None and a["rmse"] is not None
        ]
        counted.append(f"{what} in {sum(a < (1 - CHANGE) * b for b, a in pairs)} of {len(pairs)}")
    return f"Run by run, it improves {words.joined(counted)}."


def weak_points(case: Case) -> str:
    """What stands against the result."""
    after = case.report["validation"]["after"]["channels"]
    poor = [
        what
        for c, (what, _, _) in CHANNELS.items()
        if (s := after.get(c)) and s["r2"] is not None and s["r2"] < 0
    ]
    if not poor:
        return ""
    return (
        f"An R² below zero ({words.joined(poor)}) means that the mean of the measurement would have been the better "
        "prediction: with such an error the model must not be used for that motion."
    )


def left(case: Case) -> str:
    """What stays unexplained, and what the residuals go with."""
    d = case.report["diagnosis"]
    share = words.joined(
        f"{CHANNELS[c][0]} {words.percent(s)}" for c, s in d["unexplained"].items() if c in CHANNELS
    )
    lines = [
        f"The structured part of the prediction error over half a minute, as a share of the motion itself: {share}."
    ]
    if d["rounds"]:
        with_what = correlates(d["rounds"][-1]["residual_tests"])
        lines.append(
            "Against the one-step residuals of the last round, the tests speak as follows: "
            + (
                f"{words.joined(with_what)}."
                if with_what
                else "with none of the quantities looked at do they go."
            )
        )
    return " ".join(lines)


def correlates(tests: list[dict]) -> list[str]:
    """``yaw rate with heading sin (correlation −0.32)``, strongest first, at most six."""
    found = [
        t
        for t in tests
        if not t["name"].startswith("whiteness") and t["p_value"] is not None and t["p_value"] < 0.01
    ]
    found.sort(key=lambda t: -abs(t["statistic"]))
    name = {"psi": "heading"} | {c: w for c, (w, _, _) in CHANNELS.items()}
    return [
        f"that of {name.get(t['channel'], t['channel'])} goes with {in_words(t['name'])} "
        f"(correlation {words.number(t['statistic'], 2)})"
        for t in found[:6]
    ]


def known(case: Case) -> str:
    """How many parameters the data give."""
    p = case.report["parameters"]
    unsure = [q["name"] for q in p if not q["identifiable"]]
    return f"Of {len(p)} coefficients the data give {len(p) - len(unsure)}" + (
        f"; not {words.joined(f'`{n}`' for n in unsure)}." if unsure else "."
    )


def made(case: Case) -> str:
    """What made the page."""
    r = case.report
    return (
        f"Made by Seatrial {r['seatrial_version']}: model `{r['model']}`, estimator `{r['estimator']}`, optimiser "
        f"`{r['optimiser']}`, seed {r['seed']}; {words.duration(r['timing_s']['total'])} from bytes to report."
    )
