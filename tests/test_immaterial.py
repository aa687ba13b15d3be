"""When an effect counts as next to nothing: no channel of the free runs is worse without it, or hardly."""

from __future__ import annotations

import numpy as np
import pytest

from validate import sure

NOISE = [1.2e-2, 6.9e-4, 8.7e-5]


@pytest.mark.parametrize(
    ("without", "little"),
    [
        (NOISE, True),
        ([1.3e-2, 7.0e-4, 9.0e-5], True),  # in no channel by a tenth
        ([1.2e-2, 6.9e-4, 3.8e-4], True),  # four times in yaw alone, which is two hundredths of its spread
        ([1.3e-2, 1.1e-3, 3.8e-4], False),  # yaw and sway, which surge would hide
        ([1.2e-2, 6.9e-4, 1.0e-3], False),
        ([1.6e-2, 6.9e-4, 8.7e-5], False),
    ],
)
def test_every_channel_is_asked(monkeypatch, without, little):
    errors = {"with": np.array(NOISE), "without": np.array(without)}
    monkeypatch.setattr(sure, "free_running_errors", errors.get)
    assert sure._immaterial("with", "without") is little
