"""From the logs of a sea trial to a manoeuvring model, how far to trust it, and what it lacks.

::

    from seatrial import load_campaign, load_model, read_log, run, simulate
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identify.similar import prime_coefficients, similar
    from identify.simulate import simulate
    from ingest import read_log
    from seatrial.campaign import Campaign, load_campaign
    from seatrial.models import load_model
    from seatrial.pipeline import run

__all__ = [
    "Campaign",
    "load_campaign",
    "load_model",
    "prime_coefficients",
    "read_log",
    "run",
    "similar",
    "simulate",
]

#: Where each public name lives: imported when it is first used, so that the command line starts at once.
_HOMES = {
    "Campaign": "seatrial.campaign",
    "load_campaign": "seatrial.campaign",
    "load_model": "seatrial.models",
    "prime_coefficients": "identify.similar",
    "read_log": "ingest",
    "run": "seatrial.pipeline",
    "similar": "identify.similar",
    "simulate": "identify.simulate",
}


def __getattr__(name: str) -> object:
    """The public name ``name``."""
    if name not in _HOMES:
        raise AttributeError(f"module 'seatrial' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
