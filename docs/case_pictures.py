"""The pictures of the case studies."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from case_checks import moment
from case_facts import CHANNELS, Case, short
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from validate.report.labels import in_words

MEASURED, BEFORE, AFTER = "#222222", "#c8640a", "#0a60ab"
ROLES = {"identify": ("#888888", "runs that identify"), "validate": (AFTER, "runs held back")}
STYLE = {"font.size": 9, "axes.grid": True, "grid.alpha": 0.25, "axes.spines.top": False, "axes.spines.right": False,
         "lines.linewidth": 1.2, "legend.frameon": False, "axes.titlesize": 9, "axes.titleweight": "bold"}  # fmt: skip
#: At most so many bytes.
LARGEST = 300_000


def canvas(rows: int, columns: int, size: tuple[float, float], **how: object) -> tuple[Figure, np.ndarray]:
    """A figure without a window, and its axes (rows, columns)."""
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **how)


def save(figure: Figure, path: Path) -> Path:
    """A PNG of few colours."""
    figure.savefig(path, dpi=130)
    with Image.open(path) as image:
        image.convert("RGB").quantize(128, Image.Quantize.FASTOCTREE).save(path, optimize=True)
    if path.stat().st_size > LARGEST:
        raise ValueError(f"{path} has {path.stat().st_size} bytes, more than {LARGEST}")
    return path


def ways(case: Case) -> list[tuple[str, str, str, str]]:
    """Suffix, colour, line style and label of each prediction."""
    after = ("_after", AFTER, "-", "with what was found" if case.two else "model as declared")
    return [("_before", BEFORE, "--", "model as declared"), after] if case.two else [after]


def key(figure: Figure, axes: Axes) -> None:
    """One legend for all axes, above them."""
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4)


def tracks(case: Case, path: Path) -> Path:
    """Plan views of the runs held back."""
    names, name = case.names("validate"), short(case.names())
    columns = min(4, len(names))
    figure, axes = canvas(-(-len(names) // columns), columns, (9.0, 3.2 * -(-len(names) // columns) + 0.3))
    for ax in axes.flat[len(names) :]:
        ax.set_visible(False)
    for ax, n in zip(axes.flat, names, strict=False):
        run = case.runs[n]
        for suffix, colour, line, label in ways(case):
            ax.plot(run[f"y{suffix}"], run[f"x{suffix}"], line, color=colour, label=label)
        ax.plot(run["y"], run["x"], color=MEASURED, lw=2.4, alpha=0.4, label="measured, smoothed", zorder=1)
        ax.plot(run["y"].iloc[0], run["x"].iloc[0], "o", color=MEASURED, ms=4)
        ax.set_title(name[n])
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel("east, m")
    axes[0, 0].set_ylabel("north, m")
    key(figure, axes[0, 0])
    return save(figure, path)


def channels(case: Case, path: Path) -> Path:
    """Surge, sway and yaw rate of the runs held back against time."""
    names, name = case.names("validate"), short(case.names())
    figure, axes = canvas(len(names), 3, (9.5, 1.45 * len(names) + 0.5), sharex="row")
    for row, n in zip(axes, names, strict=True):
        run = case.runs[n]
        for ax, (c, (what, unit, scale)) in zip(row, CHANNELS.items(), strict=True):
            value = run[c] * scale
            ax.plot(run["t"], value, color=MEASURED, lw=2.4, alpha=0.4, label="measured, smoothed")
            for suffix, colour, line, label in ways(case):
                ax.plot(run["t"], run[c + suffix] * scale, line, color=colour, label=label)
            span = np.ptp(value.dropna())
            ax.set_ylim(value.min() - 0.6 * span, value.max() + 0.6 * span)
            if n == names[0]:
                ax.set_title(f"{c}, {what}, {unit}")
        row[0].set_ylabel(name[n])
    for ax in axes[-1]:
        ax.set_xlabel("t, s")
    key(figure, axes[0, 0])
    return save(figure, path)


def headings(case: Case, path: Path) -> Path:
    """Heading and rudder of the runs held back, as zigzags are drawn."""
    names, name = case.names("validate"), short(case.names())
    figure, axes = canvas(len(names), 1, (9.0, 1.5 * len(names) + 0.5))
    for ax, n in zip(axes[:, 0], names, strict=True):
        run = case.runs[n]
        begin = run["psi"].iloc[0]
        ax.plot(run["t"], np.degrees(run["rudder"]), color="#999999", lw=0.9, label="rudder, as logged")
        ax.plot(
            run["t"],
            np.degrees(run["psi"] - begin),
            color=MEASURED,
            lw=2.4,
            alpha=0.4,
            label="heading, measured",
        )
        for suffix, colour, line, label in ways(case):
            value = np.degrees(run[f"psi{suffix}"] - begin)
            ax.plot(run["t"], value, line, color=colour, label=f"heading, {label}")
        ax.set_ylabel(f"{name[n]}, °")
    axes[-1, 0].set_xlabel("t, s")
    key(figure, axes[0, 0])
    return save(figure, path)


def evidence(case: Case, path: Path) -> Path:
    """Evidence of the candidates that were refitted, first and last round."""
    rounds = case.report["diagnosis"]["rounds"]
    shown = list(dict.fromkeys((0, len(rounds) - 1))) if rounds else []
    figure, axes = canvas(1, max(1, len(shown)), (9.0, 2.6))
    name = short(case.names())
    for ax, k in zip(axes[0], shown, strict=False):
        tried = [c for c in rounds[k]["candidates"] if not (c["note"] or "").startswith("not refitted")][:8]
        labels = [clipped(in_words(c["label"]), name) for c in tried]
        ax.barh(labels, [c["evidence"] for c in tried], color=AFTER, height=0.6)
        ax.axvline(0.0, color=MEASURED, lw=0.8)
        ax.invert_yaxis()
        ax.set_title(f"round {k + 1} of {len(rounds)}: {in_words(rounds[k]['accepted'] or 'nothing')} taken")
    figure.supxlabel("evidence: gain in −2 log likelihood less what chance gives", fontsize="medium")
    return save(figure, path)


def clipped(label: str, name: dict[str, str], most: int = 40) -> str:
    for path, stem in name.items():
        label = label.replace(path, stem)
    return label if len(label) <= most else label[: most - 1] + "…"


def residuals(case: Case, path: Path) -> Path:
    """What is left of each channel against what it might go with, all runs: medians and quartiles of equal parts."""
    against = {
        "surge, m/s": lambda t: t["u"],
        "drift angle, °": lambda t: np.degrees(np.arctan2(-t["v"], t["u"].abs())),
        "yaw rate, °/s": lambda t: np.degrees(t["r"]),
        "heading, °": lambda t: np.degrees(np.angle(np.exp(1j * t["psi"]))),
    }
    figure, axes = canvas(3, len(against), (9.5, 5.6), sharey="row", sharex="col")
    for row, (c, (what, unit, scale)) in zip(axes, CHANNELS.items(), strict=True):
        for ax, (label, of) in zip(row, against.items(), strict=True):
            for role, (colour, said) in ROLES.items():
                tables = [case.runs[n] for n in case.names(role)]
                x = np.concatenate([np.asarray(of(t)) for t in tables])
                y = np.concatenate([((t[c] - t[f"{c}_after"]) * scale).to_numpy() for t in tables])
                banded(ax, x, y, colour, said)
            ax.axhline(0.0, color=MEASURED, lw=0.8)
            if c == "r":
                ax.set_xlabel(label)
        row[0].set_ylabel(f"Δ {what}, {unit}")
    key(figure, axes[0, 0])
    return save(figure, path)


def banded(ax: Axes, x: np.ndarray, y: np.ndarray, colour: str, label: str, parts: int = 12) -> None:
    """Median and quartiles of y over parts of x with equally many samples."""
    ok = np.isfinite(x + y)
    x, y = x[ok], y[ok]
    edges = np.unique(np.quantile(x, np.linspace(0, 1, parts + 1)))
    if len(edges) < 3:
        return
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    there = [k for k in range(len(edges) - 1) if (which == k).any()]
    middle = [np.median(x[which == k]) for k in there]
    low, half, high = np.array([np.quantile(y[which == k], (0.25, 0.5, 0.75)) for k in there]).T
    ax.fill_between(middle, low, high, color=colour, alpha=0.18, lw=0)
    ax.plot(middle, half, "o-", color=colour, ms=3, label=label)


def turning(case: Case, path: Path) -> Path:
    """Yaw rate against the declared moment of the thrusters, run by run."""
    name = short(case.names())
    figure, axes = canvas(1, 1, (6.4, 4.0))
    ax = axes[0, 0]
    arm = max(abs(i["position"][1]) for i in case.declared["inputs"].values())
    for n, run in case.runs.items():
        m = moment(case, run) / arm
        busy = np.abs(m) > 0.02
        if not busy.any():
            continue
        ax.plot(m[busy], np.degrees(run["r"][busy]), ".", ms=3, alpha=0.6, label=name[n])
    ax.axhline(0.0, color=MEASURED, lw=0.8)
    ax.axvline(0.0, color=MEASURED, lw=0.8)
    ax.set_xlabel("moment of the thrusters as declared, to starboard (full ahead on one side = 1)")
    ax.set_ylabel("yaw rate measured, to starboard, °/s")
    ax.legend(markerscale=3, fontsize=8, ncols=2)
    return save(figure, path)


def all_of(case: Case, out: Path, stem: str, wanted: list[str]) -> list[Path]:
    """The pictures that a page shows."""
    makers = {f.__name__: f for f in (tracks, channels, headings, evidence, residuals, turning)}
    with mpl.rc_context(STYLE):
        return [makers[name](case, out / f"{stem}-{name}.png") for name in wanted]
