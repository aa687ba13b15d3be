"""How ``seatrial inspect`` and the Rerun importer read a log: as asked, or as a campaign beside it says."""

from __future__ import annotations

import json
from functools import reduce
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ingest.errors import UsageError
from ingest.log import Log, Source
from seatrial.cli.inspect_command import as_json, command
from seatrial.inspection import inspect_log
from seatrial.reader_choice import KEYS, ReaderChoice, checked_dbc, chosen_for, dialect_of

ROWS = "\n".join(
    f"{0.1 * i:.1f} {i * 0.5:.2f} {i * 0.25:.2f} {i % 360} {10 * np.sin(i / 9):.3f}" for i in range(50)
)


@pytest.fixture
def log(tmp_path):
    """Blank-separated numbers without a header, after two lines of talk."""
    path = tmp_path / "run.dat"
    path.write_text(f"basin 3, run 12\nby hand\n{ROWS}\n")
    return path


def sentence(body):
    return f"${body}*{reduce(lambda a, c: a ^ ord(c), body, 0):02X}\r\n"


def names(facts):
    return {f["name"] for t in json.loads(as_json([facts]))["topics"] for f in t["fields"]}


def test_a_dialect_on_the_command_line(log):
    dialect = dialect_of(["columns=t north east heading_deg rudder_deg", "skip=2", "delimiter= "])
    facts = inspect_log(chosen_for(log, ReaderChoice(dialect=dialect)).read(log))
    assert names(facts) >= {"north", "heading_deg"}
    assert {c.quantity for c in facts.candidates} >= {"position", "heading", "input (rudder)"}


@pytest.mark.parametrize("pair", ["skip", "colums=a b", "=3"])
def test_a_dialect_that_there_is_not(pair):
    with pytest.raises(UsageError, match=r"--dialect: expected KEY=VALUE.*columns"):
        dialect_of([pair])


@pytest.mark.parametrize(
    ("pair", "said"),
    [
        ("skip=x", "--dialect skip: expected a whole number, found 'x'"),
        ("skip=-1", "--dialect skip: expected a whole number, found '-1'"),
        ("decimal=;", "--dialect decimal: expected one of"),
        ("encoding=utf-9", "--dialect encoding: expected a text encoding"),
        ("columns=", "--dialect columns: expected text that is not empty"),
    ],
)
def test_a_value_that_a_dialect_cannot_have(pair, said):
    with pytest.raises(UsageError, match=said):
        dialect_of([pair])


def test_a_tab_may_be_written_as_in_programs():
    assert dialect_of(["delimiter=\\t", "skip=3"]) == {"delimiter": "\t", "skip": 3}


def test_a_campaign_beside_the_log_says_how_to_read_it(log):
    (log.parent / "campaign.toml").write_text(
        '[[log]]\npath = "other.csv"\n[[log]]\npath = "run.dat"\nformat = "csv"\n'
        'dialect = { columns = "t a b heading_deg d", skip = 2 }\n[can]\ndbc = "x.dbc"\n'
    )
    choice = chosen_for(log, ReaderChoice())
    assert (choice.format, choice.dbc, choice.told_by) == (
        "csv",
        log.parent / "x.dbc",
        log.parent / "campaign.toml",
    )
    assert names(inspect_log(choice.read(log))) >= {"a", "heading_deg"}
    over = chosen_for(log, ReaderChoice(dialect={"columns": "t x y psi_deg delta"}))
    assert names(inspect_log(over.read(log))) >= {"x", "psi_deg"}
    assert chosen_for(log.parent / "third.csv", ReaderChoice()) == ReaderChoice()


def test_what_the_campaign_beside_a_log_declares_is_not_missed(tmp_path, capsys):
    """Nothing looked like a position that was declared, and its northing N like a propeller."""
    log = tmp_path / "run.csv"
    rows = "\n".join(f"{0.1 * i:.1f};{i * 0.5:.2f};{i * 0.25:.2f};{i % 360};{i % 7}" for i in range(50))
    log.write_text(f"t;N;E;Kurs rw.;Schub\n{rows}\n")
    command([log])
    bare = capsys.readouterr().out
    assert "Nothing looks like position" in bare
    (tmp_path / "campaign.toml").write_text(
        '[sensors.position]\nnorth = "N"\neast = "E"\n[sensors.heading]\nsignal = "Kurs rw."\nunit = "deg"\n'
        '[inputs.port]\nkind = "thruster"\nsignal = "Schub"\n[inputs.odd]\nsignal = 3\n[[log]]\npath = "run.csv"\n'
    )
    command([log])
    told = capsys.readouterr().out
    assert "Nothing looks like" not in told
    assert "propeller" not in told
    for line in ("position: N + E", "heading: Kurs rw.", "input port: Schub"):
        assert f"Declared as {line}" in told


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[[log]",
        "log = 3",
        "sensors = 3\n[[log]]\npath = 'run.dat'",
        "[[log]]\npath = 3",
        '[[log]]\npath = "run.dat"\nformat = 7',
    ],
)
def test_a_broken_campaign_beside_the_log_is_no_obstacle(log, text):
    (log.parent / "campaign.toml").write_text(text)
    assert inspect_log(chosen_for(log, ReaderChoice()).read(log)).messages == 50


def test_what_a_receiver_says_of_itself_is_shown(tmp_path):
    lines = []
    for i in range(40):
        clock, quality = f"1200{i:02d}.00", "4,14,0.8" if i % 4 else "0,03,99.9"
        lines.append(sentence(f"GPGGA,{clock},5000.{i:04d},N,00400.0000,E,{quality},1.0,M,1.0,M,,"))
        lines.append(sentence(f"GPGST,{clock},1,,,,0.03,0.04,0.1"))
    path = tmp_path / "fix.nmea"
    path.write_text("".join(lines))
    position = next(c for c in inspect_log(ReaderChoice().read(path)).candidates if c.quantity == "position")
    assert position.quality == "25 % flagged bad, 14 satellites, HDOP 0.8, ± 0.035 m"


def test_a_column_that_is_not_filled_in_every_line_has_a_rate_of_its_own(tmp_path):
    lines = ["t;Lat [deg];Lon [deg];SOG [kn];COG [deg];Heading [deg];Pod1 angle [deg];Jet nozzle [deg]"]
    for k in range(200):
        fix = f"{57 + 1e-6 * k:.6f};24.9;3.0;0.0" if k % 4 == 0 else ";;;"
        order = f"{k % 20};{k % 7}" if k % 2 == 0 else ";"
        lines.append(f"{0.05 * k:.2f};{fix};{k % 360};{order}")
    path = tmp_path / "sparse.csv"
    path.write_text("\n".join(lines) + "\n")
    found = {c.signal: c for c in inspect_log(chosen_for(path, ReaderChoice()).read(path)).candidates}
    assert found["Pod1 angle [deg]"].rate_hz == pytest.approx(10.0, rel=0.01)
    assert found["Jet nozzle [deg]"].rate_hz == pytest.approx(10.0, rel=0.01)
    assert found["Lat [deg] + Lon [deg]"].rate_hz == pytest.approx(5.0, rel=0.01)
    assert found["SOG [kn] + COG [deg]"].unit == "kn, deg"


def test_a_topic_that_is_not_in_the_log(tmp_path, log):
    path = tmp_path / "fix.nmea"
    path.write_text("".join(sentence(f"GPZDA,1200{k:02d}.00,26,05,2026,00,00") for k in range(9)))
    assert list(ReaderChoice(topics=("ZDA",)).read(path).tables) == ["ZDA"]
    with pytest.raises(UsageError, match=r"--topic: .*found 'ZDE'\. Nearest there: ZDA"):
        ReaderChoice(topics=("ZDA", "ZDE")).read(path)
    with pytest.raises(UsageError, match=r"found 'ZDA'\. It has none"):
        ReaderChoice(topics=("ZDA",)).read(log)


def test_a_dbc_file_that_is_not_there(log):
    (log.parent / "boat.dbc").write_text("")
    assert checked_dbc(log.parent / "boat.dbc").name == "boat.dbc"
    with pytest.raises(UsageError, match=r"found none at .*Nearest there: boat\.dbc"):
        checked_dbc(log.parent / "baot.dbc")


def test_what_inspect_reads_a_campaign_can_be_told_to_read(log):
    from seatrial.campaign.tables import DialectTable

    assert set(KEYS) == set(DialectTable.model_fields)
    log.write_text("t;north;heading_deg\n" + "".join(f"{k};{k},5;{k}\n" for k in range(9)))
    told = DialectTable.model_validate({"decimal": ","}).model_dump(exclude_none=True)
    table = ReaderChoice(dialect=told).read(log).tables[""]
    assert table["north"].tolist()[:2] == [0.5, 1.5]


@pytest.mark.parametrize("told_apart", [True, False])
def test_of_actuators_that_one_device_reports_by_instance_each_is_offered_and_not_their_mixture(told_apart):
    """Other formats call their first instance by the topic's name alone."""
    index = pd.Index(range(6), name="t_ns")
    table = pd.DataFrame({"position": np.linspace(0.0, 1.0, 6)}, index=index)
    mixed = table.assign(instance=[0, 1] * 3) if told_apart else table
    log = Log(Path("x"), "trc", {"rudder": mixed, "rudder[1]": table, "rudder[2]": table})
    offered = [c.signal for c in inspect_log(log).candidates]
    assert offered == [
        *([] if told_apart else ["rudder.position"]),
        "rudder[1].position",
        "rudder[2].position",
    ]


def test_where_satellites_stand_is_no_input():
    index = pd.Index(range(5), name="t_ns")
    turning = pd.DataFrame({"azimuth": np.linspace(0.0, 1.0, 5)}, index=index)
    log = Log(Path("x"), "trc", {"gnssSatsInView": turning, "thruster": turning})
    assert [c.signal for c in inspect_log(log).candidates] == ["thruster.azimuth"]


@pytest.mark.parametrize(
    ("topic", "field", "is_one"),
    [
        ("/cmd/port", "data", True),
        ("/delta/cmd", "data", True),
        ("/actuators/cmd", "data[1]", True),
        ("", "c_stbd", True),
        ("/cmd_vel", "twist.linear.x", False),
        ("/depth", "data", False),
        ("/actuators/cmd", "layout.data_offset", False),
    ],
)
def test_a_topic_of_nothing_but_numbers_says_what_they_are(topic, field, is_one):
    moving = pd.DataFrame({field: np.linspace(0.0, 1.0, 5)}, index=pd.Index(range(5), name="t_ns"))
    found = [c.signal for c in inspect_log(Log(Path("x"), "mcap", {topic: moving})).candidates]
    assert found == ([f"{topic}.{field}".lstrip(".")] if is_one else [])


def test_a_wind_s_speed_has_a_unit_beside_its_angle_s():
    blowing = pd.DataFrame({"speed": 5.0, "angle": 40.0}, index=pd.Index(range(5), name="t_ns"))
    fields, options = {"speed": "speed", "direction": "angle"}, {"speed_unit": "kn", "reference": "relative"}
    wind = Source("wind", "MWV", fields, "deg", None, 50.0, options)
    [found] = inspect_log(Log(Path("x"), "nmea", {"MWV": blowing}, {}, sources=(wind,))).candidates
    assert found.unit == "kn, deg"
