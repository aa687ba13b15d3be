"""The track in plan view: north up, to scale, with the hull drawn along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from identify.fit import Fit
from preprocess.trial import FloatArray, Trial
from preprocess.vessel import Vessel
from validate.report.figures import Figure, column
from validate.report.svg import FINE, dots, limits_of, line, path, picture, text, tick_text, ticks, whole
from validate.report.thinning import IntArray, even, extremes

WIDTH, HEIGHT, EDGE = 420.0, 248.0, 14.0
MOST, HULLS, SHORTEST_HULL = 700, 9, 5.0


def hull_outline(vessel: Vessel) -> FloatArray:
    """Outline of a hull, (7, 2): forward and starboard of midships, m; closed, with a pointed bow."""
    a, b = vessel.length / 2, vessel.beam / 2
    return np.array([[a, 0], [0.55 * a, b], [-0.9 * a, b], [-a, 0.8 * b], [-a, -0.8 * b], [-0.9 * a, -b],
                     [0.55 * a, -b], [a, 0]])  # fmt: skip


def hulls_at(vessel: Vessel, x: FloatArray, y: FloatArray, psi: FloatArray) -> FloatArray:
    """Hull outlines in the earth frame, (n, 8, 2): north, east."""
    outline = hull_outline(vessel)
    c, s = np.cos(psi)[:, None], np.sin(psi)[:, None]
    north = x[:, None] + c * outline[:, 0] - s * outline[:, 1]
    east = y[:, None] + s * outline[:, 0] + c * outline[:, 1]
    return np.stack([north, east], axis=-1)


def arrows(fit: Fit) -> list[tuple[str, float, float]]:
    """Current and wind of the fit, as (name, speed m/s, direction rad that it flows or blows to)."""
    out = []
    for effect in fit.effects:
        values = {p.name: p.value for p in effect.parameters}
        if effect.name in ("current", "wind") and {"speed", "direction"} <= values.keys():
            turned = np.pi if effect.name == "wind" else 0.0
            out.append((effect.name, values["speed"], values["direction"] + turned))
    return out


@dataclass(frozen=True)
class Chart:
    """Metres to pixels: east to the right, north up, one scale."""

    east: float
    north: float
    scale: float

    def pixels(self, north: FloatArray, east: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions in the picture."""
        return EDGE + (east - self.east) * self.scale, HEIGHT - EDGE - (north - self.north) * self.scale


def chart_of(tracks: list[tuple[FloatArray, FloatArray]], measured: int, margin: float) -> Chart:
    """A chart that shows the first ``measured`` tracks whole and the others as far as they stay near."""
    north = limits_of([t[0] for t in tracks[:measured]], [t[0] for t in tracks[measured:]], reach=0.5)
    east = limits_of([t[1] for t in tracks[:measured]], [t[1] for t in tracks[measured:]], reach=0.5)
    high, wide = north[1] - north[0] + 2 * margin, east[1] - east[0] + 2 * margin
    scale = min((WIDTH - 2 * EDGE) / wide, (HEIGHT - 2 * EDGE) / high)
    spare_e = ((WIDTH - 2 * EDGE) / scale - wide) / 2
    spare_n = ((HEIGHT - 2 * EDGE) / scale - high) / 2
    return Chart(east[0] - margin - spare_e, north[0] - margin - spare_n, scale)


def plan_figure(
    name: str, log: str, table: pd.DataFrame, trials: list[Trial], fit: Fit, two: bool
) -> Figure | None:
    """The track of one log: measured and predicted, raw fixes with outliers crossed, the hull to scale."""
    found = {s: (column(table, f"x{s}"), column(table, f"y{s}")) for s in ("", "_before", "_after")}
    tracks = {s: (x, y) for s, (x, y) in found.items() if x is not None and y is not None}
    if "" not in tracks:
        return None
    if not two:
        tracks.pop("_before", None)
    chart = chart_of(list(tracks.values()), 1, 0.6 * fit.vessel.length)
    drawn = _track(chart, *tracks[""], "smooth") + _fixes(chart, trials)
    for style in ("before", "after"):
        if f"_{style}" in tracks:
            drawn += _track(chart, *tracks[f"_{style}"], style)
    drawn += _hulls(chart, table, fit.vessel)
    frame = f'<rect class="frame" x="1" y="1" width="{WIDTH - 2:.0f}" height="{HEIGHT - 2:.0f}"/>'
    clip = f'<clipPath id="{name}"><rect width="{WIDTH:.0f}" height="{HEIGHT:.0f}"/></clipPath>'
    body = f'{clip}{frame}<g clip-path="url(#{name})"><g transform="scale(.1)">{drawn}</g></g>'
    body += _scale_bar(chart) + _north(chart) + _flows(chart, fit)
    label = f"track of {log} in plan view, north up: measured and predicted"
    return Figure("Track, north up", picture(WIDTH, HEIGHT, label, body))


def _track(chart: Chart, x: FloatArray, y: FloatArray, style: str) -> str:
    rows = np.union1d(extremes(x, MOST), extremes(y, MOST))
    px, py = chart.pixels(x[rows], y[rows])
    return f'<path class="{style}" d="{path(px, py)}"/>'


def _fixes(chart: Chart, trials: list[Trial]) -> str:
    out = ""
    for trial in trials:
        fix = trial.measurements.get("position")
        if fix is None or fix.value.ndim != 2:
            continue
        px, py = chart.pixels(fix.value[:, 0], fix.value[:, 1])
        good = np.flatnonzero(fix.good)
        rows = good[even(len(good), MOST)]
        out += f'<path class="raw" d="{dots(px[rows], py[rows])}"/>'
        bad = np.flatnonzero(~fix.good)
        out += f'<path class="outlier" d="{crosses(px[bad[:MOST]], py[bad[:MOST]])}"/>'
    return out


def crosses(px: FloatArray, py: FloatArray, arm: float = 3.0) -> str:
    """The ``d`` of a cross at each point."""
    ok = np.isfinite(px) & np.isfinite(py)
    x, y = whole(px[ok]), whole(py[ok])
    a = round(arm * FINE)
    corner = zip((x - a).tolist(), (y - a).tolist(), strict=True)
    return "".join(f"M{p} {q}l{2 * a} {2 * a}m0 {-2 * a}l{-2 * a} {2 * a}" for p, q in corner)


def _hulls(chart: Chart, table: pd.DataFrame, vessel: Vessel) -> str:
    """The hull at a few moments; only its position where it would be too small to see."""
    state = table[["x", "y", "psi"]].to_numpy(np.float64)
    state = state[np.isfinite(state).all(axis=1)]
    if not len(state):
        return ""
    if vessel.length * chart.scale < SHORTEST_HULL:
        px, py = chart.pixels(state[:1, 0], state[:1, 1])
        return f'<path class="start" d="{dots(px, py)}"/>'
    outlines = hulls_at(vessel, *state[spread(state, HULLS)].T)
    drawn = (path(*chart.pixels(o[:, 0], o[:, 1])) for o in outlines)
    return f'<path class="hull" d="{"".join(drawn)}"/>'


def spread(state: FloatArray, most: int) -> IntArray:
    """Rows of a track, (n, 2+), about evenly far apart along the way."""
    way = np.concatenate([[0.0], np.hypot(*np.diff(state[:, :2], axis=0).T).cumsum()])
    rows = np.searchsorted(way, np.linspace(0.0, way[-1], most))
    return np.unique(np.clip(rows, 0, len(state) - 1))


def _scale_bar(chart: Chart) -> str:
    marks = ticks(0.0, 110.0 / chart.scale, most=2)
    bar = marks[-1] if len(marks) > 1 else 0.0
    x, y = EDGE, HEIGHT - 10
    words = text(x + bar * chart.scale + 6, y + 4, f"{tick_text(bar, bar)} m")
    return line(x, y, x + bar * chart.scale, y, "bar") + words if bar else ""


def _north(chart: Chart) -> str:
    x = WIDTH - 20
    return f'<path class="arrow" d="M{x} 36V12m-5 8l5 -9l5 9"/>' + text(x, 50, "N", "middle")


def _flows(chart: Chart, fit: Fit) -> str:
    """Arrows of current and wind in the upper left corner; their length is not to scale."""
    out = ""
    for k, (name, speed, to) in enumerate(arrows(fit)):
        x, y, arm = 28.0, 34.0 + 52 * k, 18.0
        turn = np.rad2deg(to)
        place = f"translate({x} {y}) rotate({turn:.1f})"
        out += f'<path class="flow" transform="{place}" d="M0 {arm}V{-arm}m-5 9l5 -10l5 10"/>'
        out += text(x + 26, y + 4, f"{name} {speed:.2f} m/s")
    return out
