"""How well the parameters are known: their intervals and their correlations, as pictures."""

from __future__ import annotations

import numpy as np

from identify.fit import Estimated, Fit
from preprocess.trial import FloatArray
from validate.report.figures import Figure
from validate.report.labels import in_words
from validate.report.svg import line, picture, text
from validate.report.thinning import IntArray
from validate.report.words import number, plain_name

ROW, LEFT, WIDTH = 18, 60, 420
#: Pixels of a letter, about.
LETTER = 6.3
#: Correlations above this are named under the heat map.
STRONG = 0.95
#: Parameters of a heat map at most, and pixels of its narrowest cell, which a line of its names needs.
MOST_DRAWN, NARROWEST = 20, 12.5


def all_parameters(fit: Fit) -> list[Estimated]:
    """Coefficients, then the effects' parameters: the order of the covariance."""
    return [*fit.coefficients, *(p for e in fit.effects for p in e.parameters)]


def labels(fit: Fit) -> list[str]:
    """A short name for each parameter."""
    own, names = [p.name for p in fit.coefficients], [e.name for e in fit.effects]
    begins = [
        in_words(e.name) + (f" of {e.input}" if e.input and names.count(e.name) > 1 else "")
        for e in fit.effects
    ]
    of_effects = zip(begins, fit.effects, strict=True)
    return own + [f"{begin}: {plain_name(p.name)}" for begin, e in of_effects for p in e.parameters]


def interval_figure(fit: Fit) -> Figure | None:
    """95 % intervals of all parameters relative to their estimates; those that span zero stand out."""
    rows = [
        (n, 1.96 * abs(p.stderr / p.value), p)
        for n, p in zip(labels(fit), all_parameters(fit), strict=True)
        if np.isfinite([p.value, p.stderr]).all() and p.value
    ]
    if not rows:
        return None
    height = ROW * len(rows) + 30
    edge = max(LEFT, min(WIDTH / 2, 12 + LETTER * max(len(name) for name, _, _ in rows)))
    grid = "".join(
        line(x := _across(v, edge), 4, x, height - 24, "axis" if v == 0 else "grid")
        + text(x, height - 8, f"{v:.0%}".replace("-", "−"), "middle")
        for v in (-1.0, 0.0, 1.0, 2.0, 3.0)
    )
    body = grid + "".join(
        _interval(12 + ROW * k, edge, name, half, p) for k, (name, half, p) in enumerate(rows)
    )
    unsure = sum(half >= 1 or not p.identifiable for _, half, p in rows)
    caption = "95 % intervals, as a share of the estimate; beyond 0 the sign is not known"
    label = (
        f"95 % intervals of {len(rows)} parameters relative to their estimates; {unsure} are not well known"
    )
    return Figure(caption, picture(WIDTH, height, label, body))


def _across(value: float, edge: float) -> float:
    """Pixel of a relative value between −1 and 3."""
    return edge + (float(np.clip(value, -1.0, 3.0)) + 1.0) / 4.0 * (WIDTH - edge - 20)


def _interval(y: float, edge: float, name: str, half: float, p: Estimated) -> str:
    style = "after" if half < 1 and p.identifiable else "before"
    bar = line(_across(1 - half, edge), y, _across(1 + half, edge), y, f"interval {style}")
    dot = f'<circle class="dot {style}" cx="{_across(1.0, edge):.1f}" cy="{y}" r="3.2"/>'
    return text(edge - 6, y + 4, name, "end") + bar + dot


def correlation(fit: Fit) -> FloatArray:
    """Correlation matrix of the parameters, (p, p); NaN where a variance is not positive."""
    cov = np.asarray(fit.covariance, dtype=np.float64)
    if cov.ndim != 2 or cov.shape[0] != cov.shape[1]:
        return np.empty((0, 0))
    var = np.diag(cov)
    sd = np.sqrt(np.where(var > 0, var, np.nan))
    return np.asarray(cov / np.outer(sd, sd))


def strong_pairs(fit: Fit) -> list[str]:
    """Pairs of parameters that the data hardly tell apart, strongest first."""
    rho, names = correlation(fit), labels(fit)
    if len(rho) != len(names):
        return []
    i, j = np.triu_indices(len(rho), 1)
    value = np.nan_to_num(rho[i, j])
    order = np.argsort(-np.abs(value), kind="stable")
    return [
        f"{names[i[k]]} and {names[j[k]]} ({number(float(value[k]), 3)})"
        for k in order
        if abs(value[k]) > STRONG
    ]


def correlation_figure(fit: Fit) -> Figure | None:
    """Heat map of the correlations; positive and negative in two colours, strength as opacity.

    Of more parameters than have legible names those are drawn that go most with another.
    """
    rho, names = correlation(fit), labels(fit)
    count = len(names)
    if len(rho) != count or count < 2:
        return None
    kept = most_correlated(rho)
    rho, names = rho[np.ix_(kept, kept)], [names[k] for k in kept]
    edge = 8 + 6.2 * max(map(len, names))
    cell = max(NARROWEST, min(34.0, (WIDTH - edge) / len(kept)))
    wide = edge + cell * len(kept) + 4
    body = "".join(_cells(rho, edge, cell))
    for k, name in enumerate(names):
        middle = edge + cell * (k + 0.5)
        body += text(edge - 4, middle + 3.5, name, "end", "small") + text(
            middle + 3.5, edge - 4, name, "start", "small", -90
        )
    strongest = "; ".join(strong_pairs(fit)[:3]) or f"none above {STRONG}"
    of = "" if len(kept) == count else f" of the {len(kept)} of {count} parameters that go most with another"
    label = f"correlations of the {count} parameters; strongest: {strongest}"
    return Figure(f"Correlations{of}: blue positive, orange negative", picture(wide, wide, label, body))


def most_correlated(rho: FloatArray) -> IntArray:
    """Rows of a correlation matrix that are drawn, in order: all, or of many those that go most with another."""
    apart = np.abs(np.nan_to_num(rho)) * (1.0 - np.eye(len(rho)))
    return np.sort(np.argsort(-apart.max(axis=1), kind="stable")[:MOST_DRAWN])


def _cells(rho: FloatArray, edge: float, cell: float) -> list[str]:
    """One square per pair; all but the faintest."""
    strength = np.round(np.abs(np.nan_to_num(rho)), 1)
    rows, columns = np.nonzero(strength > 0)
    side = f'width="{cell - 1:.1f}" height="{cell - 1:.1f}"'
    return [
        f'<rect class="{"pos" if rho[i, j] > 0 else "neg"}" x="{edge + cell * j:.1f}" '
        f'y="{edge + cell * i:.1f}" {side} fill-opacity="{strength[i, j]:.1f}">'
        f"<title>{number(float(rho[i, j]), 2)}</title></rect>"
        for i, j in zip(rows.tolist(), columns.tolist(), strict=True)
    ]
