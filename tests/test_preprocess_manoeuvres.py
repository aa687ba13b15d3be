"""What a stretch is called, from what it looks like."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from preprocess.manoeuvres import Motion, classify, classify_stretch
from preprocess.trial import Measurement
from preprocess.zigzag import zigzag_angles

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


@pytest.mark.parametrize(
    ("turns", "kind"), [((370, -380), "circle"), ((60, 20, -99, -30, 290, -150, -60, -9), "random")]
)
def test_circles_to_both_sides_are_most_of_the_turning(turns, kind):
    steps = np.radians(np.repeat(turns, 1000 // len(turns)) / (100 / len(turns)))
    rate = np.append(steps, np.zeros(len(T) - len(steps)))
    assert classify(motion(STEADY, np.column_stack([T, rate]), rate))[0] == kind


@pytest.mark.parametrize("angle", [True, False])
def test_a_zigzag_may_begin_and_end_amidships_and_has_angles_where_a_rudder_makes_it(angle):
    steer = np.select([T < 8, T < 30, T < 52, T < 74, T < 90], [0.02, 0.35, -0.35, 0.35, -0.35], 0.01)
    rates = np.select([T < 8, T < 30, T < 52, T < 74, T < 90], [0.0, 0.02, -0.04, 0.04, -0.02], 0.0)
    kind, detail = classify(motion(STEADY, np.column_stack([T, rates]), steer, angle))
    assert kind == "zigzag"
    assert detail == ("20/25" if angle else "")


def zigzag(rudder, switch, rate, dead=0.0, base=0.0, lead=5.0, step=0.05, duration=150.0):
    """Time, heading and rudder of a zigzag by Nomoto's first-order model, rad; the rudder moves at ``rate`` °/s."""
    t = np.arange(0.0, duration, step)
    psi, steer, moves = np.full(len(t), base), np.zeros(len(t)), [(-np.inf, 0.0)]
    order, r = 0.0, 0.0
    for k in range(1, len(t)):
        off = psi[k - 1] - base
        wanted = (
            1.0 if not order and t[k] > lead else -np.sign(off) if abs(off) >= np.radians(switch) else order
        )
        if wanted != order:
            order = wanted
            moves.append((t[k] + dead, order * np.radians(rudder)))
        target = [angle for at, angle in moves if at <= t[k]][-1]
        most = np.radians(rate) * step
        steer[k] = steer[k - 1] + np.clip(target - steer[k - 1], -most, most)
        r += step * (0.15 * steer[k] - r) / 4.0
        psi[k] = psi[k - 1] + step * r
    return t, psi, steer


@pytest.mark.parametrize("angles", [(20, 20), (20, 10), (10, 10), (30, 5), (15, 1), (35, 17)])
@pytest.mark.parametrize("rate", [2.5, 5.0, 20.0, 1e6])
def test_a_zigzag_is_called_by_its_orders_however_slow_the_rudder_is(angles, rate):
    rudder, switch = angles
    t, psi, steer = zigzag(rudder, switch, rate, base=2.0)
    slow = (
        rate == 2.5 and rudder >= 30
    )  # ordered back before it is over: the rudder's angle is not to be seen
    assert zigzag_angles(t, psi, steer) == ("" if slow else f"{rudder}/{switch}")
    late = t > 40.0
    assert zigzag_angles(t[late], psi[late], steer[late]) == ("" if slow else f"{rudder}/{switch}")


def test_what_the_vessel_turns_on_before_the_rudder_moves_is_no_other_angle():
    t, psi, steer = zigzag(20, 5, 10.0, dead=0.3)
    moved = np.abs(psi[np.flatnonzero(np.diff(np.abs(steer)) < -1e-3)])
    assert np.degrees(np.abs(moved)).min() > 5.3
    assert zigzag_angles(t, psi, steer) == "20/5"
    noise = np.random.default_rng(1).normal(0.0, np.radians(0.3), len(t))
    assert zigzag_angles(t, psi, steer + noise) == "20/5"


def test_orders_at_no_one_heading_have_no_angle():
    rng = np.random.default_rng(2)
    steer = np.repeat(np.where(np.arange(30) % 2, 0.35, -0.35), rng.integers(20, 150, 30))
    t = 0.1 * np.arange(len(steer))
    assert zigzag_angles(t, np.cumsum(0.02 * steer), steer) == ""
    u, psi, held = zigzag(30, 5, 1e6)
    assert zigzag_angles(u, psi, held, 0.1) == "30/5"
    assert zigzag_angles(u, psi, held, 2.0) == "", (
        "it turns on by degrees from one sample of the rudder to the next"
    )
    assert zigzag_angles(t, np.zeros(len(t)), np.zeros(len(t))) == ""
    assert zigzag_angles(t, rng.normal(0.0, 0.1, len(t)), rng.normal(0.0, 0.1, len(t))) == ""


@pytest.mark.parametrize("first", [-35.0, -999.0, 999.0])
def test_a_rudder_that_begins_beyond_its_side_costs_no_label(first):
    t, psi, steer = zigzag(20, 20, 1e6)
    over = np.flatnonzero(steer > 0.0)[0]
    t, psi, steer = t[over - 1 :], psi[over - 1 :], steer[over - 1 :].copy()
    steer[0] = np.radians(first)
    assert zigzag_angles(t, psi, steer) == "20/20"


SIZES = st.integers(0, 40)
WILD = st.sampled_from([0.0, 0.35, -0.35, 0.3, -0.6, 17.4, -17.4, 1e30, -1e30]) | st.floats(-1e30, 1e30)
WILDER = WILD | st.sampled_from([np.nan, np.inf, -np.inf])


@given(st.data())
def test_whatever_rudder_and_heading_show_zigzag_angles_are_words(data):
    n = data.draw(SIZES)
    psi, steer = (data.draw(arrays(float, n, elements=WILDER)) for _ in range(2))
    assert isinstance(zigzag_angles(0.1 * np.arange(n), psi, steer, 0.1), str)


@given(st.data())
def test_whatever_the_inputs_show_a_stretch_has_a_name(data):
    n = data.draw(SIZES)
    speed, turn = (data.draw(arrays(float, n, elements=st.floats(-30.0, 30.0))) for _ in range(2))
    t = 0.5 * np.arange(n)
    states = pd.DataFrame({"t": t, "u": speed, "v": 0.0, "psi": np.cumsum(0.5 * turn), "r": turn})
    inputs = {}
    for name in ("rudder", "prop"):
        value = data.draw(arrays(float, data.draw(SIZES), elements=WILDER))
        good, held = np.isfinite(value) & data.draw(st.booleans()), data.draw(st.booleans())
        inputs[name] = Measurement(name, 0.3 * np.arange(len(value)), value, 0.0, good, held=held)
    named = data.draw(st.sampled_from([None, "zigzag", "circle", "spiral", "stopping", "speed"]))
    found = classify_stretch(states, inputs, 1.2, frozenset(["rudder"]), named)
    assert bool(found) == (n >= 10) and all(isinstance(f.kind + f.detail, str) for f in found)


def test_what_a_campaign_calls_a_log_is_believed_unless_it_calls_it_idle():
    t, psi, steer = zigzag(10, 10, 10.0, duration=44.0)
    states = pd.DataFrame({"t": t, "u": 2.0, "v": 0.0, "psi": psi, "r": np.gradient(psi, t)})
    inputs = {"rudder": Measurement("rudder", t, steer, 0.0, np.ones(len(t), bool))}
    found = [
        classify_stretch(states, inputs, 1.2, frozenset(["rudder"]), d)[0] for d in (None, "idle", "zigzag")
    ]
    assert [f.kind for f in found] == ["random", "random", "zigzag"]
    assert found[-1].detail == "10/10"


def test_a_moment_before_it_lies_idle_is_no_manoeuvre():
    t = np.linspace(0.0, 60.0, 601)
    fast = np.where((t < 0.4) | (t > 30.0), 2.0, 0.0)
    states = pd.DataFrame({"t": t, "u": fast, "v": 0.0, "psi": 0.0, "r": 0.0})
    found = classify_stretch(states, {}, 1.2)
    assert [(f.kind, round(f.start), round(f.end)) for f in found] == [("idle", 0, 30), ("straight", 30, 60)]
