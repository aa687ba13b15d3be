"""Plan and map views: fixes, tracks, the hull to scale, current and wind."""

from __future__ import annotations

import numpy as np
import pandas as pd
import rerun as rr

from identify.fit import Fit
from preprocess.trial import FloatArray, Trial
from preprocess.vessel import Vessel
from validate.recording import entities
from validate.recording.entities import COLOURS
from validate.recording.stream import Clock, strips, thin_track
from validate.report.figures import column
from validate.report.plan import arrows, hull_outline
from validate.report.thinning import even

#: Poses of a moving hull per log, at most.
POSES = 2000
#: What lies over what on the plan.
ORDER = {"smoothed": 10.0, "before": 20.0, "after": 30.0}
SUFFIX = {"smoothed": "", "before": "_before", "after": "_after"}


def on_plan(north: FloatArray, east: FloatArray) -> FloatArray:
    """Metres on the plan view, (n, 2): to the right and down, so that north is up."""
    return np.column_stack([east, -north])


def send_tracks(
    rec: rr.RecordingStream,
    name: str,
    table: pd.DataFrame,
    trials: list[Trial],
    fit: Fit,
    clock: Clock,
    parts: tuple[str, ...],
) -> None:
    """Everything of one log that lies in the plane."""
    send_fixes(rec, name, trials)
    t = table["t"].to_numpy(np.float64)
    origin = next((tr.origin for tr in trials if tr.origin), None)
    for part in parts:
        x, y = column(table, f"x{SUFFIX[part]}"), column(table, f"y{SUFFIX[part]}")
        if x is None or y is None:
            continue
        radius = rr.Radius.ui_points(3.0 if part == "smoothed" else 1.2)
        lines = strips(thin_track(on_plan(x, y)))
        rec.log(
            entities.plan(name, part),
            rr.LineStrips2D(lines, colors=COLOURS[part], radii=radius, draw_order=ORDER[part]),
            static=True,
        )
        if origin:
            lat_lon = [geographic(-s[:, 1], s[:, 0], origin) for s in lines]
            look = rr.GeoLineStrings(lat_lon=lat_lon, colors=COLOURS[part], radii=radius)
            rec.log(entities.chart(name, part), look, static=True)
        psi = column(table, f"psi{SUFFIX[part]}")
        if psi is not None:
            send_hull(rec, name, part, clock, t, np.column_stack([x, y, psi]), fit.vessel)
    send_flows(rec, name, table, fit)


def geographic(north: FloatArray, east: FloatArray, origin: tuple[float, float]) -> FloatArray:
    """Latitude and longitude, degrees, (n, 2), of positions in the tangent plane at ``origin``."""
    import pymap3d

    lat, lon, _ = pymap3d.enu2geodetic(east, north, np.zeros_like(north), origin[0], origin[1], 0.0)
    return np.column_stack([lat, lon])


def send_fixes(rec: rr.RecordingStream, name: str, trials: list[Trial]) -> None:
    """Raw fixes, and those that were set aside."""
    found = [t.measurements["position"] for t in trials if "position" in t.measurements]
    found = [m for m in found if m.value.ndim == 2 and len(m.value)]
    if not found:
        return
    value, good = np.concatenate([m.value for m in found]), np.concatenate([m.good for m in found])
    origin = next((t.origin for t in trials if t.origin), None)
    for part, rows, size in (("raw", np.flatnonzero(good), 1.5), ("outliers", np.flatnonzero(~good), 4.0)):
        if not len(rows):
            continue
        rows = rows[even(len(rows), 20_000)]
        x, y = value[rows, 0], value[rows, 1]
        look = rr.Points2D(on_plan(x, y), colors=COLOURS[part], radii=rr.Radius.ui_points(size))
        rec.log(entities.plan(name, part), look, static=True)
        if origin:
            geo = rr.GeoPoints(
                lat_lon=geographic(x, y, origin), colors=COLOURS[part], radii=rr.Radius.ui_points(size)
            )
            rec.log(entities.chart(name, part), geo, static=True)


def send_hull(rec: rr.RecordingStream, name: str, part: str, clock: Clock, t: FloatArray, pose: FloatArray,
              vessel: Vessel) -> None:  # fmt: skip
    """A hull to scale that moves along the time line; ``pose`` is (n, 3): north, east, heading."""
    path = entities.plan(name, f"hull_{part}")
    outline = hull_outline(vessel)
    shape = rr.LineStrips2D(
        [on_plan(outline[:, 0], outline[:, 1])], colors=COLOURS[part], radii=rr.Radius.ui_points(1.5)
    )
    rec.log(f"{path}/outline", shape, static=True)
    ok = np.flatnonzero(np.isfinite(pose).all(axis=1))
    rows = ok[even(len(ok), POSES)]
    if not len(rows):
        return
    x, y, psi = pose[rows].T
    zero = np.zeros(len(rows))
    quaternion = np.column_stack([zero, zero, np.sin(psi / 2), np.cos(psi / 2)])
    moves = rr.Transform3D.columns(translation=np.column_stack([on_plan(x, y), zero]), quaternion=quaternion)
    rec.send_columns(path, indexes=clock.columns(t[rows]), columns=moves)


def send_flows(rec: rr.RecordingStream, name: str, table: pd.DataFrame, fit: Fit) -> None:
    """Arrows of current and wind at the track's corner, long enough to be seen; the number stands above."""
    place = table[["x", "y"]].to_numpy(np.float64)
    place = place[np.isfinite(place).all(axis=1)]
    if not len(place):
        return
    low, high = place.min(axis=0), place.max(axis=0)
    span = max(float((high - low).max()), 4 * fit.vessel.length)
    for k, (kind, speed, to) in enumerate(arrows(fit)):
        start = on_plan(np.array([high[0] + span * (0.03 + 0.09 * k)]), np.array([low[1]]))
        vector = 0.12 * span * on_plan(np.array([np.cos(to)]), np.array([np.sin(to)]))
        look = rr.Arrows2D(
            vectors=vector,
            origins=start,
            colors=COLOURS[kind],
            radii=rr.Radius.ui_points(3.0),
        )
        rec.log(entities.plan(name, kind), look, static=True)
        above = np.column_stack(
            [start[:, 0], np.minimum(start[:, 1], start[:, 1] + vector[:, 1]) - 0.09 * span]
        )
        words = rr.Points2D(
            above, labels=f"{kind} {speed:.2f} m/s", colors=COLOURS[kind], radii=0.0, show_labels=True
        )
        rec.log(f"{entities.plan(name, kind)}/words", words, static=True)
