"""Identification while sailing, from a simulated stream in a real format to model, state and warnings."""

from __future__ import annotations

import json
import math
import subprocess
import time
from dataclasses import replace

import numpy as np
import pytest
from capture_samples import SCRIPT, capturing, ended, lines_until

from benchmarks.online_runs import BATCH_S, identified, offline
from benchmarks.online_streams import as_port, recorded, sailed, turned, vessel_for, written
from fixtures.effects import Effect, World
from fixtures.sensors import Sensor, Suite
from ingest import read_log
from ingest.errors import CampaignError, UsageError
from ingest.log import Source
from preprocess import vessel
from seatrial.campaign import load_campaign
from seatrial.capture.decoders import Tables, decoder_for
from seatrial.online.declared import declared_campaign
from seatrial.online.estimator import CALM_BLOCKS
from seatrial.online.identifier import Identifier
from seatrial.online.recorded import batches
from seatrial.online.saved_state import restored, save
from seatrial.online.tap import Tap
from seatrial.online.updates import ERRORS, MONITOR, PARAMETERS, Note, Reading
from seatrial.online.warm_up import in_one

CALM = World()
CHANGED_AT = 110.0


def campaign_of(folder, changes, seconds, seed):
    recording = recorded(sailed(vessel_for("usv", "nmea0183"), changes, seconds, seed), seed)
    return written(folder, recording)


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    """A campaign in which nothing happens, its log, and what was identified of it."""
    campaign = load_campaign(campaign_of(tmp_path_factory.mktemp("calm"), [(0.0, CALM)], 130.0, 5))
    log = read_log(campaign.logs[0].file)
    return campaign, log, *identified(campaign, log)


@pytest.fixture(scope="module")
def fouled(tmp_path_factory):
    """Likewise, with a propeller that is fouled on the way."""
    weed = World((Effect("thrust_asymmetry", {"ratio": 0.85}, "propeller"),))
    changes = [(0.0, CALM), (CHANGED_AT, weed)]
    campaign = load_campaign(campaign_of(tmp_path_factory.mktemp("fouled"), changes, 160.0, 6))
    log = read_log(campaign.logs[0].file)
    return campaign, log, *identified(campaign, log)


def notes(updates, words: str) -> list[Note]:
    return [u for u in updates if isinstance(u, Note) and words in u.text]


def readings(updates, topic: str) -> list[Reading]:
    return [u for u in updates if isinstance(u, Reading) and u.topic == topic]


# --- the estimate -----------------------------------------------------------------------------------------


def test_the_end_agrees_with_the_fit_off_line(calm):
    campaign, log, identifier, updates = calm
    plain, covariance, names = offline(campaign, log, 131.0)
    found = dict(zip(names, identifier.estimator.known.p, strict=True))
    apart = np.array(
        [(found[n] - plain[n]) / s for n, s in zip(names, np.sqrt(np.diag(covariance)), strict=True)]
    )
    assert np.mean(np.abs(apart) < 2.0) >= 0.8
    assert np.abs(apart).max() < 4.0
    assert identifier.estimator.chi2 == pytest.approx(1.0, abs=0.12)
    assert not notes(updates, "stopped fitting")


def test_everything_is_told_as_it_goes_on(calm):
    *_, updates = calm
    parameters = readings(updates, PARAMETERS)
    assert len(parameters) >= 8
    first, last = parameters[0].values, parameters[-1].values
    names = [n for n in first if not n.endswith("_stderr")]
    smaller = [last[f"{n}_stderr"] < first[f"{n}_stderr"] for n in names]
    assert np.mean(smaller) > 0.9
    errors = readings(updates, ERRORS)
    assert len(errors) > 100
    assert np.allclose(np.diff([e.t for e in errors]), 1.0)
    late = [e.values["ten_seconds_distance"] for e in errors if e.t > 60.0]
    assert 0.0 < np.median(late) < 1.0
    assert np.median([abs(e.values["one_step_psi"]) for e in errors if e.t > 60.0]) < 0.02
    scores = [m.values["score"] for m in readings(updates, MONITOR)]
    assert len(scores) > 10 and abs(np.mean(scores)) < 1.0


def test_memory_is_bounded(calm):
    _, _, identifier, _ = calm
    rows = identifier.buffer._rows
    assert rows.t[-1] - rows.t[0] < 2.0 * identifier.window
    assert all(c.t[-1] - c.t[0] < 2.0 * identifier.window for c in identifier.buffer._actuators.values())


def test_a_change_is_noticed_named_and_not_learned(fouled):
    _, _, identifier, updates = fouled
    (told,) = notes(updates, "stopped fitting")
    assert CHANGED_AT < told.t <= CHANGED_AT + 20.0
    assert told.warning
    said = notes(updates, "looks like")
    assert said and "propeller" in said[-1].text
    best = identifier.estimator.changes[-1].suspicion.named[0]
    assert best.active.effect.name == "thrust_asymmetry"
    (ratio,) = best.parameters
    assert ratio.value == pytest.approx(0.85, abs=0.02)
    before = [r for r in readings(updates, PARAMETERS) if r.t < CHANGED_AT][-1].values
    thrust = next(n for n in before if n.startswith("X_T"))
    after = dict(
        zip(
            [s.name for s in identifier.estimator.horizon.structure.slots],
            identifier.estimator.known.p,
            strict=True,
        )
    )
    assert after[thrust] == pytest.approx(before[thrust], rel=0.02)


def test_a_foreign_change_is_called_nothing_known(tmp_path):
    wash = World((Effect("wash", {"every": 9.0, "lasting": 1.2, "u": 0.25, "v": 0.25, "r": 0.1}),))
    campaign = load_campaign(campaign_of(tmp_path, [(0.0, CALM), (CHANGED_AT, wash)], 160.0, 7))
    _, updates = identified(campaign, read_log(campaign.logs[0].file))
    assert notes(updates, "stopped fitting")
    assert notes(updates, "nothing known") and not notes(updates, "odds against chance")


def test_a_current_that_sets_in_and_ends_again(tmp_path):
    changes = [(0.0, CALM), (CHANGED_AT, turned(0.3, 60.0)), (CHANGED_AT + 50.0, CALM)]
    campaign = load_campaign(campaign_of(tmp_path, changes, CHANGED_AT + 50.0 + 10.0 * CALM_BLOCKS, 9))
    identifier, updates = identified(campaign, read_log(campaign.logs[0].file))
    assert "a current" in notes(updates, "looks like")[0].text
    assert notes(updates, "fits again")
    assert identifier.estimator.change is None


# --- state ------------------------------------------------------------------------------------------------


def test_a_saved_state_is_taken_up(calm, fouled, tmp_path):
    campaign, log, identifier, _ = calm
    path = tmp_path / "state.json"
    save(identifier, path)
    again = Identifier(campaign)
    assert "going on" in restored(again, path)[0].text
    np.testing.assert_allclose(again.estimator.known.p, identifier.estimator.horizon.p)
    for tables in list(batches(log))[:240]:
        list(again.feed("log", tables))
    before, now = (np.sqrt(np.diag(i.estimator.known.covariance)) for i in (identifier, again))
    assert np.median(now / before) < 1.0
    assert not again.estimator.changes
    assert json.loads(path.read_text())["schema"] == "seatrial.online/1"


def test_a_state_of_another_vessel_is_refused(calm, tmp_path):
    campaign, _, identifier, _ = calm
    path = tmp_path / "state.json"
    save(identifier, path)
    other = replace(campaign, vessel=replace(campaign.vessel, length=9.0))
    with pytest.raises(UsageError, match="another vessel"):
        restored(Identifier(other), path)
    path.write_text("{}")
    with pytest.raises(UsageError, match="no state"):
        restored(Identifier(campaign), path)


# --- what comes in ----------------------------------------------------------------------------------------


def test_what_is_missing_is_said_once(calm):
    campaign, log, *_ = calm
    identifier, said = Identifier(campaign), []
    for tables in list(batches(log))[:60]:
        part = {k: t for k, t in tables.tables.items() if k != "HDT"}
        sources = tuple(s for s in tables.sources if s.quantity != "heading")
        said += identifier.feed("log", Tables(part, tables.units, sources))
    assert [n.text for n in said] == ["waiting for heading"]


def test_sources_are_chosen_over_all_ports(calm):
    campaign, log, *_ = calm
    tap, found = Tap(campaign), set()
    for tables in list(batches(log))[:30]:
        for port, wanted in (("gps", {"GGA", "HDT", "ROT"}), ("pilot", {"RSA", "RPM"})):
            part = {k: t for k, t in tables.tables.items() if k in wanted}
            sources = tuple(s for s in tables.sources if s.topic in part)
            found |= {r.quantity for r in tap.take(port, Tables(part, tables.units, sources))}
    assert found >= {"position", "heading", "yaw_rate", "rudder", "propeller"}
    assert (tap.plan["heading"].port, tap.plan["rudder"].port) == ("gps", "pilot")


@pytest.mark.parametrize(("declared", "receiver"), [(None, 1), (0, 0), (1, 1)])
def test_a_velocity_is_that_of_the_receiver_whose_positions_are_taken(calm, declared, receiver):
    campaign, log, *_ = calm
    sensors = () if declared is None else (vessel.Sensor("position", source=declared),)
    tap = Tap(replace(campaign, sensors=sensors))
    for tables in list(batches(log))[:30]:
        own = {k: tables.tables[k] for k in tables.tables if k != "GGA"}
        sources = [s for s in tables.sources if s.topic in own and s.quantity not in ("position", "velocity")]
        for k in (0, 1):
            own[f"fix[{k}]"] = tables.tables["GGA"][[]].assign(lat=54.0, lon=10.0, vn=1.0 + k, ve=0.0)
            where = {"latitude": "lat", "longitude": "lon"}
            sources.append(Source("position", f"fix[{k}]", where, "deg", k, 50.0 + k))
            velocity = {"north": "vn", "east": "ve"}
            sources.append(Source("velocity", f"fix[{k}]", velocity, "m/s", k, 60.0))
        tap.take("gps", Tables(own, tables.units, tuple(sources)))
    assert {tap.plan[q].topic for q in ("position", "velocity")} == {f"fix[{receiver}]"}


def test_nothing_is_lost_where_every_record_comes_alone(calm):
    campaign, *_ = calm
    lines = [x.partition(b" ") for x in campaign.logs[0].file.read_bytes().splitlines(keepends=True)[:250]]
    pieces = [(round(float(stamp) * 1e9), sentence) for stamp, _, sentence in lines]
    taken = []
    for batch in ([[p] for p in pieces], [pieces]):
        tap, decoder, samples = Tap(campaign), decoder_for("nmea"), {}
        for part in batch:
            for raw in tap.take("gps", decoder.feed(part)):
                samples.setdefault(raw.quantity, []).append(raw)
        taken.append({q: in_one(parts) for q, parts in samples.items()})
    alone, together = taken
    assert set(alone) == set(together) >= {"position", "heading", "yaw_rate", "rudder", "propeller"}
    for quantity, raw in together.items():
        np.testing.assert_array_equal(alone[quantity].t, raw.t)
        np.testing.assert_allclose(alone[quantity].value, raw.value)


@pytest.mark.parametrize(("lost", "seconds"), [(None, 8.0), ("GGA", 8.0), ("GGA", 2.5)])
def test_a_gap_ends_the_stretch_and_a_short_one_is_bridged(calm, lost, seconds):
    campaign, log, *_ = calm
    identifier, updates = Identifier(campaign), []
    for tables in batches(log, BATCH_S / 2.0):
        t = min(int(x.index[0]) for x in tables.tables.values()) * 1e-9
        gone = 70.0 < t < 70.0 + seconds
        part = {k: x for k, x in tables.tables.items() if not gone or (lost is not None and k != lost)}
        updates += identifier.feed("log", replace(tables, tables=part)) if t < 112.0 else ()
    updates += identifier.finish()
    assert not notes(updates, "stopped fitting")
    blocks = [m.t for m in readings(updates, MONITOR)]
    inside = [t for t in blocks if 74.0 < t < 80.0 + seconds]
    assert (len(inside) >= 1 if seconds < 3.0 else not inside) and max(blocks) > 100.0
    assert identifier.estimator.chi2 == pytest.approx(1.0, abs=0.15)


def test_the_campaign_needs_no_logs_but_must_be_right(calm, tmp_path):
    campaign, *_ = calm
    text = campaign.path.read_text()
    path = tmp_path / "campaign.toml"
    path.write_text(text[: text.index("[[log]]")])
    assert declared_campaign(path).vessel == campaign.vessel
    path.write_text(text.replace('name = "modulus"', 'name = "modulus"\nestimator = "ridge"'))
    with pytest.raises(CampaignError, match="output_error"):
        declared_campaign(path)
    path.write_text(text.replace('name = "modulus"', 'name = "nomoto1"'))
    with pytest.raises(UsageError, match="cannot be identified on line"):
        declared_campaign(path)


# --- the commands -----------------------------------------------------------------------------------------


def run(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([SCRIPT, *map(str, words)], capture_output=True, text=True, check=False)


def test_a_recorded_log_is_identified_by_replay(calm, tmp_path):
    campaign, *_ = calm
    model, state = tmp_path / "model.json", tmp_path / "state.json"
    words = ("--campaign", campaign.path, "--state", state, "--model", model)
    done = run("replay", campaign.logs[0].file, *words)
    assert done.returncode == 0, done.stderr
    assert "identifying modulus" in done.stdout and "known to within half" in done.stdout
    assert json.loads(model.read_text())["model"] == "modulus"
    assert run("simulate", model, "circle 35").returncode == 0
    assert state.is_file()
    assert run("replay", campaign.logs[0].file, "--state", state).returncode == 2
    assert run("replay", tmp_path / "none.nmea", "--campaign", campaign.path).returncode == 2


@pytest.mark.slow
def test_captured_through_a_port_it_is_identified_meanwhile(tmp_path):
    # sensors so rough that the moments at which a busy machine sees the bytes do not matter
    suite = Suite(Sensor(5.0, 0.2), Sensor(10.0, 0.04), Sensor(10.0, 0.03))
    truth = sailed(vessel_for("usv", "nmea0183"), [(0.0, CALM)], 100.0, 5)
    campaign = load_campaign(written(tmp_path / "trials", recorded(truth, 5, suite)))
    identifier, _ = identified(campaign, read_log(campaign.logs[0].file))
    state, raw, out = tmp_path / "state.json", tmp_path / "raw.mcap", tmp_path / "trial.mcap"
    save(identifier, state)
    as_port(campaign.logs[0].file, raw)
    player = subprocess.Popen([SCRIPT, "replay", raw, "--port", tmp_path / "gps"], stdout=subprocess.DEVNULL)
    while not (tmp_path / "gps").is_symlink():
        time.sleep(0.05)
    words = ("--port", tmp_path / "gps", "--baud", 115200, "--campaign", campaign.path, "--state", state)
    with capturing(*words, "--out", out) as process:
        begun = lines_until(process, "identifying modulus", 60.0)
        time.sleep(18.0)
        summary, said = ended(process)
    player.terminate()
    player.wait()
    assert process.returncode == 0
    assert "going on from state.json" in begun and "on line: modulus" in summary
    assert "stopped fitting" not in said and "a change at" not in summary
    log = read_log(out)
    assert {f"/online/{t}" for t in ("parameters", "errors", "monitor", "motion")} <= set(log.tables)
    errors = log.tables["/online/errors"]
    assert len(errors) > 12
    assert np.nanmedian(errors["ten_seconds_distance"]) < 1.0
    assert not math.isnan(log.tables["/online/parameters"].iloc[-1, 0])
    assert (tmp_path / "trial.model.json").is_file()
    assert {s.quantity for s in log.sources} >= {"position", "heading"}
    assert not any(
        s.topic.startswith("/online/") for s in log.sources if s.rank >= 0 and s.quantity == "position"
    )
