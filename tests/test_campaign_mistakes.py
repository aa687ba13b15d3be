"""campaign.toml: what is wrong with it is named: key, what was expected, what was found, what was meant."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from campaign_samples import FULL, SMALL, THRUSTER, load, with_logs
from hypothesis import given
from hypothesis import strategies as st

from ingest.errors import CampaignError, MissingLog, SeatrialError, UsageError
from seatrial.campaign import load_campaign
from seatrial.campaign.load import checked

#: What is replaced by what; the key, what was expected, what was found, what was meant.
WRONG = [
    ("kind =", "knd =", "[inputs.rudder] knd", "one of kind, signal", "the unknown key 'knd'", "kind"),
    ('"rudder"', '"ruder"', "[inputs.rudder] kind", "'propeller'", "'ruder'", "rudder"),
    ("[vessel]", "[vesel]", "[vesel]", "one of vessel, inputs", "the unknown key 'vesel'", "vessel"),
    ("length = 1.0", 'length = "1"', "[vessel] length", "a number", "'1'", None),
    ("length = 1.0", "length = true", "[vessel] length", "a number", "true", None),
    ("length = 1.0", "length = 0", "[vessel] length", "a number above 0", "0", None),
    ("length = 1.0", "length = nan", "[vessel] length", "a finite number", "nan", None),
    ("length = 1.0", "", "[vessel] length", "the key 'length'", "none", None),
    ("beam = 0.3", "beam = 30", "[vessel] beam", "at most the length, 1 m", "30", None),
    (
        "beam = 0.3",
        "beam = 0.3\nantenna = [40, 0]",
        "[vessel] antenna",
        "the length, 1 m",
        "[40.0, 0.0]",
        None,
    ),
    ("beam = 0.3", "beam = 0.3\nimu = [0, -1.2]", "[vessel] imu", "a place on board", "[0.0, -1.2]", None),
    (
        "beam = 0.3",
        "beam = 0.3\nmagnetic_variation_deg = 400",
        "[vessel] magnetic_variation_deg",
        "between -180 and 180",
        "400",
        None,
    ),
    (
        'kind = "rudder"',
        'kind = "rudder"\nposition = [-45, 0]',
        "[inputs.rudder] position",
        "no farther from the origin",
        "[-45.0, 0.0]",
        None,
    ),
    ("beam = 0.3", "beam = 0.3\nantenna = [1]", "[vessel] antenna", "at least 2", "the list [1]", None),
    ("beam = 0.3", "beam = 0.3\n[vessel.rudder]\nA = 'x'", "[vessel.rudder] A", "a number", "'x'", None),
    ('name = "blanke"', 'name = "blank"', "[model] name", "nomoto1", "'blank'", "blanke"),
    ('name = "blanke"', 'estimator = "lsvm"', "[model] estimator", "lssvm", "'lsvm'", "lssvm"),
    ('name = "blanke"', 'optimiser = "cma-es"', "[model] optimiser", "cmaes", "'cma-es'", "cmaes"),
    ('kind = "rudder"', 'kind = "rudder"\npwm = [1, 2]', "[inputs.rudder] value", "as many", "none", None),
    (
        'kind = "rudder"',
        'kind = "rudder"\npwm = [1, 2]\nvalue = [1, 2, 3]',
        "[inputs.rudder] value",
        "2",
        "3",
        None,
    ),
    (
        'kind = "rudder"',
        'kind = "rudder"\npwm = [1, 1]\nvalue = [1, 2]',
        "[inputs.rudder] pwm",
        "rise",
        "[1.0",
        None,
    ),
    (
        'kind = "rudder"',
        'kind = "rudder"\npwm = [1, 2]\nvalue = [1, 2]\nunit = "deg"',
        "[inputs.rudder] unit",
        "either a unit or a calibration",
        "'deg'",
        None,
    ),
    (
        'kind = "rudder"',
        'kind = "rudder"\nunit = "degs"',
        "[inputs.rudder] unit",
        "rad, deg",
        "'degs'",
        "deg",
    ),
    (
        'kind = "rudder"',
        'kind = "rudder"\nlaw = "linear"',
        "[inputs.rudder] law",
        "no thrust",
        "'linear'",
        None,
    ),
    ('kind = "rudder"', 'kind = "tunnel"', "[inputs.rudder] signal", "TOPIC.FIELD", "none", None),
    (
        'kind = "rudder"',
        'kind = "azimuth"\nsignal = "x"\ndrives = "n"\n[inputs.m]\nkind = "propeller"',
        "[inputs.rudder] drives",
        "(m)",
        "'n'",
        None,
    ),
    ("[inputs.rudder]", "[inputs.psi]", "[inputs.psi]", "no other column", "'psi'", None),
    ("[inputs.rudder]", '[inputs."my rudder"]', "[inputs.my rudder]", "letters", "'my rudder'", None),
    (
        'kind = "rudder"',
        THRUSTER + '\n[sensors.headng]\nunit="deg"',
        "[sensors.headng]",
        "heading",
        "headng",
        "heading",
    ),
    (
        "[model]",
        "[sensors.heading]\nunit='degre'\n[model]",
        "[sensors.heading] unit",
        "deg, rad",
        "'degre'",
        "deg",
    ),
    (
        "[model]",
        "[sensors.position]\nnorth='x'\n[model]",
        "[sensors.position]",
        "north and east",
        "north",
        None,
    ),
    (
        "[model]",
        "[sensors.heading]\nlatency = 1e5\n[model]",
        "[sensors.heading] latency",
        "at most 60 (how late the time stamps are, s",
        "100000.0",
        None,
    ),
    (
        "[model]",
        "[sensors.heading]\noffset = 57.3\n[model]",
        "[sensors.heading] offset",
        "the offset in rad, at most 2π (57.3° are 1 rad)",
        "57.3",
        None,
    ),
    (
        'kind = "rudder"',
        'kind = "rudder"\npwm = [1, 2]\nvalue = [-35, 35]',
        "[inputs.rudder] value",
        "in rad (35° are 0.6109 rad)",
        "[-35.0, 35.0]",
        None,
    ),
    (
        'path = "a.csv"',
        'path = "a.csv"\nslice = [10, 10.5]',
        "[[log]] 1 (a.csv) slice",
        "5 s between them",
        "[10.0, 10.5]",
        None,
    ),
    ("[model]", "[can]\ndbc = 'v.dbc'\n[model]", "[can] dbc", "a DBC file", "no file", None),
    (
        'path = "a.csv"',
        'path = "a.csv"\nslice = [5, 1]',
        "[[log]] 1 (a.csv) slice",
        "from < to",
        "[5.0, 1.0]",
        None,
    ),
    ('path = "a.csv"', 'path = "a.csv"\nformat = "cvs"', "[[log]] 1 (a.csv) format", "csv", "'cvs'", "csv"),
    ('path = "a.csv"', 'path = "a.csv"\nrole = "validate"', "[[log]]", "to identify on", "only logs", None),
    (
        'path = "a.csv"',
        'path = "a.csv"\nrole = "test"',
        "[[log]] 1 (a.csv) role",
        "'validate'",
        "'test'",
        None,
    ),
    (
        'path = "a.csv"',
        'path = "a.csv"\n[[log]]\npath = "a.csv"',
        "[[log]] 2 (a.csv) path",
        "not named yet",
        "a second time",
        None,
    ),
    (
        'path = "a.csv"',
        'path = "a.csv"\ndialect = { colums = "t" }',
        "[[log]] 1 (a.csv) dialect.colums",
        "columns",
        "colums",
        "columns",
    ),
    (
        'path = "a.csv"',
        'path = "a.csv"\ndialect = { encoding = "utf-9" }',
        "[[log]] 1 (a.csv) dialect.encoding",
        "encoding",
        "'utf-9'",
        None,
    ),
    ("[[log]]", "[log]", "[[log]]", "a list", "a table", None),
    ('[[log]]\npath = "a.csv"', "", "[[log]]", "at least one log", "none", None),
    ('[inputs.rudder]\nkind = "rudder"', "", "[inputs]", "at least one actuator", "none", None),
    ("[[log]]", "[[log]", "line 10", "TOML", "]]", None),
]


@pytest.fixture
def folder(tmp_path):
    return with_logs(tmp_path)


@pytest.mark.parametrize(("old", "new", "key", "expected", "found", "near"), WRONG)
def test_what_is_wrong_is_named(folder, old, new, key, expected, found, near):
    assert old in SMALL
    with pytest.raises(CampaignError) as caught:
        load(folder, SMALL.replace(old, new, 1))
    error = caught.value
    assert error.exit_status == 2
    assert error.path == folder / "campaign.toml"
    assert error.key.startswith(key)
    assert expected in error.expected
    assert found in error.found
    assert error.nearest_key == near
    assert str(error).startswith(f"{folder / 'campaign.toml'}: ")


def test_other_mistakes_are_notes(folder):
    with pytest.raises(CampaignError) as caught:
        load(folder, SMALL.replace("length = 1.0", "").replace("beam = 0.3", "beam = -1"))
    assert "beam" in caught.value.__notes__[0]


def test_a_missing_log_is_named_with_its_neighbours(folder):
    with pytest.raises(
        MissingLog, match=r"\[\[log\]\] 1: the log .*aa\.csv is not there\. Nearest there: a\.csv"
    ):
        load(folder, SMALL.replace("a.csv", "aa.csv"))


def test_a_folder_in_place_of_a_log_is_called_one(folder):
    with pytest.raises(
        CampaignError, match=r"\[\[log\]\] 1 path: expected the path of a log file, found the folder"
    ):
        load(folder, SMALL.replace("a.csv", "."))


def test_a_missing_campaign_is_named_with_its_neighbours(folder):
    load(folder, SMALL)
    with pytest.raises(UsageError, match=r"Nearest there: campaign\.toml"):
        load_campaign(folder / "campain.toml")


def test_bytes_that_are_no_text(folder):
    (folder / "campaign.toml").write_bytes(b"[vessel]\nname = '\xff'")
    with pytest.raises(CampaignError, match="byte 17: expected UTF-8 text"):
        load_campaign(folder)


KEYS = [
    "vessel",
    "inputs",
    "rudder",
    "kind",
    "pwm",
    "value",
    "log",
    "path",
    "name",
    "heading",
    "dialect",
    "0",
]


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-3, 3)
    | st.floats()
    | st.sampled_from(["", "rudder", "deg", "x"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(KEYS), inner, max_size=3),
    max_leaves=6,
)


PLACES = [
    ("vessel",),
    ("vessel", "length"),
    ("vessel", "antenna"),
    ("vessel", "propeller"),
    ("inputs",),
    ("inputs", "rudder"),
    ("inputs", "rudder", "pwm"),
    ("inputs", "rudder", "drives"),
    ("sensors",),
    ("sensors", "heading"),
    ("sensors", "position", "north"),
    ("log",),
    ("log", 0),
    ("log", 0, "slice"),
    ("log", 0, "dialect"),
    ("model", "name"),
    ("can",),
    ("extra",),
]


@given(place=st.sampled_from(PLACES), value=VALUES)
def test_whatever_stands_there_the_answer_is_a_campaign_or_a_named_mistake(place, value):
    tables = tomllib.loads(FULL)
    inner = tables
    for part in place[:-1]:
        inner = inner.setdefault(part, {}) if isinstance(inner, dict) else inner[part]
    inner[place[-1]] = value
    try:
        checked(Path("campaign.toml"), tables)
    except SeatrialError as error:
        assert "campaign.toml: " in str(error)
