"""What a person on board reads has units, and angles in degrees."""

from __future__ import annotations

import numpy as np

from identify.effect import Active
from identify.effects import EFFECTS
from identify.fit import Estimated
from identify.online.surprise import Surprise
from identify.online.suspects import Suspect
from seatrial.online.words import changed, said


def test_numbers_of_a_suspect_have_units_and_angles_are_in_degrees():
    current = next(e for e in EFFECTS if e.name == "current")
    found = (Estimated("", "speed", 0.2561, 0.0, "m/s"), Estimated("", "direction", -1.74, 0.0, "rad"))
    text = said(Suspect(Active(current), found, 9.0, 1e-9, 1.0, np.zeros(0)))
    assert text == "a current that has set in or turned (current: speed 0.256 m/s, direction 260°)"


def test_a_push_in_yaw_is_in_degrees():
    text = changed(Surprise(0.0, 2.0, 9.0, 3.0, 1.0, 1.0, np.array([0.0, 0.0, np.radians(2.0)])), 30.0)
    assert "as if by +2 °/s² in yaw" in text
