"""Looks at the measurements that need no model: which way the boat turned, and how far a zigzag overshoots."""

from __future__ import annotations

import numpy as np
import pandas as pd
from case_facts import Case, short
from case_tables import table

from validate.report import words

#: Commands, yaw rates (rad/s) and speeds (m/s) below which a sign says nothing.
COMMAND, TURN, SPEED = 0.1, 0.05, 0.5
#: Share of the time from which on the boat turns as declared, or against it.
MOSTLY = 0.8
#: A yaw rate is not followed beyond this, rad/s.
WILD = 3.0
HEAD = (
    "run",
    "clear command to turn, s",
    "turning the declared way",
    "going the declared way",
    "course less heading",
)


def moment(case: Case, run: pd.DataFrame) -> np.ndarray:
    """Moment of the declared thrusters about the origin, positive to starboard, in units of command times metres."""
    arms = {k: -i["position"][1] for k, i in case.declared["inputs"].items() if i["kind"] == "thruster"}
    return sum(arm * run[k].to_numpy() * np.abs(run[k].to_numpy()) for k, arm in arms.items())


def turned_as_declared(case: Case, run: pd.DataFrame) -> tuple[float, float]:
    """Seconds in which commands say clearly which way to turn and the boat turns, and the share that agrees."""
    m, r = moment(case, run), run["r"].to_numpy()
    arm = max(abs(i["position"][1]) for i in case.declared["inputs"].values())
    clear = np.isfinite(m + r) & (np.abs(m) > COMMAND * arm) & (np.abs(r) > TURN)
    seconds = float(clear.sum() * np.median(np.diff(run["t"])))
    return seconds, float(np.mean(np.sign(m[clear]) == np.sign(r[clear]))) if clear.any() else float("nan")


def went_as_declared(case: Case, run: pd.DataFrame) -> float:
    """Share of the time under a clear thrust and making way in which the boat goes where the thrust points."""
    thrust = sum(run[k].to_numpy() * np.abs(run[k].to_numpy()) for k in case.declared["inputs"])
    u = run["u"].to_numpy()
    clear = np.isfinite(thrust + u) & (np.abs(thrust) > COMMAND) & (np.abs(u) > SPEED)
    return float(np.mean(np.sign(thrust[clear]) == np.sign(u[clear]))) if clear.any() else float("nan")


def course_off_heading(run: pd.DataFrame) -> float:
    """Median of course over ground (from fixes alone) less heading while making way ahead, rad; NaN if never."""
    fixes = run.dropna(subset=["x_measured", "y_measured"])
    dx, dy, dt = (np.diff(fixes[c]) for c in ("x_measured", "y_measured", "t"))
    speed = np.hypot(dx, dy) / dt
    psi = 0.5 * (fixes["psi"].to_numpy()[1:] + fixes["psi"].to_numpy()[:-1])
    ahead = (
        np.isfinite(psi)
        & (speed > 2 * SPEED)
        & (0.5 * (fixes["u"].to_numpy()[1:] + fixes["u"].to_numpy()[:-1]) > SPEED)
    )
    off = np.angle(np.exp(1j * (np.arctan2(dy, dx) - psi)))[ahead]
    return float(np.median(off)) if len(off) > 5 else float("nan")


def turning(case: Case) -> str:
    """Table and sentence: does the boat turn to the side that the declared thrusters push it?"""
    name, rows, total, agreed = short(case.names()), [], 0.0, 0.0
    for n, run in case.runs.items():
        seconds, share = turned_as_declared(case, run)
        off, ahead = course_off_heading(run), went_as_declared(case, run)
        total += seconds
        agreed += seconds * (0.0 if np.isnan(share) else share)
        rows.append([f"`{name[n]}`", words.number(seconds, 2), words.percent(share), words.percent(ahead),
                     "–" if np.isnan(off) else f"{np.degrees(off):+.0f}°".replace("-", "−")])  # fmt: skip
    made = table(HEAD, rows)
    return f"{made}\n\n{wiring_sentence(agreed / total if total else float('nan'), total)}"


def wiring_sentence(share: float, seconds: float) -> str:
    """What the table says."""
    begin = (
        f"In all, the boat turned the declared way during {words.percent(share)} of {words.number(seconds)} s"
    )
    if np.isnan(share):
        return "No run has a clear command to turn."
    if share < 1 - MOSTLY:
        return (
            f"{begin}: it turns *against* the declaration. Where the course agrees with the heading, the compass is "
            "not to blame. Exchanging the two thrusters puts it right, and so would exchanging their sides; these "
            "data cannot tell which of the two the declaration has wrong."
        )
    if share > MOSTLY:
        return f"{begin}: the wiring is as declared."
    return f"{begin}: sometimes one way, sometimes the other, which neither wiring explains."


def yaw_rows(run: pd.DataFrame, case: Case, law: str, skegs: bool) -> np.ndarray:
    """Terms of ṙ along a run, (n, terms): r, r|r|, v, uv, moment of the thrusters, and |u|r if wanted."""
    thrust = {"quadratic": lambda c: c * np.abs(c), "linear": lambda c: c}[law]
    arms = {k: -i["position"][1] for k, i in case.declared["inputs"].items()}
    push = sum(arm * thrust(run[k].to_numpy()) for k, arm in arms.items())
    u, v, r = (run[c].to_numpy() for c in "uvr")
    return np.column_stack([r, r * np.abs(r), v, u * v, push, *([np.abs(u) * r] if skegs else [])])


def over_a_second(run: pd.DataFrame, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of the terms over a second, and by how much r changed in it: no derivative is needed."""
    h, r = float(np.median(np.diff(run["t"]))), run["r"].to_numpy()
    n = max(1, round(1.0 / h))
    sums = np.cumsum(rows, axis=0) * h
    left, right = sums[n:] - sums[:-n], r[n:] - r[:-n]
    ok = np.isfinite(left).all(axis=1) & np.isfinite(right)
    return left[ok], right[ok]


def followed(run: pd.DataFrame, case: Case, law: str, skegs: bool, c: np.ndarray) -> np.ndarray:
    """The yaw rate from its first value on, with u and v as measured."""
    h, r = float(np.median(np.diff(run["t"]))), run["r"].to_numpy()
    rest = yaw_rows(run, case, law, skegs)
    out, now, ahead = np.empty(len(r)), r[0], np.abs(run["u"].to_numpy())
    for k in range(len(r)):
        out[k] = now
        damping = c[0] + c[1] * abs(now) + (c[5] * ahead[k] if skegs else 0.0)
        now = np.clip(now + h * (damping * now + rest[k, 2:5] @ c[2:5]), -WILD, WILD)
    return out


def yaw_r2(case: Case, law: str, skegs: bool, role: str, c: np.ndarray) -> float:
    """R² of the yaw rate so followed over the runs with a role."""
    tables = [t for n in case.names(role) if len(t := case.trials[n].dropna(subset=list("uvr")))]
    error = np.concatenate([t["r"] - followed(t, case, law, skegs, c) for t in tables])
    return 1.0 - float(
        np.sum(error**2) / np.sum(np.concatenate([t["r"] - t["r"].mean() for t in tables]) ** 2)
    )


def yaw_forms(case: Case) -> str:
    """Yaw alone by least squares, under two laws of thrust, without and with a damping that grows with speed."""
    rows = []
    for law, skegs in (("quadratic", False), ("linear", False), ("quadratic", True), ("linear", True)):
        tables = [t for n in case.names("identify") if len(t := case.trials[n].dropna(subset=list("uvr")))]
        parts = [over_a_second(t, yaw_rows(t, case, law, skegs)) for t in tables]
        c = np.linalg.lstsq(
            np.vstack([p[0] for p in parts]), np.concatenate([p[1] for p in parts]), rcond=None
        )[0]
        form = "c|c|" if law == "quadratic" else "c"
        said = f"thrust ∝ {form}" + (", damping with |u|r" if skegs else "")
        rows.append([said, *(words.share(yaw_r2(case, law, skegs, role, c)) for role in ("identify", "validate")),
                     words.number(c[4])])  # fmt: skip
    head = [
        "yaw equation",
        "R² on the runs that identify",
        "R² on the runs held back",
        "effect of the declared moment",
    ]
    return table(head, rows)


def swings(rudder: np.ndarray) -> list[tuple[int, int]]:
    """Row of the second and every later execute, and the row of the one after it (or the end).

    An execute is the last row before the rudder leaves for the other side.
    """
    full = 0.9 * np.nanmax(np.abs(rudder))
    side = np.where(rudder > 0.4 * full, 1, np.where(rudder < -0.4 * full, -1, 0))
    there = np.flatnonzero(side)
    flips = there[1:][np.diff(side[there]) != 0]
    left = [
        max(k for k in range(flip) if abs(rudder[k]) >= full and side[k] == -side[flip]) for flip in flips
    ]
    return list(zip(left, [*left[1:], len(rudder) - 1], strict=True))


def overshoots(run: pd.DataFrame, column: str = "psi", most: int = 2) -> list[float]:
    """Overshoot angles, degrees: how far a heading goes on beyond the *measured* heading at the execute."""
    psi, other, rudder = (run[c].to_numpy() for c in ("psi", column, "rudder"))
    out = []
    for a, b in swings(rudder)[:most]:
        way = np.sign(run["r"].to_numpy()[a]) or 1.0
        reach = np.nanmax(way * (other[a : b + 1] - psi[a]))
        out.append(float(np.degrees(reach)))
    return out


def overshoot_table(case: Case) -> str:
    """First and second overshoot of the runs held back: measured, and predicted free-running."""
    name, rows, misses = short(case.names()), [], []
    ways = ["psi_before", "psi_after"] if case.two else ["psi_after"]
    for n in case.names("validate"):
        run = case.runs[n]
        measured, predicted = overshoots(run), [overshoots(run, w) for w in ways]
        row = [f"`{name[n]}`"]
        for k in range(2):
            row += [in_degrees(measured, k), " → ".join(in_degrees(p, k) for p in predicted)]
            if k < len(measured):
                misses.append(abs(predicted[-1][k] - measured[k]))
        rows.append(row)
    head = ["run", "first overshoot", "predicted", "second overshoot", "predicted"]
    said = f"\n\nThe predicted overshoot misses the measured one by {words.number(np.median(misses), 2)}° in the median, by {words.number(max(misses), 2)}° at worst."  # noqa: E501
    return table(head, rows) + (said if misses else "")


def in_degrees(values: list[float], k: int) -> str:
    return f"{values[k]:.1f}°".replace("-", "−") if k < len(values) else "–"
