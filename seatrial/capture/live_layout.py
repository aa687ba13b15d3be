"""The layout of the live view: track and sensors to the left, signals that follow the time to the right."""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

from validate.recording import entities

QUANTITIES = ("heading", "yaw_rate", "velocity", "rudder", "propeller", "wind")


def blueprint(name: str, span_s: float, *, online: bool = False) -> rrb.Blueprint:
    """The views of a capture; ``span_s`` seconds of every signal are shown, and of an identification all."""
    root = entities.log_root(name)
    bound = rr.TimeRangeBoundary
    recent = rr.TimeRange(start=bound.cursor_relative(seconds=-span_s), end=bound.cursor_relative())
    plots = [
        rrb.TimeSeriesView(origin=f"{root}/signals/{q}", name=q, axis_x=rrb.TimeAxis(view_range=recent))
        for q in QUANTITIES
    ]
    every = rrb.TimeSeriesView(
        origin=f"{root}/signals", name="all signals", axis_x=rrb.TimeAxis(view_range=recent)
    )
    left = rrb.Vertical(
        rrb.Spatial2DView(origin=f"{root}/plan", name="Track, north up (m)"),
        rrb.TextDocumentView(origin=f"{root}/sensors", name="Sensors"),
        row_shares=[3, 2],
    )
    signals = rrb.Grid(*plots, grid_columns=2, name="Signals")
    tabs: list[rrb.Container | rrb.View] = [signals, every]
    if online:
        tabs.insert(0, identification(root))
    right = rrb.Tabs(*tabs, active_tab=0)
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[2, 3]),
        rrb.TimePanel(state="collapsed", timeline=entities.ELAPSED, play_state="following"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
    )


def identification(root: str) -> rrb.Grid:
    """Parameters, prediction errors and the monitor of an identification."""
    at = f"{root}/online"
    views = (
        rrb.TimeSeriesView(origin=f"{at}/errors", name="Prediction errors"),
        rrb.TimeSeriesView(origin=f"{at}/monitor", name="Does the model fit?"),
        rrb.TimeSeriesView(origin=f"{at}/parameters", name="Parameters"),
        rrb.TextLogView(origin=f"{at}/events", name="Events"),
    )
    return rrb.Grid(*views, grid_columns=2, name="Identification")
