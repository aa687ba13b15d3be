"""What the data can and cannot identify, said before anything is fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from preprocess.trial import FloatArray, Step, Trial

#: Columns of a scaled regression beyond this condition number are collinear for practical purposes.
COLLINEAR = 1e3
#: Share of such a combination from which on a column takes part in it.
TAKES_PART = 0.05
LEAST_COHERENCE = 0.3
EQUATIONS = {"u": "surge", "v, r": "sway and yaw"}


@dataclass(frozen=True)
class Regression:
    """One equation: its terms, its rank, and the condition number of its scaled columns.

    ``absent`` are the terms that are zero throughout, ``alike`` those that the rest can hardly be told apart by.
    """

    equation: str
    terms: tuple[str, ...]
    rank: int
    condition: float
    absent: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()


@dataclass(frozen=True)
class Excitation:
    """What a set of trials excites.

    Attributes
    ----------
    ranges : mapping of name to (low, high)
        5th and 95th percentile of u, v, r (SI) and of each input.
    levels : mapping of input to int
        How many distinct levels it was used at (of twenty over its range).
    coherence : mapping of input to float
        Largest coherence with the surge or yaw acceleration, where the input has most of its power.
    regressions : tuple of Regression
    headings : float
        Span of headings sailed, rad, 2π at most.
    sentences : tuple of str
        What follows, for the report.
    """

    ranges: Mapping[str, tuple[float, float]]
    levels: Mapping[str, int]
    coherence: Mapping[str, float]
    regressions: tuple[Regression, ...]
    headings: float
    sentences: tuple[str, ...]


def excitation(trials: Sequence[Trial]) -> Excitation:
    """Judge what trials excite, all together.

    Parameters
    ----------
    trials : sequence of Trial
        The identify trials of one vessel.
    """
    grids = [_grid(t) for t in trials]
    names = list(grids[0]) if grids else []
    pooled = {k: np.concatenate([g[k] for g in grids]) for k in names}
    inputs = [i.name for i in trials[0].inputs_declared] if trials else []
    ranges = {k: _range(pooled[k]) for k in ("u", "v", "r", *inputs)}
    levels = {k: _levels(pooled[k]) for k in inputs}
    coherence = {k: _coherence(grids, k) for k in inputs}
    regressions = tuple(_regression(pooled, inputs))
    headings = _headings(pooled["psi"])
    said = tuple(_sentences(ranges, levels, coherence, regressions, headings))
    return Excitation(ranges, levels, coherence, regressions, headings, said)


def with_excitation(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """The trials, the first to identify on with what all of them excite in its history and findings."""
    used = [k for k, t in enumerate(trials) if t.role == "identify" and t.segments]
    if not used:
        return tuple(trials)
    found = excitation([trials[k] for k in used])
    first = trials[used[0]]
    said = tuple(f"The logs to identify on: {s}" for s in found.sentences)
    step = Step("excitation", _arguments(found))
    cut = tuple(s for s in first.history[-1:] if s.action == "cut")  # stays last
    history = (*first.history[: len(first.history) - len(cut)], step, *cut)
    first = replace(first, findings=(*first.findings, *said), history=history)
    return tuple(first if k == used[0] else t for k, t in enumerate(trials))


def _arguments(found: Excitation) -> dict[str, object]:
    return {
        "ranges": {k: list(v) for k, v in found.ranges.items()},
        "levels": dict(found.levels),
        "coherence": dict(found.coherence),
        "headings": found.headings,
        "regressions": {
            x.equation: {"terms": list(x.terms), "rank": x.rank, "condition": min(x.condition, 1e300)}
            for x in found.regressions
        },
    }


def _grid(trial: Trial) -> dict[str, FloatArray]:
    """States and inputs of a trial at most every 0.2 s, inside its segments."""
    states = trial.states.dropna(subset=["u", "r", "psi"])
    if len(states) > 10:
        states = states.iloc[:: max(1, int(0.2 * len(states) / max(np.ptp(states["t"]), 0.2)))]
    out: dict[str, FloatArray] = {
        k: states[k].to_numpy(dtype=float) for k in ("t", "u", "v", "r", "psi", "du", "dr")
    }
    for name, m in trial.inputs.items():
        out[name] = np.interp(out["t"], m.t, m.value) if len(m.t) else np.zeros(len(states))
    return out


def _range(x: FloatArray) -> tuple[float, float]:
    low, high = np.percentile(x, [5.0, 95.0]) if len(x) else (0.0, 0.0)
    return float(low), float(high)


def _levels(x: FloatArray) -> int:
    if not len(x) or np.ptp(x) == 0.0:
        return 1
    counts, _ = np.histogram(x, bins=20)
    return int((counts > 0.02 * len(x)).sum())


def _headings(psi: FloatArray) -> float:
    if not len(psi):
        return 0.0
    counts, _ = np.histogram(np.mod(psi, 2.0 * np.pi), bins=36, range=(0.0, 2.0 * np.pi))
    return float(2.0 * np.pi * (counts > 0.003 * len(psi)).mean())


def _coherence(grids: Sequence[Mapping[str, FloatArray]], name: str) -> float:
    """Largest coherence of an input with u̇ or ṙ, weighted by the input's power, over the trials."""
    return max((max(_pair(g[name], g[k]) for k in ("du", "dr")) for g in grids), default=0.0)


def _pair(x: FloatArray, y: FloatArray) -> float:
    from scipy.signal import coherence, periodogram

    if len(x) < 64 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    size = min(256, len(x) // 4)
    with np.errstate(invalid="ignore"):  # at frequencies at which nothing happened
        c = np.nan_to_num(coherence(x, y, nperseg=size)[1])
    _, p = (
        periodogram(x, nfft=2 * (len(c) - 1), detrend="constant")
        if len(x) <= 2 * (len(c) - 1)
        else _power(x, size)
    )
    return float((c * p[: len(c)]).sum() / max(p[: len(c)].sum(), 1e-300))


def _power(x: FloatArray, size: int) -> tuple[FloatArray, FloatArray]:
    from scipy.signal import welch

    f, p = welch(x, nperseg=size)
    return np.asarray(f), np.asarray(p)


def _regression(g: Mapping[str, FloatArray], inputs: Sequence[str]) -> list[Regression]:
    u, v, r = g["u"], g["v"], g["r"]
    forces = {f"|{k}|{k}": np.abs(g[k]) * g[k] for k in inputs}
    surge = {"u": u, "|u|u": np.abs(u) * u, "vr": v * r, "r²": r * r, **forces}
    turn = {
        "uv": u * v,
        "ur": u * r,
        "|v|v": np.abs(v) * v,
        "|v|r": np.abs(v) * r,
        "1": np.ones_like(u),
        **forces,
    }
    return [_rank("u", surge), _rank("v, r", turn)]


def _rank(equation: str, terms: Mapping[str, FloatArray]) -> Regression:
    columns = np.column_stack(list(terms.values()))
    scale = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(scale > 0.0, scale, 1.0)
    singular = np.linalg.svd(scaled, compute_uv=False) if len(columns) else np.zeros(len(terms))
    rank = int((singular > singular[0] / 1e8).sum()) if len(singular) and singular[0] > 0 else 0
    condition = float(singular[0] / max(singular[-1], 1e-300)) if len(singular) else float("inf")
    absent = tuple(name for name, size in zip(terms, scale, strict=True) if size == 0.0)
    there = [name for name in terms if name not in absent]
    alike = _alike(scaled[:, scale > 0.0], there) if condition > COLLINEAR and len(columns) else ()
    return Regression(equation, tuple(terms), rank, condition, absent, alike)


def _alike(columns: FloatArray, names: Sequence[str]) -> tuple[str, ...]:
    """Terms that take part in what is next to nothing of these columns of one size: none is zero."""
    _, singular, directions = np.linalg.svd(columns, full_matrices=False)
    weak = directions[singular * COLLINEAR < singular[0]]
    share = np.abs(weak).max(axis=0, initial=0.0)
    return tuple(n for n, x in zip(names, share, strict=True) if x > TAKES_PART)


def _sentences(
    ranges: Mapping[str, tuple[float, float]],
    levels: Mapping[str, int],
    coherence: Mapping[str, float],
    regressions: Sequence[Regression],
    headings: float,
) -> list[str]:
    out = []
    out += [
        f"{k} was held at one value: what it does cannot be identified." for k, n in levels.items() if n <= 1
    ]
    weak = [k for k, c in coherence.items() if levels[k] > 1 and c < LEAST_COHERENCE]
    out += [f"{k} shows little in the motion (coherence {coherence[k]:.2f})." for k in weak]
    low, high = ranges["u"]
    if high - low < 0.15 * max(abs(low), abs(high), 1e-9):
        out.append("Nearly one speed: resistance and thrust cannot be told apart.")
    if headings < np.pi:
        out.append(
            "Less than half of the compass was sailed: a current can look like a heading bias or like wind."
        )
    return out + [sentence for x in regressions for sentence in _told_apart(x)]


def _told_apart(x: Regression) -> list[str]:
    """What the columns of an equation say, in words."""
    usual, out = f"Of the usual terms of {EQUATIONS[x.equation]}", []
    if x.absent:
        out.append(f"{usual}, {_joined(x.absent)} {'is' if len(x.absent) == 1 else 'are'} zero throughout.")
    if x.alike:
        hardly = "cannot" if x.rank < len(x.terms) - len(x.absent) else "can hardly"
        out.append(f"{usual}, {_joined(x.alike)} {hardly} be told apart.")
    return out


def _joined(names: Sequence[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
