"""Numbers that are no value of an input are set aside and told; what an actuator does is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ingest.codes import CODES
from ingest.log import Log
from ingest.tabular.naming import sources_of
from preprocess.actuators import read_input
from preprocess.commands import judge_input
from preprocess.guessed_units import in_one_unit
from preprocess.vessel import Input
from preprocess.wild import wild

T = 0.1 * np.arange(1200)
PROP = 22.5 + 2.5 * np.sign(np.sin(0.2 * T))
RUDDER = 20.0 * np.sign(np.sin(0.3 * T))
PWM = (1100.0, 1500.0, 1900.0)


def log_of(value, t=T):
    index = pd.Index(np.rint(1e9 * t).astype(np.int64), name="t_ns")
    return Log(Path("a.csv"), "csv", {"": pd.DataFrame({"raw": value}, index=index)})


def with_some(value, some, *places):
    out = value.astype(float).copy()
    out[list(places)] = some
    return out


@pytest.mark.parametrize("code", [*CODES, 3.4028234663852886e38, np.inf])
def test_codes_for_no_value_are_set_aside_however_many(code):
    value = with_some(PROP, code, *range(0, 1200, 30), *range(400, 500))
    assert np.flatnonzero(wild(T, value)).tolist() == np.flatnonzero(value == code).tolist()


@pytest.mark.parametrize("places", [[0], [600], [600, 601], [1199]])
@pytest.mark.parametrize("value", [4711.0, -1234.5])
def test_one_or_two_samples_far_off_are_set_aside(places, value):
    assert np.flatnonzero(wild(T, with_some(PROP, value, *places))).tolist() == places


@pytest.mark.parametrize("rest", [0.0 * T, 0.5 * np.sin(T), np.full(1200, 5.0), RUDDER])
def test_a_step_and_a_kick_are_none(rest):
    """A propeller that turns once, however short, in a log in which it stands still or hardly turns."""
    assert not wild(T, with_some(rest, 9.0, 600)).any()
    assert not wild(T, with_some(rest, 9.0, 600, 601)).any()
    assert not wild(T, with_some(rest, 400.0, 600, 601, 602)).any()
    assert not wild(10.0 * T, with_some(rest, 400.0, 600, 601)).any()


def test_an_order_that_was_entered_once_is_none():
    seldom = with_some(0.1 * np.sin(T), 20.0, 600)
    assert wild(T, seldom).any()
    assert not wild(20.0 * T, seldom).any()
    later = T + np.where(np.arange(1200) > 600, 30.0, 0.0)
    assert not wild(later, seldom).any()


@given(
    st.lists(
        st.tuples(st.sampled_from([-35.0, -20.0, 0.0, 5.0, 20.0, 35.0]), st.integers(1, 40)), max_size=20
    )
)
def test_no_rudder_order_is_wild(orders):
    value = np.concatenate([np.full(n, x) for x, n in orders] or [np.zeros(0)])
    turned = wild(0.1 * np.arange(len(value)), value)
    lasting = np.ptp(value[np.abs(value) > 0]) if (value != 0).any() else 0.0
    assert not turned[np.abs(value) <= 10.0 * lasting].any()


@given(st.lists(st.floats(), max_size=30), st.booleans())
def test_whatever_a_column_holds_is_judged(values, calibrated):
    found = wild(0.1 * np.arange(len(values)), np.array(values, float), PWM if calibrated else ())
    assert found.dtype == bool and len(found) == len(values)
    assert not found[np.isnan(values)].any()


def test_raw_values_far_beyond_a_calibration_are_set_aside():
    value = 1500.0 + 300.0 * np.sign(np.sin(0.2 * T))
    declared = Input("port", "thruster", "raw", pwm=PWM, value=(-1.0, 0.0, 1.0))
    long = with_some(value, 64000.0, *range(100, 160))
    raw, _ = read_input(log_of(long), declared)
    assert len(raw.t) == 1140
    assert raw.remarks == (
        "port: 60 of 64000 in 'raw' were set aside as no value of it; the other 1140 go from 1200 to 1800.",
    )
    assert len(read_input(log_of(with_some(value, 2100.0, 100)), declared)[0].t) == 1200


def test_the_end_of_a_calibration_is_a_command():
    ends = (-32768.0, 0.0, 32767.0)
    assert not wild(T, with_some(100.0 * np.sin(T), 32767.0, *range(100, 160)), ends).any()


def test_nothing_but_codes_is_said_to_be_nothing_else():
    declared = Input("prop", "propeller", "raw", unit="rev/s")
    raw, _ = read_input(log_of(np.full(1200, np.inf)), declared)
    assert len(raw.t) == 0 and raw.remarks[0].endswith("there is no other.")


def test_a_calibration_of_another_actuator_sets_nothing_aside():
    declared = Input("port", "thruster", "raw", pwm=(0.0, 1.0), value=(-1.0, 1.0))
    raw, _ = read_input(log_of(1500.0 + RUDDER), declared)
    assert len(raw.t) == 1200 and not raw.remarks


def test_what_is_said_names_column_count_and_values():
    declared = Input("prop", "propeller", "raw", unit="rev/s")
    some = with_some(with_some(PROP, -9999.0, *range(0, 1200, 30)), 65535.0, 7)
    raw, _ = read_input(log_of(some), declared)
    assert raw.remarks == (
        "prop: 40 of -9999, 1 of 65535 in 'raw' were set aside as no value of it; the other 1159 go from 20 to 25.",
    )
    judged = judge_input(raw)
    assert judged.good.sum() == len(judged.t) == 1159
    assert set(judged.value) == {20.0, 25.0} and judged.held


def test_a_unit_is_told_by_what_is_one():
    declared = Input("rudder", "rudder", "raw")
    log = log_of(with_some(np.radians(RUDDER), -999.0, 300))
    assert in_one_unit([declared], [log])[0].unit == "rad"
    assert read_input(log, declared)[1] == "rad"
    table = pd.DataFrame({"propeller": with_some(PROP, 65535.0, 3)}, index=log_of(PROP).tables[""].index)
    assert [s.unit for s in sources_of(table, {})] == ["rev/s"]
