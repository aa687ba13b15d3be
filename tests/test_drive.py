"""What drives a stretch, and how it changes with the parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import PROPELLER, RUDDER, structure_of
from test_kernel import stretch_of

from identify.drive import directions, drive
from identify.kernel import CHANNEL
from identify.structure import null_parameters


def test_a_lead_of_the_inputs_moves_the_channels_as_the_inputs_change():
    """What the directions say of a lead, summed over time, is what the inputs changed by."""
    structure, stretch = (
        replace(structure_of("modulus"), input_lead=(0.0, 0.05)),
        stretch_of((RUDDER, PROPELLER)),
    )
    p = null_parameters(structure)
    here = drive(structure, p, stretch)
    ways = directions(structure, p, stretch, here)
    lead = list(structure.general).index(len(structure.slots) - 1)
    up, down = (
        drive(structure, p + np.where(np.arange(len(p)) == len(p) - 1, x, 0.0), stretch)
        for x in (0.02, -0.02)
    )
    slope = (up.channels - down.channels) / 0.04
    assert np.abs(slope).max() > 0.1
    for column, (place, which) in zip(ways.values.T, ways.driven, strict=True):
        if which == lead:
            true = np.cumsum(slope[:, place - CHANNEL]) * stretch.h
            assert np.cumsum(column) * stretch.h == pytest.approx(true, abs=0.02 * np.ptp(true))
