"""Columns of one name, units of German tachometers, and how ``inspect`` shows them."""

import numpy as np
import pytest

from ingest import read_log
from ingest.tabular.dialect import detect
from ingest.tabular.naming import split_unit
from ingest.units import factor_to_si
from seatrial.cli.tables import fields, span
from seatrial.inspection import FieldFacts, TopicFacts, inspect_log


def log_of(folder, header, *columns):
    """A table of ten rows a second with columns beside the time."""
    t = 0.1 * np.arange(50)
    np.savetxt(
        folder / "a.csv",
        np.column_stack([t, *columns]),
        delimiter=",",
        header=f"t,{header}",
        comments="",
        fmt="%.3f",
    )
    return read_log(folder / "a.csv")


SWEEP = 20.0 * np.sin(np.arange(50) / 5.0)


@pytest.mark.parametrize(
    ("first", "said"),
    [(0.0 * SWEEP, "; the first never changes"), (SWEEP, "; they are the same"), (-SWEEP, "")],
)
def test_columns_of_one_name_are_named_and_have_its_unit(tmp_path, first, said):
    log = log_of(tmp_path, "rudder_deg,rudder_deg", first, SWEEP)
    notes = [f.message for f in log.findings if f.kind == "note"]
    text = "2 columns are called 'rudder_deg': the first is read as that, the others as 'rudder_deg.1'"
    assert notes == [text + said]
    assert log.units["", "rudder_deg.1"] == "deg"
    shown = [c.signal for c in inspect_log(log).candidates]
    assert sorted(shown) == ["rudder_deg", "rudder_deg.1"]


def test_columns_of_one_name_keep_their_own_units_below():
    assert detect(b"t,rpm,rpm\ns,rpm,rev/s\n" + b"0,1,2\n" * 9).units == {
        "t": "s",
        "rpm": "rpm",
        "rpm.1": "rev/s",
    }


@pytest.mark.parametrize(("name", "plain"), [("v1.2", "v1_2"), ("servo.12", "servo"), ("x [m].1", "x")])
def test_what_a_name_ends_in(name, plain):
    assert split_unit(name)[0] == plain


@pytest.mark.parametrize("unit", ["1/min", "U/min", "min-1", "r/min"])
def test_revolutions_a_minute_by_other_names(tmp_path, unit):
    log = log_of(tmp_path, f"engine [{unit}]", 900.0 + SWEEP)
    [source] = [s for s in log.sources if s.quantity == "propeller"]
    assert (source.name, source.unit) == (f"engine [{unit}]", "rpm")
    assert factor_to_si(unit) == pytest.approx((1.0 / 60.0, 0.0))


def test_ranges_show_as_many_digits_as_tell_their_ends_apart():
    assert span(54.3217, 54.3298) == "54.32…54.33"
    assert span(-20.0, 1200.4) == "-20…1200"
    assert span(1200.1, 1200.4) == "1200.1…1200.4"
    assert span(3.0, 3.0) == "always 3"


def test_the_elements_of_a_large_array_are_shown_as_one():
    names = ["x", *(f"pose.covariance[{i}]" for i in range(36)), "servo[0]", "servo[1]"]
    topic = TopicFacts("/odom", 5, 1.0, 0, (), tuple(FieldFacts(n, "", 0.0, 1.0) for n in names))
    assert fields(topic) == "x, pose.covariance[0…35], servo[0], servo[1]"
