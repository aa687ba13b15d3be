"""Inputs that a logger enters when they change say more than those that it samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import trials_of

from fixtures.campaign import DEFAULT_SUITE, FORMATS, record_campaign, write_campaign
from fixtures.effects import World
from fixtures.vessels import make_vessel
from identify.on_change import _shortest, changes, with_changes_known
from identify.on_change import known_between as known_by
from identify.prepare import prepare
from preprocess.columns import sampled
from preprocess.trial import Measurement
from seatrial.campaign import load_campaign
from seatrial.pipeline import run
from validate.diagnosis import Verdict

TICK, HEARTBEAT = 0.2, 1.0


def orders(seed=1, seconds=200.0, slew=6):
    """Orders at every tick of a controller that takes some ticks to go from one to the next."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, TICK)
    lasting = rng.integers(20, 70, len(t) // 20)
    value = np.repeat(rng.uniform(-0.5, 0.5, len(lasting)), lasting)[: len(t)]
    return t, np.convolve(np.pad(value, (slew, 0), "edge"), np.ones(slew + 1) / (slew + 1), "valid").round(4)


def entered(t, value, name="rudder", held=False):
    """What a logger enters of them: every change, and once a second besides."""
    new = np.append(True, np.diff(value) != 0.0)
    last, kept = -np.inf, []
    for k, (time, fresh) in enumerate(zip(t, new, strict=True)):
        if fresh or time - last > HEARTBEAT - 1e-9:
            kept.append(k)
            last = time
    step = float(np.median(np.diff(t[kept])))
    return Measurement(name, t[kept], value[kept], 0.0, np.ones(len(kept), bool), sample_time=step, held=held)


def known_between(logs):
    return known_by(logs, _shortest(logs))


def test_what_is_entered_at_changes_is_known_until_a_tick_before_each():
    t, value = orders()
    logged = entered(t, value)
    assert logged.sample_time == pytest.approx(HEARTBEAT)
    (known,) = known_between([logged])
    assert known.sample_time == pytest.approx(TICK)
    there = t <= logged.t[-1]
    np.testing.assert_allclose(sampled(replace(known, held=False), t[there]), value[there], atol=1e-12)
    off = np.abs(sampled(replace(logged, held=False), t[there]) - value[there])
    assert off.max() > 0.05, "straight lines between entries are not what was ordered"


def test_steps_are_told_from_slewing():
    assert known_between([entered(*orders(slew=0))])[0].held
    assert not known_between([entered(*orders(slew=12))])[0].held


def test_where_nothing_but_changes_is_entered_the_value_holds_until_the_next():
    """No heartbeat: what looks like a few samples an hour are steps, and no straight lines between them."""
    t, value = orders(slew=0)
    whole = entered(t, value)
    new = np.append(True, np.diff(whole.value) != 0.0)
    bare = replace(whole, t=whole.t[new], value=whole.value[new], good=whole.good[new], sample_time=9.0)
    (known,) = known_between([bare])
    assert known.held
    assert known.sample_time <= 0.1
    there = t <= bare.t[-1]
    np.testing.assert_allclose(sampled(replace(known, held=False), t[there]), value[there], atol=1e-12)


def seldom(value, every=4.5):
    """Entries that come at even times."""
    t = every * np.arange(len(value))
    return Measurement("rudder", t, np.array(value), 0.0, np.ones(len(t), bool), sample_time=every)


def test_even_intervals_are_orders_where_a_few_values_never_come_twice_in_a_row():
    helm, rng = np.tile([0.35, -0.35, 0.0, -0.35], 8), np.random.default_rng(3)
    assert known_between([seldom(helm)])[0].held
    for drawn in (rng.permutation(helm), rng.normal(0.0, 0.3, 32)):
        assert known_between([seldom(drawn)])[0].sample_time == 4.5, "sampled, whatever was ordered between"


def without_repeats(path, columns):
    """Leave in a table only those entries of some columns that change their value."""
    table = pd.read_csv(path)
    for column in columns:
        table.loc[table[column] == table[column].ffill().shift(), column] = np.nan
    table.to_csv(path, index=False)


@pytest.mark.slow
def test_a_campaign_whose_orders_are_logged_when_they_are_given_lacks_nothing(tmp_path):
    ship = make_vessel("usv")
    runs = record_campaign(
        ship,
        World(()),
        FORMATS["csv"].suite(DEFAULT_SUITE),
        ("zigzag", "random", "zigzag"),
        duration=60,
        seed=3,
    )
    path = write_campaign(tmp_path, ship, runs, "csv")
    for log in tmp_path.glob("*.csv"):
        without_repeats(log, ship.names)
    found = run(load_campaign(path))
    assert found.diagnosis.verdict is Verdict.ADEQUATE
    assert found.validation_after.channels["r"].r2 > 0.95


def test_a_log_with_few_changes_is_read_as_the_others_are():
    t, value = orders()
    still = entered(t, np.full(len(t), 0.1))
    assert known_between([still]) == [still]
    _, known = known_between([entered(t, value), still])
    assert known.sample_time == pytest.approx(TICK)
    assert not changes([known])


@given(st.integers(0, 10_000), st.floats(0.05, 2.0), st.floats(0.0, 0.4))
def test_what_is_sampled_at_times_of_its_own_is_left_as_it_is(seed, step, jitter):
    rng = np.random.default_rng(seed)
    t, value = orders(seed % 7)
    at = np.cumsum(step * (1.0 + jitter * rng.uniform(-1.0, 1.0, int(200.0 / step))))
    at = at[at < t[-1]]
    regular = Measurement(
        "rudder", at, value[np.searchsorted(t, at) - 1], 0.0, np.ones(len(at), bool), sample_time=step
    )
    assert known_between([regular])[0] is regular


def test_a_lead_is_looked_for_within_a_tick_where_changes_are_logged():
    """An input that changes once is entered once a second: that says nothing of any change."""
    _, trials = trials_of("usv", ("zigzag", "random"), 60.0, 5, validate=0)
    rare = []
    for trial in trials:
        rudder = trial.inputs["rudder"]
        seldom = replace(
            rudder, t=rudder.t[::10], value=rudder.value[::10], good=rudder.good[::10], sample_time=1.0
        )
        twice = np.where(seldom.t < 20.0, 10.0, 12.0)
        still = replace(seldom, name="propeller", value=twice, held=True)
        rare.append(replace(trial, inputs={"rudder": entered(rudder.t, rudder.value), "propeller": still}))
    _, spread = prepare(rare, "modulus").structure.input_lead
    assert spread < 0.1
    assert all(m.sample_time < 0.3 for t in with_changes_known(rare) for m in t.inputs.values())


def only_changes(t, value, name="rudder"):
    new = np.append(True, np.diff(value) != 0.0)
    step = float(np.median(np.diff(t[new])))
    return Measurement(name, t[new], value[new], 0.0, np.ones(int(new.sum()), bool), sample_time=step)


def a_straight_run(seed):
    """An autopilot that keeps a course orders something else at every tick."""
    t = np.arange(0.0, 200.0, TICK)
    return t, 0.01 * np.random.default_rng(seed).standard_normal(len(t))


def test_orders_that_one_log_holds_at_every_tick_are_known_to_hold_in_the_others():
    """As often as it is entered in one log, an input might be sampled: the pauses of the others are most of those."""
    logs = [only_changes(*a_straight_run(1)), *(only_changes(*orders(k, slew=0)) for k in (2, 3))]
    assert logs[0].sample_time == pytest.approx(TICK) and logs[1].sample_time > 2.0
    known = known_between(logs)
    assert all(m.sample_time == pytest.approx(TICK) for m in known)
    t, value = orders(2, slew=0)
    there = (t >= logs[1].t[0]) & (t <= logs[1].t[-1])
    assert np.abs(np.interp(t, known[1].t, known[1].value) - value)[there].max() < 1e-9


@given(st.integers(0, 10_000), st.floats(0.0, 0.3))
def test_a_measured_angle_of_which_records_are_lost_is_left_as_it_is(seed, lost):
    rng = np.random.default_rng(seed)
    t, value = a_straight_run(seed)
    kept = np.flatnonzero(rng.uniform(size=len(t)) >= lost)
    kept = kept[(kept < 300) | (kept > 300 + seed % 200)]  # and once for longer
    some = Measurement("rudder", t[kept], value[kept], 0.0, np.ones(len(kept), bool), sample_time=TICK)
    assert known_between([some])[0] is some
