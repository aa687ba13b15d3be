"""The blueprint: overview, one tab per log, diagnosis, with ranges that show whole logs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb

from validate.recording import entities
from validate.recording.entities import log_root
from validate.recording.glyphs import drawable
from validate.report.names import slug


@dataclass(frozen=True)
class LogView:
    """What the blueprint must know of one log: its unique name, length, extent of its track, what it has.

    ``ranges`` holds the values that a plot shows, by its place under the log's root, such as ``prediction/u``.
    """

    name: str
    span: tuple[float, float]
    bounds: tuple[tuple[float, float], tuple[float, float]]
    has_map: bool
    channels: tuple[str, ...]
    signals: tuple[str, ...]
    inputs: tuple[str, ...]
    validates: bool
    ranges: Mapping[str, tuple[float, float]]


def blueprint(views: list[LogView], rounds: int) -> rrb.Blueprint:
    """Overview first, then each log, then the diagnosis."""
    tabs = [overview(views), *(log_tab(v) for v in views), diagnosis_tab(rounds)]
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.TimePanel(state="collapsed", timeline=entities.ELAPSED),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
    )


def time_axis(span: tuple[float, float], share: float) -> rrb.TimeAxis:
    """An axis that shows a whole log, with room for the legend to its right."""
    room = share * (span[1] - span[0])
    bound = rr.TimeRangeBoundary.absolute
    return rrb.TimeAxis(
        view_range=rr.TimeRange(start=bound(seconds=span[0]), end=bound(seconds=span[1] + room))
    )


def plot(view: LogView, place: str, name: str, room: float = 0.2) -> rrb.TimeSeriesView:
    """A time plot of everything at a place under a log's root; ``room`` is the share to keep free for the legend."""
    shown = view.ranges.get(place)
    return rrb.TimeSeriesView(
        origin=f"{log_root(view.name)}/{place}",
        name=drawable(name),
        axis_x=time_axis(view.span, room),
        axis_y=rrb.ScalarAxis(range=shown) if shown else None,
        plot_legend=rrb.PlotLegend(visible=True, corner="RightTop"),
    )


def plan(view: LogView, name: str = "Plan, north up (m)") -> rrb.Spatial2DView:
    """The plan view of one log, wide enough for its whole track."""
    (left, right), (top, bottom) = view.bounds
    extent = rrb.VisualBounds2D(x_range=(left, right), y_range=(top, bottom))
    return rrb.Spatial2DView(origin=f"{log_root(view.name)}/plan", name=drawable(name), visual_bounds=extent)


def log_tab(view: LogView) -> rrb.Horizontal:
    """Plan and inputs to the left; predictions with residuals, and signals, to the right, as far as there are any."""
    root = log_root(view.name)
    flat: list[rrb.View] = [plan(view)]
    if view.has_map:
        flat.append(rrb.MapView(origin=f"{root}/map", name="Map", background=rrb.MapProvider.OpenStreetMap))
    inputs = [plot(view, f"inputs/{i}", f"input {i}", 0.45) for i in map(slug, view.inputs)]
    left = rrb.Vertical(rrb.Tabs(*flat, active_tab=0), *inputs, row_shares=[3.0, *[1.0] * len(inputs)])
    channels = rrb.Vertical(*(plot(view, f"prediction/{c}", f"{c}: measured and predicted")
                              for c in view.channels), name="Predictions")  # fmt: skip
    rest = rrb.Vertical(*(plot(view, f"residual/{c}", f"{c}: measured − predicted")
                          for c in view.channels), name="Residuals")  # fmt: skip
    signals = rrb.Grid(*(plot(view, f"signals/{s}", f"{s}: raw, cleaned, smoothed", 0.45)
                         for s in view.signals), name="Signals", grid_columns=2)  # fmt: skip
    shown = [c for c in (channels, rest, signals) if c.contents]
    right = [rrb.Tabs(*shown, active_tab=0)] if shown else []
    shares = [2, 3][: 1 + len(right)]
    return rrb.Horizontal(left, *right, column_shares=shares, name=drawable(view.name))


def overview(views: list[LogView]) -> rrb.Horizontal:
    """The report beside the log that was held back: its track and its predictions."""
    words = rrb.TextDocumentView(origin=entities.REPORT, name="Report")
    if not views:
        return rrb.Horizontal(words, name="Overview")
    first = next((v for v in views if v.validates), views[0])
    plots = [plot(first, f"prediction/{c}", f"{first.name}: {c}") for c in first.channels[:3]]
    picture = rrb.Vertical(
        plan(first, f"{first.name}: plan, north up (m)"), *plots, row_shares=[2.2, *[1.0] * len(plots)]
    )
    return rrb.Horizontal(words, picture, column_shares=[2, 3], name="Overview")


def diagnosis_tab(rounds: int) -> rrb.Vertical:
    """What is missing; then each round: candidates as bars, and the table with their names."""
    root = entities.DIAGNOSIS
    turns = [
        rrb.Horizontal(
            rrb.BarChartView(
                origin=f"{root}/round_{k}/candidates",
                name=f"Evidence of the candidates by rank, round {k}",
                plot_legend=rrb.PlotLegend(visible=False),
            ),
            rrb.TextDocumentView(origin=f"{root}/round_{k}/table", name=f"Round {k}"),
            name=f"Round {k}",
        )
        for k in range(1, rounds + 1)
    ]
    summary = rrb.TextDocumentView(origin=f"{root}/summary", name="What is missing")
    events = rrb.TextLogView(origin=entities.EVENTS, name="Manoeuvres and verdict")
    top = rrb.Horizontal(summary, events)
    return rrb.Vertical(top, *([rrb.Tabs(*turns, active_tab=0)] if turns else []), name="Diagnosis")


def bounds(
    extents: Mapping[str, tuple[float, float]], margin: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Plan-view bounds ((left, right), (top, bottom)) from the extents north and east."""
    (south, north), (west, east) = extents["north"], extents["east"]
    pad = margin + 0.2 * max(north - south, east - west)
    values = (west - pad, east + pad), (-north - pad, -south + pad)
    assert all(math.isfinite(v) for pair in values for v in pair)
    return values
