"""What a stretch is called, from what it looks like."""

import numpy as np
import pytest

from preprocess.manoeuvres import Motion, classify

T = np.linspace(0.0, 100.0, 1001)


def motion(speed, turn, steer=None, angle=False):
    """A stretch from the corners of its speed, its yaw rate and its steering, over 100 s."""
    at = [np.interp(T, *np.array(c).T) for c in (speed, turn)]
    psi = np.concatenate([[0.0], np.cumsum(0.5 * (at[1][1:] + at[1][:-1]) * np.diff(T))])
    return Motion(T, at[0], psi, at[1], steer, angle, None, length=1.2)


STEADY, NO_TURN = [(0, 2.0), (100, 2.0)], [(0, 0.0), (100, 0.0)]
COASTS = [(0, 2.0), (20, 2.0), (60, 0.1), (100, 0.05)]
BURST = [(0, 0.05), (5, 0.1), (8, 2.5), (18, 2.5), (25, 0.3), (100, 0.05)]


def test_from_rest_to_rest_is_no_stop():
    assert classify(motion(COASTS, NO_TURN))[0] == "stopping"
    assert classify(motion(BURST, NO_TURN)) == ("speed", "up to 2.50 m/s")
    spun = [(0, 0.0), (20, 0.0), (22, 0.5), (28, 0.5), (30, 0.0), (100, 0.0)]
    assert classify(motion(BURST, spun))[0] == "random"


def test_a_stop_with_turns_is_no_circle_and_a_tight_circle_no_stop():
    swings_round = [(0, 0.0), (30, 0.0), (40, 0.12), (95, 0.12), (100, 0.0)]
    assert classify(motion(COASTS, swings_round))[0] == "stopping"
    tight = [(0, 2.0), (10, 2.0), (30, 0.6), (100, 0.6)]
    kind, detail = classify(motion(tight, [(0, 0.0), (10, 0.0), (15, 0.3), (100, 0.3)]))
    assert (kind, "spot" in detail) == ("circle", False)
    slow = [(0, 0.2), (100, 0.2)]
    assert classify(motion(slow, [(0, 0.0), (10, 0.8), (18, 0.8), (20, 0.0), (100, 0.0)]))[1].endswith(
        "on the spot"
    )


@pytest.mark.parametrize("angle", [True, False])
def test_a_zigzag_may_begin_and_end_amidships_and_has_angles_where_a_rudder_makes_it(angle):
    steer = np.select([T < 8, T < 30, T < 52, T < 74, T < 90], [0.02, 0.35, -0.35, 0.35, -0.35], 0.01)
    rates = np.select([T < 8, T < 30, T < 52, T < 74, T < 90], [0.0, 0.02, -0.04, 0.04, -0.02], 0.0)
    kind, detail = classify(motion(STEADY, np.column_stack([T, rates]), steer, angle))
    assert kind == "zigzag"
    assert detail.startswith("20/") if angle else detail == ""
