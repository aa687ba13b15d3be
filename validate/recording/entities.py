"""Where things are in the recording: entity paths, colours and names, for files and for live views alike."""

from __future__ import annotations

from validate.report.names import slug

APPLICATION = "seatrial"
ELAPSED, UTC = "elapsed", "utc"
REPORT, VERDICT, EVENTS = "report", "verdict", "events"
DIAGNOSIS = "diagnosis"
OVERVIEW = "overview"

RGBA = tuple[int, int, int, int]
#: Colours that stand out by 3 to 1 at least from the viewer's dark and from its light ground.
COLOURS: dict[str, RGBA] = {
    "raw": (130, 140, 150, 110),
    "outliers": (235, 75, 65, 255),
    "cleaned": (60, 150, 150, 130),
    "measured": (130, 140, 150, 110),
    "smoothed": (143, 143, 143, 255),
    "band": (110, 120, 130, 255),
    "noise": (110, 120, 130, 255),
    "before": (226, 120, 40, 255),
    "after": (55, 140, 230, 255),
    "commanded": (143, 143, 143, 255),
    "actuator": (55, 140, 230, 255),
    "current": (40, 155, 88, 255),
    "wind": (170, 100, 220, 255),
}


def log_root(name: str) -> str:
    """Entity under which everything of one log hangs; ``name`` is its unique file name."""
    return f"logs/{slug(name)}"


def plan(name: str, part: str) -> str:
    """Plan view: ``raw``, ``outliers``, ``smoothed``, ``before``, ``after``, ``current``."""
    return f"{log_root(name)}/plan/{part}"


def chart(name: str, part: str) -> str:
    """Map view, the same parts in latitude and longitude."""
    return f"{log_root(name)}/map/{part}"


def signal(name: str, signal_name: str, part: str) -> str:
    """A signal: ``raw``, ``outliers``, ``cleaned``, ``smoothed``, ``band/low``, ``band/high``."""
    return f"{log_root(name)}/signals/{signal_name}/{part}"


def prediction(name: str, channel: str, part: str) -> str:
    """A channel: ``measured``, ``smoothed``, ``before``, ``after``.

    What was measured lies in a folder that comes first, because the viewer draws in the order of the paths.
    """
    part = f"actual/{part}" if part in ("measured", "smoothed") else part
    return f"{log_root(name)}/prediction/{channel}/{part}"


def residual(name: str, channel: str, part: str) -> str:
    """Smoothed minus predicted: ``before``, ``after``, ``noise/low``, ``noise/high``."""
    return f"{log_root(name)}/residual/{channel}/{part}"


def actuator(name: str, input_name: str, part: str) -> str:
    """An input: ``commanded``, ``actuator``; the latter is drawn over the former."""
    part = "made/actuator" if part == "actuator" else part
    return f"{log_root(name)}/inputs/{slug(input_name)}/{part}"
