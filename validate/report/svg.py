"""Small inline SVG: paths, axes and stacked time plots whose colours come from the page's style sheet."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from preprocess.trial import FloatArray
from validate.report.thinning import IntArray, extremes

#: Width of a letter of a label, about, px.
LETTER = 5.8
#: Drawing units per pixel: integers in paths are tenths of a pixel.
FINE = 10
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM, BETWEEN = 420, 248, 52, 8, 8, 34, 12
MOST = 420
#: Pixels beyond which nothing is drawn where it is.
FAR = 20_000.0
#: Width of an arrow, px.
ARROW = 8.0


@dataclass(frozen=True)
class Series:
    """One line, cloud of dots or band; ``style`` is a class of the style sheet."""

    style: str
    x: FloatArray
    y: FloatArray
    kind: str = "line"
    low: FloatArray | None = None


@dataclass(frozen=True)
class Axes:
    """One plot of a stack: its label, its series back to front, and its range."""

    label: str
    series: tuple[Series, ...]
    limits: tuple[float, float]
    height: int = 130


def ticks(low: float, high: float, most: int = 5) -> list[float]:
    """Round numbers inside a range: about as many as wanted, and two at least, which alone tell the scale."""
    span = high - low
    if not (math.isfinite(span) and span > 0):
        return [low] if math.isfinite(low) else []
    raw = span / max(1, most)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= raw * (1 - 1e-9))
    found = _inside(low, high, step)
    return found if len(found) > 1 else ticks(low, high, most + 1)


def _inside(low: float, high: float, step: float) -> list[float]:
    """Multiples of a step inside a range."""
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def tick_text(value: float, step: float) -> str:
    """A tick's number with as many decimals as its step needs, with a true minus sign."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9)) if step > 0 else 2
    return f"{value + 0.0:.{min(decimals, 6)}f}".replace("-", "−")


def limits_of(
    core: Sequence[FloatArray], guests: Sequence[FloatArray] = (), reach: float = 0.6
) -> tuple[float, float]:
    """A range that shows ``core`` whole and ``guests`` as far as ``reach`` spans beyond it."""
    low, high = finite_range(core or guests)
    span = max(high - low, 1e-9, 0.02 * max(abs(low), abs(high))) if low or high else 1.0
    if core and guests:
        guest_low, guest_high = finite_range([*guests, *core])
        low, high = max(guest_low, low - reach * span), min(guest_high, high + reach * span)
    pad = max(0.06 * (high - low), (span - high + low) / 2)
    return low - pad, high + pad


def finite_range(arrays: Sequence[FloatArray]) -> tuple[float, float]:
    """Smallest and largest finite value, (0, 1) where there is none."""
    finite = [a[np.isfinite(a)] for a in arrays]
    finite = [a for a in finite if len(a)]
    if not finite:
        return 0.0, 1.0
    return float(min(a.min() for a in finite)), float(max(a.max() for a in finite))


def whole(pixels: FloatArray) -> IntArray:
    """Drawing units, whole; what lies far outside of any picture is brought to its surroundings."""
    return np.rint(np.clip(pixels, -FAR, FAR) * FINE).astype(np.int64)


def path(px: FloatArray, py: FloatArray) -> str:
    """The ``d`` of a path through points in pixels, broken where one is not finite; relative, in tenths."""
    ok = np.isfinite(px) & np.isfinite(py)
    x, y = whole(np.where(ok, px, 0)), whole(np.where(ok, py, 0))
    starts = np.flatnonzero(ok & ~np.concatenate([[False], ok[:-1]]))
    ends = np.flatnonzero(ok & ~np.concatenate([ok[1:], [False]])) + 1
    return "".join(_stroke(x[a:b], y[a:b]) for a, b in zip(starts, ends, strict=True))


def _stroke(x: IntArray, y: IntArray) -> str:
    moves = np.column_stack([np.diff(x), np.diff(y)])
    moves = moves[moves.any(axis=1)]
    return f"M{x[0]} {y[0]}" + ("l" + " ".join(map(str, moves.ravel().tolist())) if len(moves) else "h0")


def dots(px: FloatArray, py: FloatArray) -> str:
    """The ``d`` of a path that draws a dot at each point (with a round line cap)."""
    ok = np.isfinite(px) & np.isfinite(py)
    x, y = whole(px[ok]).tolist(), whole(py[ok]).tolist()
    return "".join(f"M{a} {b}h0" for a, b in zip(x, y, strict=True))


def band(px: FloatArray, low: FloatArray, high: FloatArray) -> str:
    """The ``d`` of a closed band between two lines, in pixels."""
    ok = np.isfinite(px) & np.isfinite(low) & np.isfinite(high)
    x, y = np.concatenate([px[ok], px[ok][::-1]]), np.concatenate([high[ok], low[ok][::-1]])
    return path(x, y) + "z" if ok.any() else ""


def text(x: float, y: float, words: str, anchor: str = "start", style: str = "tick", turn: int = 0) -> str:
    """A text element; turned by ``turn`` degrees about its own position."""
    turned = f' transform="rotate({turn} {x:.0f} {y:.0f})"' if turn else ""
    return (
        f'<text class="{style}" x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}"{turned}>{escape(words)}</text>'
    )


def line(x1: float, y1: float, x2: float, y2: float, style: str = "grid") -> str:
    """A straight line."""
    return f'<line class="{style}" x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"/>'


def picture(width: float, height: float, label: str, body: str) -> str:
    """An SVG that scales with its column and tells a screen reader what it shows."""
    return (
        f'<svg role="img" aria-label="{escape(label, quote=True)}" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'preserveAspectRatio="xMidYMid meet">{body}</svg>'
    )


def stack(
    name: str, label: str, axes: Sequence[Axes], span: tuple[float, float], x_label: str = "t, s"
) -> str:
    """Plots above each other with one horizontal axis; ``name`` must be unique on the page."""
    height = TOP + BOTTOM + sum(a.height for a in axes) + BETWEEN * (len(axes) - 1)
    parts, y = [], TOP
    for k, one in enumerate(axes):
        parts.append(_axes(f"{name}-{k}", one, y, span, last=k == len(axes) - 1))
        y += one.height + BETWEEN
    parts.append(text((LEFT + WIDTH - RIGHT) / 2, height - 4, x_label, "middle"))
    return picture(WIDTH, height, label, "".join(parts))


def _axes(name: str, axes: Axes, top: float, span: tuple[float, float], last: bool) -> str:
    bottom, right = top + axes.height, WIDTH - RIGHT
    x_scale = (right - LEFT) / max(span[1] - span[0], 1e-9)
    y_scale = (bottom - top) / max(axes.limits[1] - axes.limits[0], 1e-12)

    def to_x(x: FloatArray) -> FloatArray:
        return np.asarray(LEFT + (x - span[0]) * x_scale)

    def to_y(y: FloatArray) -> FloatArray:
        return np.asarray(bottom - (y - axes.limits[0]) * y_scale)

    across, up = ticks(*span), ticks(*axes.limits, most=max(3, axes.height // 30))
    grid = [line(x := float(to_x(np.array(t))), top, x, bottom) for t in across]
    grid += [line(LEFT, y := float(to_y(np.array(t))), right, y) for t in up]
    y_step = up[1] - up[0] if len(up) > 1 else 1.0
    words = [text(LEFT - 5, float(to_y(np.array(t))) + 4, tick_text(t, y_step), "end") for t in up]
    if last:
        x_step = across[1] - across[0] if len(across) > 1 else 1.0
        words += [_below(float(to_x(np.array(t))), bottom + 14, tick_text(t, x_step)) for t in across]
    words.append(_name(axes, top, bottom))
    drawn = "".join(_drawn(s, to_x, to_y) for s in axes.series)
    window = f'<rect x="{LEFT}" y="{top}" width="{right - LEFT}" height="{axes.height}"/>'
    clip = f'<clipPath id="{name}">{window}</clipPath>'
    words += [_beyond(s, axes.limits, to_x, top, bottom) for s in axes.series]
    inner = f'<g clip-path="url(#{name})"><g transform="scale(.1)">{drawn}</g></g>'
    return clip + "".join(grid) + inner + "".join(words)


def _beyond(
    s: Series,
    limits: tuple[float, float],
    to_x: Callable[[FloatArray], FloatArray],
    top: float,
    bottom: float,
) -> str:
    """Small arrows at the edges, where a line leaves the plot and where it comes back."""
    if s.kind != "line":
        return ""
    marks = ""
    for away, y, down in ((s.y > limits[1], top, 1), (s.y < limits[0], bottom, -1)):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], away.astype(np.int8), [0]])))
        places = [float(to_x(s.x[k])) for a, b in edges.reshape(-1, 2) for k in (a, b - 1)]
        marks += "".join(f"M{x:.1f} {y:.1f}l-3.5 {5 * down}h7z" for x in _apart(places))
    return f'<path class="cut {s.style}" d="{marks}"/>' if marks else ""


def _apart(places: Sequence[float]) -> list[float]:
    """Places of which none is nearer to the one before than an arrow is wide."""
    kept: list[float] = []
    for x in places:
        if not kept or x - kept[-1] > ARROW:
            kept.append(x)
    return kept


def _name(axes: Axes, top: float, bottom: float) -> str:
    """What a plot shows: along its axis, or above it where that is too short."""
    if LETTER * len(axes.label) > axes.height:
        return text(LEFT, max(top - 2, 9), axes.label, "start", "small")
    return text(11, (top + bottom) / 2, axes.label, "middle", "tick", -90)


def _below(x: float, y: float, words: str) -> str:
    """A number under its tick, moved to the left where it would leave the picture."""
    return text(min(x, WIDTH - 1 - 3.4 * len(words)), y, words, "middle")


def _drawn(s: Series, to_x: object, to_y: object) -> str:
    assert callable(to_x) and callable(to_y)
    if s.kind == "band" and s.low is not None:
        rows = extremes(s.y, MOST // 2)
        return f'<path class="{s.style}" d="{band(to_x(s.x[rows]), to_y(s.low[rows]), to_y(s.y[rows]))}"/>'
    ok = np.isfinite(s.y) if s.kind == "dots" else slice(None)
    x, y = s.x[ok], s.y[ok]
    rows = extremes(y, MOST)
    draw = dots if s.kind == "dots" else path
    return f'<path class="{s.style}" d="{draw(to_x(x[rows]), to_y(y[rows]))}"/>'
