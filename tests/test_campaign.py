"""campaign.toml: what it says becomes data; the options of the command line; the schema."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import jsonschema
import pytest
from campaign_samples import FULL, SMALL, THRUSTER, load, with_logs

from ingest.errors import CampaignError, UsageError
from seatrial.campaign import campaign_schema, load_campaign, with_options

DATA = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture
def folder(tmp_path):
    return with_logs(tmp_path)


@pytest.mark.parametrize("other", ["./a.csv", "sub/../a.csv", "{folder}/a.csv", "link/a.csv"])
def test_a_log_is_one_however_its_path_is_written(folder, other):
    (folder / "sub").mkdir()
    (folder / "link").symlink_to(folder)
    again = other.format(folder=folder)
    with pytest.raises(CampaignError) as caught:
        load(folder, f'{SMALL}\n[[log]]\npath = "{again}"\n')
    assert caught.value.exit_status == 2
    assert f"'a.csv' a second time, as '{again}'" in str(caught.value)
    assert f"[[log]] 2 ({again}) path" in str(caught.value)


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
    with pytest.raises(UsageError, match=r"^model: .*Did you mean 'blanke'"):
        with_options(campaign, model="blankee")


@pytest.mark.parametrize(
    ("option", "number"), [("seed", -1), ("seed", None), ("workers", 0), ("workers", -2), ("workers", 1.5)]
)
def test_a_seed_and_a_number_of_processes_are_whole_and_none_is_negative(folder, option, number):
    from seatrial.comparison import compare
    from seatrial.pipeline import run

    for function in (run, compare):
        with pytest.raises(
            UsageError, match=rf"^{option}: expected a whole number from \d up, found {number}"
        ):
            function(load(folder, SMALL), **{option: number})


def test_a_fleet_needs_a_process(tmp_path):
    from seatrial.fleet_run import fleet

    with pytest.raises(UsageError, match=r"^workers: .*from 1 up, found 0"):
        fleet((), tmp_path / "fleet.csv", workers=0)


def test_the_speed_that_a_model_is_about_may_be_said(folder):
    assert load(folder, SMALL).vessel.reference_speed is None
    said = load(folder, SMALL.replace('name = "blanke"', 'name = "abkowitz"\nu0 = 6.0'))
    assert said.vessel.reference_speed == 6.0
    with pytest.raises(CampaignError, match=r"\[model\] u0"):
        load(folder, SMALL.replace('name = "blanke"', 'name = "abkowitz"\nu0 = -6.0'))


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
