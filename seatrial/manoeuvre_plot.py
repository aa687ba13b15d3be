"""A picture of simulated manoeuvres: track, heading and helm, speed and yaw rate."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ingest.errors import UsageError
from seatrial.writable import check_file

if TYPE_CHECKING:
    from identify.simulate import Manoeuvre

SUFFIXES = (".png", ".svg", ".pdf")


def checked_picture(path: Path) -> Path:
    """The path itself, if a picture can be written there.

    Raises
    ------
    UsageError
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"--out: expected a picture ({', '.join(SUFFIXES)}), found '{path.name}'.")
    check_file(path, "--out")
    return path


def plot_manoeuvres(manoeuvres: Sequence[Manoeuvre], length: float, path: Path) -> None:
    """One row per manoeuvre; the draws from the parameters' covariance in grey."""
    checked_picture(path)
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.4 * len(manoeuvres)), layout="constrained")
    rows = figure.subplots(len(manoeuvres), 3, squeeze=False)
    for axes, m in zip(rows, manoeuvres, strict=True):
        _track(axes[0], m, length)
        _series(axes[1], m.t, {"heading, °": np.degrees(m.states[:, 2]), **_helm(m)})
        _series(
            axes[2], m.t, {"u, m/s": m.states[:, 3], "v, m/s": m.states[:, 4], "r, rad/s": m.states[:, 5]}
        )
    figure.savefig(path)


def _track(axes: Any, m: Manoeuvre, length: float) -> None:
    for track in m.tracks:
        axes.plot(track[:, 1] / length, track[:, 0] / length, color="0.8", lw=0.6)
    axes.plot(m.states[:, 1] / length, m.states[:, 0] / length, lw=1.4)
    axes.set(
        title=m.order.title,
        xlabel="to starboard, lengths",
        ylabel="ahead, lengths",
        aspect="equal",
        adjustable="datalim",
    )


def _helm(m: Manoeuvre) -> dict[str, Any]:
    return {n: np.degrees(v) if np.abs(v).max() <= np.pi else v for n, v in m.inputs.items() if np.ptp(v) > 0}


def _series(axes: Any, t: Any, columns: dict[str, Any]) -> None:
    for name, values in columns.items():
        axes.plot(t, values, lw=1.0, label=name)
    axes.set(xlabel="s")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", frameon=False)
