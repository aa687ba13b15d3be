"""Which receiver or message a quantity comes from, and what follows for its clock."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from preprocess_samples import Imperfect, sampled, table, truth_of

from ingest.log import Log, Source
from ingest.sender import sender_of
from preprocess.run_of_log import LoggedRun
from preprocess.trials import gather
from preprocess.vessel import Sensor

POSITION, OVER_GROUND = {"latitude": "lat", "longitude": "lon"}, {"speed": "sog", "course": "cog"}
FIX = table(np.arange(9.0), ["lat", "lon", "sog", "cog", "forward", "starboard"], np.ones((9, 6)))


def one_sender(tables, position, velocity, fields=OVER_GROUND, device=(None, None)):
    log = Log(Path("a"), "made", {k: FIX.assign(**more) for k, more in tables.items()})
    first = sender_of(log, Source("position", position, POSITION, "deg", device[0]))
    return first == sender_of(log, Source("velocity", velocity, fields, "deg", device[1]))


def test_a_receiver_is_one_sender_whatever_its_messages():
    def by(talker):
        return {"talker": pd.Categorical([talker] * 9)}

    assert one_sender({"GGA": by("GN"), "RMC": by("GP")}, "GGA", "RMC")
    assert not one_sender({"GGA": by("GN"), "VBW": by("VD")}, "GGA", "VBW")
    assert one_sender({"NAV-HPPOSLLH": {}, "NAV-VELNED": {}}, "NAV-HPPOSLLH", "NAV-VELNED")
    n2k = {"gnssPositionData": {"source": 3}, "cogSogRapidUpdate": {"source": 3}}
    assert one_sender(n2k, *n2k, device=(3, 3)) and one_sender(n2k, *n2k, device=(3, None))
    n2k["cogSogRapidUpdate"] = {"source": 9}
    assert not one_sender(n2k, *n2k, device=(3, 9))


def test_what_stands_in_one_message_has_one_sender_but_a_row_of_a_table_is_none():
    gps = {"GPS_RAW_INT": {}, "GLOBAL_POSITION_INT": {}, "": {}}
    hull = {"forward": "forward", "starboard": "starboard"}
    assert one_sender(gps, "GPS_RAW_INT", "GPS_RAW_INT")
    assert not one_sender(gps, "GPS_RAW_INT", "GLOBAL_POSITION_INT")
    assert one_sender(gps, "", "") and not one_sender(gps, "", "", hull)
    assert one_sender({"/odometry": {}}, "/odometry", "/odometry", hull)


def test_messages_of_one_node_have_one_sender_but_for_what_it_sends_of_a_log():
    """A velocity over ground is the receiver's, one along the hull's axes another sensor's."""
    tables = dict.fromkeys(("Fix", "Course", "Drift", "Other"), FIX)
    log = Log(
        Path("a"), "made", tables, senders={"Fix": "NAV", "Course": "NAV", "Drift": "NAV", "Other": "DVL"}
    )
    hull = {"forward": "forward", "starboard": "starboard"}
    fix = sender_of(log, Source("position", "Fix", POSITION, "deg"))
    assert sender_of(log, Source("velocity", "Course", OVER_GROUND, "deg")) == fix
    assert sender_of(log, Source("velocity", "Other", OVER_GROUND, "deg")) != fix
    assert sender_of(log, Source("velocity", "Drift", hull, "m/s")) != fix


def test_topics_with_the_stamps_of_one_epoch_have_one_sender():
    fix = table(np.arange(60.0), list(FIX.columns), np.ones((60, len(FIX.columns))))
    tables = {
        "/gnss/fix": fix,
        "/gnss/vel": fix.drop(fix.index[[3, 40]]),
        "/dvl": fix.set_index(fix.index + 1000),
        "/fast": pd.concat([fix, fix.set_index(fix.index + 7)]),
    }
    log = Log(Path("a"), "made", tables)
    said = {t: sender_of(log, Source("velocity", t, OVER_GROUND, "deg")) for t in log.tables}
    assert said["/gnss/fix"] == said["/gnss/vel"]
    assert len({said["/gnss/fix"], said["/dvl"], said["/fast"]}) == 3


def test_a_sender_is_named_after_a_sensor_not_after_an_input_that_is_logged_with_it():
    tables = {"/command": FIX, "/gnss/fix": FIX, "/gnss/vel": FIX}
    position = Source("position", "/gnss/fix", POSITION, "deg")
    velocity = Source("velocity", "/gnss/vel", OVER_GROUND, "deg")
    log = Log(Path("a"), "made", tables, {}, sources=(position, velocity))
    assert {sender_of(log, position), sender_of(log, velocity)} == {"/gnss/fix"}


@pytest.mark.parametrize(
    ("topic", "own", "late"), [("position", None, 0.4), ("vtg", None, 0.0), ("position", 0.1, 0.1)]
)
def test_a_velocity_is_as_late_as_the_position_of_its_receiver_unless_more_is_said(topic, own, late):
    made = sampled(truth_of(duration=20.0), position=Imperfect(5.0, 0.01), heading=Imperfect(10.0, 0.003))
    position = made.log.tables["position"]
    more = position.assign(sog=1.0, cog=30.0)
    velocity = Source("velocity", topic, OVER_GROUND, "deg", None, 50.0)
    log = replace(made.log, tables={**made.log.tables, topic: more}, sources=(*made.log.sources, velocity))
    sensors = {**made.sensors, "position": replace(made.sensors["position"], latency=0.4)}
    if own is not None:
        sensors["velocity"] = Sensor("velocity", latency=own)
    found = gather(LoggedRun("a", log, "identify"), made.vessel, made.inputs, sensors).sensors
    stamps = position.index.to_numpy() * 1e-9
    assert found["position"].t == pytest.approx(stamps - 0.4)
    assert found["velocity"].t == pytest.approx(stamps - late)
