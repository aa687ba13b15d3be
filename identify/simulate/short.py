"""Why a manoeuvre was not sailed to its end, in a sentence: how far its heading came in the time that it was given."""

from __future__ import annotations

import math

import numpy as np

from identify.simulate.plant import Track


def short_of_heading(track: Track, order: str, since: float, came: float, wanted: float) -> str:
    """The sentence for a heading that came too little of its way (rad) by the end of the time after an order (s)."""
    found, needed = (f"{math.degrees(angle):.3g}°" for angle in (came, wanted))
    speed = float(np.hypot(*track.states[-1, 3:5]))
    return (
        f"Not reached: in the {track.t[-1] - since:.3g} s that were given after {order} of the helm the heading "
        f"came to {found} of {needed}; at their end the vessel makes {speed:.3g} m/s."
    )
