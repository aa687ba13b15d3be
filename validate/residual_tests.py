"""Tests of the residuals: whether they are white, and if not, what they go with."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import stats

from identify import kernel
from identify.fitted import Fitted
from identify.stretch import Stretch
from validate.diagnosis import ResidualTest
from validate.tables import held_at

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Errors are averaged over this time before they are compared with anything, s.
BIN = 2.0
_STREAMS = ((kernel.POSITION, "u"), (kernel.POSITION, "v"), (kernel.YAW_RATE, "r"), (kernel.HEADING, "psi"))


def residual_tests(fitted: Fitted) -> tuple[ResidualTest, ...]:
    """Whiteness of each stream's errors, and their dependence on heading, speed, time and inputs."""
    return tuple(test for kind, channel in _STREAMS for test in _of_channel(fitted, kind, channel))


def _of_channel(fitted: Fitted, kind: int, channel: str) -> Iterator[ResidualTest]:
    bins = _binned(fitted, kind, channel)
    if len(bins["error"]) < 20:
        return
    yield _whiteness(channel, bins["error"], bins["window"])
    for name in [n for n in bins if n not in ("error", "window")]:
        yield _dependence(name, channel, bins["error"], bins[name])


def _binned(fitted: Fitted, kind: int, channel: str) -> dict[str, FloatArray]:
    """Errors averaged over short bins (body axes for positions), with what they are compared with."""
    columns: dict[str, list[FloatArray]] = {}
    for number, (t, e, stretch) in enumerate(_errors(fitted, kind)):
        place = np.floor((t - t[0]) / BIN).astype(int)
        middle = np.array([t[place == k].mean() for k in np.unique(place)])
        state = np.column_stack([np.interp(middle, stretch.grid, c) for c in stretch.states.T])
        mean = np.array([e[place == k].mean(axis=0) * np.sqrt((place == k).sum()) for k in np.unique(place)])
        if kind == kernel.POSITION:
            c, s = np.cos(state[:, 2]), np.sin(state[:, 2])
            error = c * mean[:, 0] + s * mean[:, 1] if channel == "u" else -s * mean[:, 0] + c * mean[:, 1]
        else:
            error = mean[:, 0]
        made = {
            "error": error, "window": np.full(len(error), float(number)), "heading cos": np.cos(state[:, 2]),
            "heading sin": np.sin(state[:, 2]), "speed": np.hypot(state[:, 3], state[:, 4]), "yaw rate": state[:, 5],
            "time": stretch.campaign_time + middle - stretch.start,
        }  # fmt: skip
        made |= {f"input {n}": held_at(m, middle) for n, m in stretch.inputs.items()}
        for name, values in made.items():
            columns.setdefault(name, []).append(values)
    return {n: np.concatenate(v) for n, v in columns.items()} if columns else {"error": np.zeros(0)}


def _errors(fitted: Fitted, kind: int) -> Iterator[tuple[FloatArray, FloatArray, Stretch]]:
    """Per window: times, errors in units of white noise, and the stretch that the window is in."""
    problem, rows = fitted.problem, 2 if kind in (kernel.POSITION, kernel.VELOCITY) else 1
    for w, residual in zip(problem.windows, fitted.solution.moments.residuals, strict=True):
        stretch = problem.stretches[w.stretch]
        mine = stretch.samples.kind[w.samples] == kind
        if mine.sum() > 8:
            yield stretch.samples.t[w.samples][mine], residual[mine, :rows] * problem.inflation[kind], stretch


def _whiteness(channel: str, error: FloatArray, window: FloatArray) -> ResidualTest:
    """Ljung-Box over four bins, within windows."""
    n, total = len(error), 0.0
    for lag in range(1, 5):
        same = window[lag:] == window[:-lag]
        r = np.sum(error[lag:][same] * error[:-lag][same]) / np.sum(error**2)
        total += r * r / max(same.sum(), 1)
    statistic = float(n * (n + 2) * total)
    return ResidualTest("whiteness (Ljung-Box)", channel, statistic, float(stats.chi2.sf(statistic, 4)))


def _dependence(name: str, channel: str, error: FloatArray, other: FloatArray) -> ResidualTest:
    """Correlation with something, by its rank (no outlier decides)."""
    if np.ptp(other) == 0:
        return ResidualTest(name, channel, 0.0, 1.0)
    found = stats.spearmanr(np.column_stack([error, other]))
    return ResidualTest(name, channel, float(found.statistic), float(found.pvalue))
