"""Errors before and after, as rows of the report."""

from __future__ import annotations

from validate.diagnosis import ChannelScore, Results, Validation
from validate.report import words
from validate.report.figures import CHANNELS, DEG


def has_two(results: Results) -> bool:
    """Whether effects were taken, so that there is a before and an after."""
    return bool(results.after.effects)


def score_rows(before: Validation, after: Validation) -> list[tuple[str, str, str, str, str]]:
    """Channel, RMSE before and after, R² before and after; position and heading have no R²."""
    rows = []
    for channel, meaning, unit, scale in CHANNELS[:3]:
        b, a = before.channels.get(channel), after.channels.get(channel)
        if b is None or a is None or (b.rmse is None and a.rmse is None):
            continue
        rows.append((f"{channel}, {meaning} ({unit})", scaled(b.rmse, scale), scaled(a.rmse, scale),
                     words.share(b.r2), words.share(a.r2)))  # fmt: skip
    for name, b_value, a_value, scale in (
        ("position (m)", before.position_rmse, after.position_rmse, 1.0),
        ("heading (°)", before.heading_rmse, after.heading_rmse, DEG),
    ):
        if b_value is not None or a_value is not None:
            rows.append((name, scaled(b_value, scale), scaled(a_value, scale), "", ""))
    return rows


def scaled(value: float | None, scale: float) -> str:
    """A number in the unit for reading."""
    return words.number(None if value is None else value * scale)


def log_scores(validation: Validation, name: str) -> dict[str, ChannelScore]:
    """Scores of a log: of its unseen part where it has one."""
    found = sorted((s for s in validation.logs if s.path == name), key=lambda s: s.role != "validate")
    return dict(found[0].channels) if found else {}


def score_words(before: ChannelScore | None, after: ChannelScore | None, two: bool) -> str:
    """``R² −0.68 → 0.999``."""
    last = words.share(after.r2 if after else None)
    if last == "–":
        return ""
    return f"R² {words.share(before.r2 if before else None)} → {last}" if two else f"R² {last}"
