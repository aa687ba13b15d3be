"""A picture of simulated manoeuvres: the track, the heading with what was ordered, speeds and yaw rate."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ingest.errors import UsageError
from seatrial.writable import check_file

if TYPE_CHECKING:
    from identify.fit import Fit
    from identify.simulate import Manoeuvre
    from preprocess.vessel import Input

    FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
    Lines = Mapping[str, FloatArray]

SUFFIXES = (".png", ".svg", ".pdf")
#: A track that is more than so many times as long as it is wide lies along its panel, its width drawn larger.
LONG = 3.0
#: The least width that is drawn of it, as a share of its length.
NARROW = 0.01
#: Room above and below lines, as a share of what they span; lines that span less (m/s, °, °/s) are those of no motion.
ROOM, STILL = 0.15, 1e-2
#: A dimension that is marked, and its text.
_MARK = {"color": "0.3", "lw": 0.8}
_TEXT = {"color": "0.2", "fontsize": "x-small", "textcoords": "offset points"}


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


def plot_manoeuvres(manoeuvres: Sequence[Manoeuvre], fit: Fit, path: Path) -> None:
    """One row per manoeuvre of a fit's vessel; the draws from the parameters' covariance in grey."""
    checked_picture(path)
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.5, 3.4 * len(manoeuvres)), layout="constrained")
    rows = figure.subplots(len(manoeuvres), 3, squeeze=False)
    for axes, m in zip(rows, manoeuvres, strict=True):
        _track(axes[0], m, fit.vessel.length)
        _heading(axes[1], m, fit.inputs)
        speeds = {"u, m/s": m.states[:, 3], "v, m/s": m.states[:, 4]}
        _two_scales(axes[2], m.t, speeds, {"r, °/s": np.degrees(m.states[:, 5])})
    figure.savefig(path)


def _track(axes: Any, m: Manoeuvre, length: float) -> None:
    ahead, aside = m.states[:, 0] / length, m.states[:, 1] / length
    lies = bool(np.ptp(ahead) > LONG * np.ptp(aside))
    for track in m.tracks:
        axes.plot(*_across(track[:, 0] / length, track[:, 1] / length, lies), color="0.8", lw=0.6)
    axes.plot(*_across(ahead, aside, lies), lw=1.4)
    axes.set_title(m.order.title)
    axes.grid(alpha=0.3)
    names = _across("ahead, lengths", "to starboard, lengths", lies)
    axes.set(xlabel=names[0], ylabel=names[1])
    if lies:
        _widened(axes, NARROW * float(np.ptp(ahead)))
    else:
        axes.set(aspect="equal", adjustable="datalim")
    if m.order.kind == "circle":
        _mark_circle(axes, m, length)


def _across(ahead: Any, aside: Any, lies: bool) -> tuple[Any, Any]:
    """What goes along the panel's width and its height: a track that lies has its bow to the right."""
    return (ahead, aside) if lies else (aside, ahead)


def _widened(axes: Any, least: float) -> None:
    """No less than so much to either side of the middle, starboard below."""
    low, high = axes.get_ylim()
    half = max(0.5 * (high - low), least)
    axes.set_ylim(0.5 * (low + high) + half, 0.5 * (low + high) - half)


def _mark_circle(axes: Any, m: Manoeuvre, length: float) -> None:
    """The places at 90° and 180°, and the distances that are measured there."""
    for time, name, column in (("time_to_90", "advance", 0), ("time_to_180", "tactical_diameter", 1)):
        when, far = m[time].value, m[name].value / length
        if math.isfinite(when) and math.isfinite(far):
            x, y = (float(np.interp(when, m.t, m.states[:, k])) / length for k in (0, 1))
            axes.plot(*(([y, y], [0.0, x]) if column == 0 else ([0.0, y], [x, x])), ls="--", **_MARK)
            axes.plot(y, x, "o", ms=4.0, color="0.2")
            beside = (y, 0.3 * x) if column == 0 else (0.5 * y, x)
            where = {"xytext": (4, 0)} if column == 0 else {"xytext": (0, 3), "ha": "center"}
            axes.annotate(f"{name.replace('_', ' ')} {far:.3g} L", beside, **where, **_TEXT)


def _heading(axes: Any, m: Manoeuvre, inputs: Sequence[Input]) -> None:
    """The heading, and what was ordered: on the same axis where a zigzag's helm is an angle as the heading is."""
    heading, ordered = {"heading, °": np.degrees(m.states[:, 2])}, dict(_ordered(m, inputs))
    if m.order.kind == "zigzag" and all(n.endswith("°") for n in ordered):
        _two_scales(axes, m.t, heading | ordered, {})
    else:
        _two_scales(axes, m.t, heading, ordered)
    if m.order.kind == "zigzag":
        _mark_overshoots(axes, m)


def _ordered(m: Manoeuvre, inputs: Sequence[Input]) -> Iterator[tuple[str, FloatArray]]:
    """The inputs that the manoeuvre is made by, named with their unit: those that steer, or push in a stop."""
    from identify.simulate.helm import helm_for
    from preprocess.columns import input_unit

    helm = helm_for(tuple(inputs), {})
    pushing = [i.name for i in inputs if i.kind in ("propeller", "thruster")]
    moved = pushing if m.order.kind == "stopping" else [*helm.turned, *helm.paired]
    for item in (i for i in inputs if i.name in moved):
        unit, values = input_unit(item), m.inputs[item.name]
        if unit == "rad":
            yield f"{item.name}, °", np.degrees(values)
        else:
            yield item.name if unit == "1" else f"{item.name}, {unit}", values


def _mark_overshoots(axes: Any, m: Manoeuvre) -> None:
    """How far the heading goes on after the helm was put over."""
    psi, begin, period = m.order.side * m.states[:, 2], m["first_execute_time"].value, m["period"].value
    second = m["second_execute_time"].value
    legs = (("first_overshoot", 1, begin, second), ("second_overshoot", -1, second, second + period))
    for name, sign, since, until in legs:
        angle = m[name].value
        inside = np.flatnonzero((m.t >= since) & ~(m.t > until))
        if math.isfinite(angle) and len(inside):
            t = m.t[inside[np.argmax(sign * psi[inside])]]
            side = sign * m.order.side
            ends = np.degrees([side * m.order.heading, side * (m.order.heading + angle)])
            axes.plot([t, t], ends, marker="_", **_MARK)
            axes.annotate(f"{math.degrees(angle):.3g}°", (t, ends[1]), xytext=(5, 5 * side - 4), **_TEXT)


def _two_scales(axes: Any, t: FloatArray, left: Lines, right: Lines) -> None:
    """Lines over time, those of another unit by the scale on the right; one legend for all, above them."""
    lines = _drawn(axes, t, left, 0, "-")
    axes.set_xlabel("s")
    axes.grid(alpha=0.3)
    if right:
        lines += _drawn(axes.twinx(), t, right, len(left), "--")
    axes.legend(
        handles=lines, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize="small", frameon=False
    )


def _drawn(axes: Any, t: FloatArray, lines: Lines, first: int, style: str) -> list[Any]:
    """Lines in the colours from the ``first`` on, by a scale that shows where nothing is."""
    made = [
        axes.plot(t, v, lw=1.0, ls=style, color=f"C{first + k}", label=n)[0]
        for k, (n, v) in enumerate(lines.items())
    ]
    every = np.concatenate([[0.0], *lines.values()])
    room = ROOM * float(np.ptp(every)) if np.ptp(every) > STILL else 1.0
    axes.set_ylim(every.min() - room, every.max() + room)
    axes.set_ylabel(", ".join(lines))
    return made
