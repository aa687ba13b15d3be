"""A picture of a comparison: error on unseen logs and processor time of every method, best first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from seatrial.manoeuvre_plot import checked_picture

if TYPE_CHECKING:
    import pandas as pd


def plot_comparison(table: pd.DataFrame, path: Path) -> None:
    """Bars of the error, and error against time."""
    checked_picture(path)
    from matplotlib.figure import Figure

    shown = table[np.isfinite(table["error"])]
    figure = Figure(figsize=(11, max(3.2, 0.28 * len(shown) + 1.4)), layout="constrained")
    bars, cloud = figure.subplots(1, 2, width_ratios=(3, 2))
    colours = _colours(shown["model"].tolist())
    _bars(bars, shown, colours)
    _cloud(cloud, shown, colours)
    figure.savefig(path)


def _colours(models: list[str]) -> dict[str, str]:
    return {m: f"C{k % 10}" for k, m in enumerate(dict.fromkeys(models))}


def _labels(table: pd.DataFrame) -> list[str]:
    return [
        f"{r.model}, {r.estimator}" + ("" if r.optimiser == "auto" else f" + {r.optimiser}")
        for r in table.itertuples()
    ]


def _bars(axes: Any, table: pd.DataFrame, colours: dict[str, str]) -> None:
    places = np.arange(len(table))
    axes.barh(places, table["error"], color=[colours[m] for m in table["model"]])
    axes.set_yticks(places, _labels(table), fontsize="small")
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="free-running error on unseen logs (1 = no better than the mean)")
    axes.set_xlim(left=0.5 * float(table["error"].min()))
    axes.axvline(1.0, color="0.6", lw=0.8)


def _cloud(axes: Any, table: pd.DataFrame, colours: dict[str, str]) -> None:
    for model, colour in colours.items():
        part = table[table["model"] == model]
        axes.scatter(part["seconds"].clip(lower=1e-3), part["error"], color=colour, label=model, s=22)
    axes.set(xscale="log", yscale="log", xlabel="processor time of the fit, s", ylabel="error")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", frameon=False)
