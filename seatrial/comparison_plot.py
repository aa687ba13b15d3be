"""A picture of a comparison: error on unseen logs and processor time of every method, best first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from seatrial.manoeuvre_plot import checked_picture

if TYPE_CHECKING:
    import pandas as pd


#: Errors beyond so many spreads, or so many times the best, are drawn at the edge, with their number.
FAR, TIMES = 3.0, 4.0


def plot_comparison(table: pd.DataFrame, path: Path) -> None:
    """Bars of the error, and error against time."""
    checked_picture(path)
    from matplotlib.figure import Figure

    shown = table[np.isfinite(table["error"])]
    edge = max(FAR, TIMES * float(shown["error"].min()))
    figure = Figure(figsize=(11, max(3.2, 0.28 * len(shown) + 1.4)), layout="constrained")
    bars, cloud = figure.subplots(1, 2, width_ratios=(3, 2))
    colours = _colours(shown["model"].tolist())
    _bars(bars, shown, colours, edge)
    _cloud(cloud, shown, colours, edge)
    figure.savefig(path)


def _colours(models: list[str]) -> dict[str, str]:
    return {m: f"C{k % 10}" for k, m in enumerate(dict.fromkeys(models))}


def _labels(table: pd.DataFrame) -> list[str]:
    return [
        f"{r.model}, {r.estimator}" + ("" if r.optimiser == "auto" else f" + {r.optimiser}")
        for r in table.itertuples()
    ]


def _bars(axes: Any, table: pd.DataFrame, colours: dict[str, str], edge: float) -> None:
    places, errors = np.arange(len(table)), table["error"].to_numpy(dtype=float)
    axes.barh(places, np.minimum(errors, edge), color=[colours[m] for m in table["model"]])
    for place, error in zip(places, errors, strict=True):
        inside = error > 0.6 * edge
        axes.annotate(
            f"{error:.3g}" if error < 1000 else f"{error:.0e}", (min(error, edge), place), va="center",
            xytext=(-4 if inside else 4, 0), textcoords="offset points", ha="right" if inside else "left",
            fontsize="x-small", color="white" if inside else "0.25",
        )  # fmt: skip
    axes.set_yticks(places, _labels(table), fontsize="small")
    axes.set_ylim(len(table) - 0.4, -0.6)
    axes.set(xscale="log", xlabel="free-running error on unseen logs (1 = no better than the mean)")
    axes.set_xlim(0.5 * float(errors.min()), edge)
    _plain(axes.xaxis, 0.5 * float(errors.min()), edge)
    axes.axvline(1.0, color="0.6", lw=0.8)


def _cloud(axes: Any, table: pd.DataFrame, colours: dict[str, str], edge: float) -> None:
    for model, colour in colours.items():
        part = table[table["model"] == model]
        near = part["error"] <= edge
        seconds = part["seconds"].clip(lower=1e-3)
        axes.scatter(seconds[near], part["error"][near], color=colour, label=model, s=22)
        axes.scatter(
            seconds[~near], part["error"][~near].clip(upper=0.96 * edge), color=colour, marker="^", s=26
        )
    axes.set(
        xscale="log", yscale="log", xlabel="processor time of the fit, s", ylabel="error (▲: beyond the edge)"
    )
    low = 0.8 * float(table["error"].min())
    axes.set_ylim(low, edge)
    _plain(axes.yaxis, low, edge)
    axes.axhline(1.0, color="0.6", lw=0.8)
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", frameon=True, framealpha=0.7)


def _plain(axis: Any, low: float, high: float) -> None:
    """Label a logarithmic axis at 1, 2 and 5 times powers of ten."""
    ticks = [m * 10.0**e for e in range(-6, 7) for m in (1, 2, 5) if low <= m * 10.0**e <= high]
    axis.set_ticks(ticks, [f"{t:g}" for t in ticks])
    axis.set_ticks([], minor=True)
