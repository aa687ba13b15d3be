"""From a log and what a campaign says of it to trials: names, units, frames, roles, errors, storage."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from preprocess_samples import table

from identify.stretch import stretches_of
from ingest.errors import CampaignError, MissingQuantity, MissingSignal
from ingest.log import Log, Source
from preprocess import frames
from preprocess.actuators import calibrate
from preprocess.gaps import covered, intersect
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.vessel import Input, Sensor, Vessel

BOAT = Vessel("boat", 1.2, 0.4)
T = np.arange(0.0, 40.0, 0.2)


def simple_log(**more):
    """A boat that goes east of north by 0.5 rad at 1.5 m/s."""
    rng = np.random.default_rng(0)
    north, east = 1.5 * T * np.cos(0.5), 1.5 * T * np.sin(0.5)
    noise = rng.normal(0.0, 0.01, (len(T), 3))
    tables = {
        "GPS": table(T, ["north", "east"], np.column_stack([north, east]) + noise[:, :2]),
        "ATT": table(T, ["yaw_deg"], np.degrees(0.5 + noise[:, 2:])),
        "OUT": table(T, ["c1", "c2"], np.column_stack([1500.0 + 100.0 * (T > 20), np.full(len(T), 40.0)])),
    }
    return Log(Path("a.csv"), "csv", tables | more)


SENSORS = {
    "position": Sensor("position", {"north": "GPS.north", "east": "GPS.east"}),
    "heading": Sensor("heading", {"signal": "ATT.yaw_deg"}, "deg"),
}
MOTOR = Input("motor", "thruster", "OUT.c1", pwm=(1100, 1500, 1900), value=(-1, 0, 1))


def trials(log=None, inputs=(MOTOR,), sensors=None, **run):
    runs = [LoggedRun("a.csv", log or simple_log(), run.pop("role", "identify"), **run)]
    return make_trials(runs, BOAT, inputs, SENSORS if sensors is None else sensors)


def test_the_plain_case():
    (trial,) = trials()
    middle = trial.states[(trial.states["t"] > 5) & (trial.states["t"] < 35)]
    assert middle["u"].mean() == pytest.approx(1.5, abs=0.01)
    assert middle["v"].mean() == pytest.approx(0.0, abs=0.02)
    assert middle["psi"].mean() == pytest.approx(0.5, abs=0.005)
    assert list(trial.states.columns[:10]) == ["t", "x", "y", "psi", "u", "v", "r", "du", "dv", "dr"]
    assert trial.inputs["motor"].value.max() == pytest.approx(0.25)
    assert trial.inputs["motor"].held
    assert trial.history[0].action == "take"


def test_without_roles_the_last_third_validates():
    first, second = trials(role=None)
    assert (first.role, second.role, first.name, second.name) == ("identify", "validate", "a.csv", "a.csv")
    assert first.states["t"].max() < second.states["t"].min()
    assert second.states["t"].min() == pytest.approx(2 / 3 * 39.8, abs=0.3)


def test_an_order_given_before_a_part_acts_in_it():
    once = table(np.zeros(1), ["c1"], np.full((1, 1), 1700.0))
    for part in trials(simple_log(OUT=once), role=None):
        assert part.segments
        assert part.inputs["motor"].value.tolist() == [0.5]


def test_slice_and_start():
    (trial,) = trials(slice=(10.0, 30.0), start=100.0, manoeuvre="straight", depth=3.0)
    assert trial.states["t"].min() >= 10.0
    assert trial.states["t"].max() <= 30.0
    assert (trial.start, trial.manoeuvre, trial.depth) == (100.0, "straight", 3.0)


def test_what_the_campaign_calls_idle_and_moves_is_noted():
    (said,) = (s for s in trials(manoeuvre="idle")[0].findings if "campaign" in s)
    assert said.startswith("The campaign calls it idle, and the motion is ")
    assert not any("campaign" in s for s in trials(manoeuvre="straight")[0].findings)


def test_campaign_time_is_utc_where_known():
    log = simple_log()
    runs = [
        LoggedRun(n, replace(log, utc_ns=u), "identify", start=7.0)
        for n, u in (("a", 10**18), ("b", 10**18 + 5 * 10**9))
    ]
    a, b = make_trials(runs, BOAT, (MOTOR,), SENSORS)
    assert (a.start, b.start) == (0.0, 5.0)


def test_a_signal_that_is_not_there_is_named_with_the_nearest():
    sensors = SENSORS | {"heading": Sensor("heading", {"signal": "ATT.yaw_dgg"}, "deg")}
    with pytest.raises(MissingSignal, match=r"ATT\.yaw_deg") as caught:
        trials(sensors=sensors)
    assert caught.value.exit_status == 2


def test_a_position_that_is_zero_throughout_is_called_so():
    still = simple_log(GPS=table(T, ["north", "east"], np.zeros((len(T), 2))))
    with pytest.raises(MissingQuantity, match=r"no position in this log; .* north, east: zero throughout"):
        trials(still, sensors={"heading": SENSORS["heading"]})


def test_a_position_beyond_the_poles_is_not_called_zero():
    far = simple_log(GPS=table(T, ["lat", "lon"], 5.7e6 + np.ones((len(T), 2))))
    with pytest.raises(MissingQuantity, match=r"'lat' goes from 5\.7e\+06 .* degrees end at 90") as caught:
        trials(far, sensors={"heading": SENSORS["heading"]})
    assert "zero" not in str(caught.value)


def test_no_heading_is_said_with_what_follows():
    with pytest.raises(MissingQuantity, match="drift angle") as caught:
        trials(sensors={"position": SENSORS["position"]})
    assert caught.value.exit_status == 1


def test_raw_pulse_widths_need_a_calibration():
    with pytest.raises(CampaignError, match="1500 to 1600"):
        trials(inputs=(Input("motor", "thruster", "OUT.c1"),))


def test_an_unknown_unit_is_refused():
    with pytest.raises(CampaignError, match="furlong"):
        trials(inputs=(Input("motor", "thruster", "OUT.c1", unit="furlong"),))


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        (Input("m", "thruster", "OUT.c2", unit="percent"), 0.4),
        (Input("m", "propeller", "OUT.c2", unit="rpm"), 40.0 / 60.0),
        (Input("m", "rudder", "OUT.c2", unit="deg"), np.radians(40.0)),
        (Input("m", "thruster", "OUT.c2", unit="N", law="linear"), 40.0),
    ],
)
def test_units_of_inputs(declared, expected):
    (trial,) = trials(inputs=(declared,))
    np.testing.assert_allclose(trial.inputs["m"].value, expected)


@given(st.floats(900.0, 2100.0), st.booleans())
def test_calibration_holds_at_its_ends_and_knows_both_directions(pulse, down):
    pwm, value = (1100.0, 1500.0, 1900.0), (1.0, 0.0, -0.5)
    if down:
        pwm, value = pwm[::-1], value[::-1]
    out = calibrate(np.array([pulse]), pwm, value)[0]
    assert -0.5 <= out <= 1.0
    assert calibrate(np.array([1300.0]), pwm, value)[0] == pytest.approx(0.5)


def test_only_the_rows_that_a_source_names_are_taken():
    log = simple_log()
    attitude = log.tables["ATT"].assign(source=1, component=1)
    other = attitude.assign(component=195, yaw_deg=200.0)
    other.index = other.index + 50_000_000
    tables = dict(log.tables) | {"ATT": pd.concat([attitude, other]).sort_index()}
    options = {"where": {"component": 1}}
    sources = (Source("heading", "ATT", {"value": "yaw_deg"}, "deg", 1, 10.0, options),)
    log = replace(log, tables=tables, sources=sources)
    for sensor in ({}, {"heading": Sensor("heading", {"signal": "ATT.yaw_deg"}, "deg", 1)}):
        (trial,) = trials(log, sensors={"position": SENSORS["position"]} | sensor)
        assert len(trial.measurements["heading"].t) == len(attitude)
        assert trial.states["psi"].median() == pytest.approx(0.5, abs=0.01)


def test_a_source_in_a_table_of_its_own():
    log = simple_log()
    gps, out = log.tables["GPS"], log.tables["OUT"]
    own = {
        "GPS": gps.assign(source=0, north=0.0),
        "GPS[1]": gps.assign(source=1),
        "OUT": out.assign(source=0),
        "OUT[2]": out.assign(source=2, c1=1700.0),
    }
    sensors = SENSORS | {"position": replace(SENSORS["position"], source=1)}
    (trial,) = trials(log_with(log, own), (replace(MOTOR, source=2),), sensors=sensors)
    assert trial.measurements["position"].source.startswith("GPS[1].north")
    assert trial.states["u"].median() == pytest.approx(1.5, abs=0.05)
    assert (trial.inputs["motor"].value == 0.5).all()
    with pytest.raises(MissingSignal, match="from source 7"):
        trials(log_with(log, own), sensors=SENSORS | {"position": replace(SENSORS["position"], source=7)})


def log_with(log, tables):
    return replace(log, tables=dict(log.tables) | tables)


def test_detected_sources_are_taken_by_rank_and_said():
    log = simple_log(HDG=table(T, ["yaw"], np.full((len(T), 1), 0.5)))
    sources = (
        Source("heading", "HDG", {"value": "yaw"}, "rad", rank=40.0),
        Source("heading", "ATT", {"value": "yaw_deg"}, "deg", rank=55.0),
        Source("position", "GPS", {"north": "north", "east": "east"}, "m", rank=50.0),
    )
    (trial,) = trials(replace(log, sources=sources), sensors={})
    assert trial.measurements["heading"].source == "ATT.yaw_deg"
    (step,) = [s for s in trial.history if s.arguments.get("quantity") == "heading" and s.action == "take"]
    assert step.arguments["not_taken"] == ["HDG.yaw"]


def test_a_device_can_be_chosen_and_a_missing_one_is_an_error():
    two = pd.concat(
        [simple_log().tables["OUT"].assign(source=1), simple_log().tables["OUT"].assign(source=2, c1=1700.0)]
    )
    log = simple_log(OUT=two.sort_index(kind="stable"))
    (trial,) = trials(log, inputs=(replace(MOTOR, source=2),))
    np.testing.assert_allclose(trial.inputs["motor"].value, 0.5)
    with pytest.raises(MissingSignal, match="from source 9"):
        trials(log, inputs=(replace(MOTOR, source=9),))


def test_geodetic_positions_share_one_origin():
    lat, lon = 52.0, 4.37
    rng = np.random.default_rng(3)
    gps = np.column_stack([lat + 1e-5 * T, np.full(len(T), lon)]) + rng.normal(0.0, 1e-7, (len(T), 2))
    log = simple_log(GPS=table(T, ["lat", "lon"], gps))
    sensors = SENSORS | {
        "position": Sensor("position", {"latitude": "GPS.lat", "longitude": "GPS.lon"}, "deg")
    }
    shifted = replace(log, tables={**log.tables, "GPS": log.tables["GPS"] + [0.001, 0.0]})
    runs = [LoggedRun("a", log, "identify"), LoggedRun("b", shifted, "validate")]
    a, b = make_trials(runs, BOAT, (MOTOR,), sensors)
    assert a.origin == b.origin == (pytest.approx(lat, abs=1e-6), pytest.approx(lon, abs=1e-6))
    assert b.states["x"].iloc[0] - a.states["x"].iloc[0] == pytest.approx(111.27, abs=0.05)


def test_wind_is_the_velocity_of_the_air():
    wind = table(T, ["speed", "from_deg"], np.tile([5.0, 0.0], (len(T), 1)))
    signals = {"speed": "WIND.speed", "direction": "WIND.from_deg"}
    true = SENSORS | {"wind": Sensor("wind", signals, "deg")}
    (trial,) = trials(simple_log(WIND=wind), sensors=true)
    np.testing.assert_allclose(trial.measurements["wind"].value, np.tile([-5.0, 0.0], (len(T), 1)), atol=1e-9)
    (trial,) = trials(
        simple_log(WIND=wind),
        sensors=SENSORS | {"wind": Sensor("wind", signals, "deg", reference="relative")},
    )
    # from ahead at 5 m/s while going 1.5 m/s at 0.5 rad: the air itself goes 3.5 m/s the other way
    expected = -3.5 * np.array([np.cos(0.5), np.sin(0.5)])
    np.testing.assert_allclose(np.median(trial.measurements["wind"].value, axis=0), expected, atol=0.05)


def test_a_relative_wind_without_a_motion_to_take_off_is_not_used():
    wind = table(T, ["speed", "from_deg"], np.tile([5.0, 0.0], (len(T), 1)))
    signals = {"speed": "WIND.speed", "direction": "WIND.from_deg"}
    relative = SENSORS | {"wind": Sensor("wind", signals, "deg", reference="relative")}
    sparse = simple_log().tables["GPS"].iloc[::60]
    (trial,) = trials(simple_log(WIND=wind, GPS=sparse), sensors=relative)
    assert trial.segments == ()
    assert not trial.measurements["wind"].good.any()
    (whole,) = trials()
    calm = replace(whole, measurements=whole.measurements | {"wind": trial.measurements["wind"]})
    assert not stretches_of(calm, 0.1)[0].wind.any()


def test_offset_and_latency_are_taken_off():
    sensors = SENSORS | {
        "heading": Sensor("heading", {"signal": "ATT.yaw_deg"}, "deg", offset=0.2, latency=0.1)
    }
    (trial,) = trials(sensors=sensors)
    assert np.median(trial.measurements["heading"].value) == pytest.approx(0.3, abs=0.01)
    assert trial.measurements["heading"].t[0] == pytest.approx(-0.1)


def test_a_long_gap_splits_and_a_short_one_does_not():
    log = simple_log()
    keep = (T < 15.0) | (T > 22.0)
    holed = replace(log, tables={**log.tables, "GPS": log.tables["GPS"][keep]})
    (trial,) = trials(holed)
    assert len(trial.segments) == 2
    assert trial.states.loc[(trial.states["t"] > 15.5) & (trial.states["t"] < 21.5), "u"].isna().all()
    assert any("2 stretches" in f for f in trial.findings)
    keep = (T < 15.0) | (T > 17.0)
    (trial,) = trials(replace(log, tables={**log.tables, "GPS": log.tables["GPS"][keep]}))
    assert len(trial.segments) == 1


def test_a_log_that_is_one_gap_gives_an_empty_trial_that_says_so():
    log = simple_log()
    sparse = replace(log, tables={**log.tables, "GPS": log.tables["GPS"].iloc[::60]})
    (trial,) = trials(sparse)
    assert trial.segments == ()
    assert trial.states["u"].isna().all()
    assert any("nothing of this log" in f for f in trial.findings)


def test_a_log_of_less_than_five_seconds_says_so():
    """So short a stretch is never identified or validated on."""
    (trial,) = trials(slice=(10.0, 14.6))
    assert trial.segments == ()
    assert any("stretch of five seconds" in f and "nothing of this log" in f for f in trial.findings)


@pytest.mark.parametrize("fixes", range(7, 13))
def test_a_log_of_a_few_fixes_is_used_or_said_to_be_of_no_use(fixes):
    log = simple_log()
    few = np.round(np.linspace(40, 100, fixes)).astype(int)  # in six seconds
    rare = {name: log.tables[name].iloc[few] for name in ("GPS", "ATT")}
    (trial,) = trials(replace(log, tables={**log.tables, **rare}))
    said = any("nothing of this log" in f for f in trial.findings)
    assert said is (fixes < 10)
    assert bool(stretches_of(trial, 0.1)) is not said


def test_a_log_with_an_input_without_a_number_says_so():
    silent = table(T, ["c1"], np.full((len(T), 1), np.nan))
    (trial,) = trials(simple_log(OUT=silent))
    assert trial.segments == ()
    assert trial.findings[0] == "motor (signal 'OUT.c1') has no number: nothing of this log can be used."


def test_intervals():
    t = np.array([0.0, 1.0, 2.0, 9.0, 10.0])
    assert covered(t, np.diff(t) > 3.0) == [(0.0, 2.0), (9.0, 10.0)]
    assert intersect([(0.0, 5.0), (6.0, 9.0)], [(4.0, 7.0)]) == [(4.0, 5.0), (6.0, 7.0)]


@given(st.floats(-7.0, 7.0), st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_turning_there_and_back(psi, a, b):
    vector, angle = np.array([[a, b]]), np.array([psi])
    np.testing.assert_allclose(
        frames.earth_to_body(frames.body_to_earth(vector, angle), angle), vector, atol=1e-9
    )


def test_conventions_by_hand():
    east = np.array([0.0])
    assert frames.enu_yaw_to_heading(east)[0] == pytest.approx(np.pi / 2)  # yaw 0 in ENU looks east
    np.testing.assert_allclose(frames.flu_to_body(np.array([[1.0, 2.0]])), [[1.0, -2.0]])
    # heading east, a point 1 m ahead lies east; with r > 0 it moves south
    np.testing.assert_allclose(
        frames.lever_position((1.0, 0.0), np.array([np.pi / 2])), [[0.0, 1.0]], atol=1e-12
    )
    np.testing.assert_allclose(
        frames.lever_velocity((1.0, 0.0), np.array([np.pi / 2]), np.array([0.3])), [[-0.3, 0.0]], atol=1e-12
    )
    # a wind from the north blows to the south
    np.testing.assert_allclose(frames.wind_to_air_velocity(np.array([3.0]), np.array([0.0])), [[-3.0, 0.0]])


@settings(max_examples=20)
@given(st.floats(-60, 60), st.floats(-179, 179), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_tangent_plane_agrees_with_the_radii_of_curvature(lat, lon, dlat, dlon):
    out = frames.geodetic_to_ned(np.array([lat + dlat]), np.array([lon + dlon]), (lat, lon))[0]
    e2, a = 0.00669437999014, 6378137.0
    w = 1.0 - e2 * np.sin(np.radians(lat)) ** 2
    north, east = (
        a * (1 - e2) / w**1.5 * np.radians(dlat),
        a / np.sqrt(w) * np.cos(np.radians(lat)) * np.radians(dlon),
    )
    np.testing.assert_allclose(out, [north, east], atol=5.0)


def degenerate(t, position, psi):
    tables = {
        "GPS": table(t, ["north", "east"], position),
        "ATT": table(t, ["yaw_deg"], np.degrees(psi)[:, None]),
        "OUT": table(t, ["c1", "c2"], np.column_stack([np.full(len(t), 1500.0), np.zeros(len(t))])),
    }
    return Log(Path("a.csv"), "csv", tables)


@pytest.mark.parametrize("role", ["identify", None])
@pytest.mark.parametrize(
    "log",
    [
        degenerate(T[:1], np.zeros((1, 2)), np.zeros(1)),
        degenerate(T[:3], np.eye(3, 2), np.zeros(3)),
        degenerate(T, np.zeros((len(T), 2)), np.zeros(len(T))),
        degenerate(T, np.column_stack([T, 0.0 * T]), np.zeros(len(T))),
        degenerate(np.repeat(T[:10], 5), np.ones((50, 2)), np.zeros(50)),
        degenerate(T, np.column_stack([T, T]) * 1e6, np.random.default_rng(0).uniform(0.0, 6.0, len(T))),
        degenerate(T, np.where(T[:, None] % 1.0 < 0.5, np.nan, np.column_stack([T, T])), np.zeros(len(T))),
    ],
    ids=["one", "three", "still", "noise-free", "one-time", "wild", "half-nan"],
)
def test_degenerate_logs_do_not_break(log, role):
    for trial in trials(log, role=role):
        assert np.isfinite(trial.measurements["position"].sigma)
        inside = trial.states["u"].notna()
        assert np.isfinite(trial.states.loc[inside].to_numpy()).all()


def test_a_heading_without_a_number_is_no_heading():
    with pytest.raises(MissingQuantity):
        trials(degenerate(T, np.column_stack([T, T]), np.full(len(T), np.nan)))
