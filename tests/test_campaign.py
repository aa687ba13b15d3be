"""campaign.toml: what it says becomes data; what is wrong with it is named."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ingest.errors import CampaignError, MissingLog, SeatrialError, UsageError
from seatrial.campaign import Campaign, campaign_schema, load_campaign, with_options
from seatrial.campaign.load import checked

DATA = Path(__file__).parents[2] / "shared" / "data"

FULL = """
[vessel]
name = "Tito Neri 3"
length = 0.97
beam = 0.30
draught = 0.1
mass = 17
centre_of_gravity = [0.02, 0.0]
origin = "midships"
antenna = [0.10, 0.0]
depth = 5.0
magnetic_variation_deg = 90.0
[vessel.propeller]
D = 0.07

[inputs.rudder]
kind = "rudder"
signal = "SERVO_OUTPUT_RAW.servo1_raw"
pwm = [1100, 1500, 1900]
value = [-0.6109, 0.0, 0.6109]
[inputs.n_port]
kind = "propeller"
signal = "/esc.rpm[0]"
unit = "rpm"
position = [-0.45, -0.1]
[inputs.angle]
kind = "azimuth"
signal = "/azimuth.angle"
unit = "deg"
drives = "n_port"
[inputs.bow]
kind = "tunnel"
signal = "/bow.force"
unit = "N"
position = [0.4, 0.0]

[sensors.heading]
signal = "heading_deg"
unit = "deg"
source = 36
offset = 0.01
latency = 0.2
[sensors.position]
latitude = "lat"
longitude = "lon"
[sensors.wind]
speed = "ws"
direction = "wd"
reference = "relative"

[model]
name = "blanke"
estimator = "lssvm"

[[log]]
path = "a.csv"
dialect = { columns = "t x y", skip = 4, delimiter = " ", encoding = "cp1252" }
slice = [10, 130.0]
[[log]]
path = "b.csv"
role = "validate"
manoeuvre = "circle"
depth = 2.5
start = 0
"""

SMALL = """
[vessel]
name = "a"
length = 1.0
beam = 0.3
[inputs.rudder]
kind = "rudder"
[model]
name = "blanke"
[[log]]
path = "a.csv"
"""


@pytest.fixture
def folder(tmp_path):
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("t,x\n0,1\n")
    return tmp_path


def load(folder: Path, text: str) -> Campaign:
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    return load_campaign(folder / "campaign.toml")


def test_everything_that_can_be_said_becomes_data(folder):
    c = load(folder, FULL)
    assert c.vessel.mass == 17.0
    assert c.vessel.magnetic_variation == pytest.approx(math.pi / 2)
    assert c.vessel.centre_of_gravity == (0.02, 0.0)
    assert c.vessel.propeller == {"D": 0.07}
    rudder, propeller, azimuth, bow = c.inputs
    assert (rudder.pwm, rudder.value) == ((1100.0, 1500.0, 1900.0), (-0.6109, 0.0, 0.6109))
    assert (propeller.law, bow.law) == ("quadratic", "linear")
    assert azimuth.position == propeller.position == (-0.45, -0.1)
    assert rudder.position == (-0.485, 0.0), "at the stern where nothing is said"
    sensors = {s.quantity: s for s in c.sensors}
    assert sensors["heading"].signals == {"signal": "heading_deg"}
    assert (sensors["heading"].source, sensors["heading"].offset, sensors["heading"].latency) == (
        36,
        0.01,
        0.2,
    )
    assert sensors["position"].signals == {"latitude": "lat", "longitude": "lon"}
    assert sensors["wind"].reference == "relative"
    first, second = c.logs
    assert (first.role, second.role) == ("identify", "validate")
    assert first.slice == (10.0, 130.0)
    assert first.dialect == {"columns": "t x y", "skip": 4, "delimiter": " ", "encoding": "cp1252"}
    assert first.file == folder / "a.csv"
    assert (second.depth, second.manoeuvre, second.start) == (2.5, "circle", 0.0)
    assert (c.model, c.estimator, c.optimiser) == ("blanke", "lssvm", "auto")


def test_no_log_has_a_role_where_none_validates(folder):
    assert [log.role for log in load(folder, SMALL).logs] == [None]


def test_a_folder_means_its_campaign(folder):
    load(folder, SMALL)
    assert load_campaign(folder).path == folder / "campaign.toml"


THRUSTER = 'kind = "thruster"\nsignal = "x"'

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


def test_a_model_that_needs_geometry_asks_for_positions(folder):
    text = SMALL.replace('kind = "rudder"', THRUSTER)
    campaign = load(folder, text)
    with pytest.raises(CampaignError, match=r"\[inputs\.rudder\] position"):
        with_options(campaign, model="modulus")
    with pytest.raises(CampaignError, match="position"):
        load(folder, text.replace("blanke", "linear"))
    assert with_options(load(folder, SMALL), model="modulus").model == "modulus", "a rudder is at the stern"


def test_options_win_and_are_checked(folder):
    campaign = load(folder, SMALL)
    assert with_options(campaign, estimator="ls", optimiser="de").estimator == "ls"
    with pytest.raises(UsageError, match=r"--model.*Did you mean 'blanke'"):
        with_options(campaign, model="blankee")


def test_a_missing_log_is_named_with_its_neighbours(folder):
    with pytest.raises(
        MissingLog, match=r"\[\[log\]\] 1: the log .*aa\.csv is not there\. Nearest there: a\.csv"
    ):
        load(folder, SMALL.replace("a.csv", "aa.csv"))


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


def test_the_schema_says_the_same_as_the_reader(folder):
    validator = jsonschema.Draft202012Validator(campaign_schema())
    validator.check_schema(campaign_schema())
    validator.validate(tomllib.loads(FULL))
    for old, new in (
        ("kind =", "knd ="),
        ('name = "blanke"', 'name = "blank"'),
        ("length = 1.0", 'length = "1"'),
    ):
        assert not validator.is_valid(tomllib.loads(SMALL.replace(old, new, 1)))


@pytest.mark.real
@pytest.mark.parametrize(("name", "logs"), [("kvlcc2-hsva", 13), ("blueboat", 8)])
def test_real_campaigns(name, logs):
    path = DATA / name / "campaign.toml"
    if not path.is_file():
        pytest.skip(f"no measured data at {DATA}")
    assert len(load_campaign(path).logs) == logs
