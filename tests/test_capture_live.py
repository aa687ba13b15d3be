"""The live view of a capture, and of the identification beside it, as the viewer gets them."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest

from benchmarks.serial_line import nmea, nmea_record
from seatrial.capture.live_decoding import PortDecoder
from seatrial.capture.settings import PortSettings, Protocol
from seatrial.online.updates import ERRORS, MONITOR, PARAMETERS, Note, Reading

rr = pytest.importorskip("rerun")
GPS = PortSettings("/dev/a", 115200, Protocol.nmea, "gps")


def recording_to(path) -> rr.RecordingStream:
    recording = rr.RecordingStream("seatrial")
    recording.save(path)
    return recording


def shown(path) -> dict[str, list]:
    """Values of every entity that changes, in the order in which they were sent; texts where it is a text."""
    from rerun.chunk import RrdReader

    found: dict[str, list] = {}
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.endswith((":scalars", ":text")):
                found.setdefault(str(chunk.entity_path), []).extend(batch.column(name).to_pylist())
            elif name.endswith((":strips", ":positions")):
                found.setdefault(str(chunk.entity_path), []).append(name)
    return found


def test_the_live_view_shows_what_comes_and_is_prompt(tmp_path):
    from seatrial.capture.live_view import LiveView
    from seatrial.capture.viewer_process import viewer_command

    view = LiveView("trial", (GPS,), recording_to(tmp_path / "live.rrd"))
    decoder = PortDecoder(GPS, [view.show])
    for i in range(12):
        decoder.feed([(time.time_ns(), nmea_record(i))])
        time.sleep(0.05)
    view.close()
    assert len(view.latency_s) == 12 and view.not_shown == 0
    assert np.median(list(view.latency_s)[6:]) < 0.2
    assert viewer_command(9)[3:5] == ["--bind", "127.0.0.1"]


def test_track_signals_rates_damage_and_ages_are_there_though_records_come_alone(tmp_path):
    from seatrial.capture.live_view import LiveView

    path = tmp_path / "live.rrd"
    view = LiveView("trial", (GPS,), recording_to(path))
    decoder = PortDecoder(GPS, [view.show])
    for i in range(40):
        for sentence in nmea_record(i).splitlines(keepends=True):
            decoder.feed([(time.time_ns(), sentence)])
        while view._queue.qsize() > 32:
            time.sleep(0.01)
    decoder.feed([(time.time_ns(), b"$GPGGA,broken*00\r\n" + nmea("HEHDT,1.0,T"))])
    view.close()
    del view
    found = shown(path)
    signals = [p for p in found if "/signals/" in p]
    assert {p.split("/signals/")[1].split("/")[0] for p in signals} == {"heading", "yaw_rate", "rudder"}
    heading = np.ravel(next(v for p, v in found.items() if "/signals/heading/" in p))
    np.testing.assert_allclose(heading, [*(0.1 * np.arange(1, 40)), 1.0])
    assert any(p.endswith("plan/smoothed") for p in found) and any(p.endswith("plan/here") for p in found)
    table = np.ravel(found["/logs/trial/sensors"])[-1]
    assert "| gps | GGA |" in table and "| gps | HDT |" in table and "age (s)" in table
    assert re.search(r"- gps: 1[678] damaged bytes", table) and "ms from arrival to here" in table


def test_an_identification_is_shown_beside_it(tmp_path):
    from seatrial.online.live_curves import LiveCurves

    path = tmp_path / "online.rrd"
    curves, now = LiveCurves("trial", recording_to(path)), time.time_ns()
    curves.show(now, Reading(PARAMETERS, 10.0, {"Y_u|v|": -0.5, "Y_u|v|_stderr": 0.1}, {}))
    curves.show(now, Reading(ERRORS, 10.0, {"one_step_psi": 0.01, "ten_seconds_distance": 0.4}, {}))
    curves.show(now, Reading(MONITOR, 10.0, {"score": 0.3, "sum": 0.0, "limit": 3.6, "alarm": 0.0}, {}))
    curves.show(now, Note(11.0, "the model has stopped fitting", warning=True))
    curves.close()
    del curves
    found = shown(path)
    root = "/logs/trial/online"
    np.testing.assert_allclose(found[f"{root}/parameters/Y_u_v_"], [[-0.7, -0.5, -0.3]])
    assert found[f"{root}/errors/ten_seconds_distance"] == [[0.4]]
    assert found[f"{root}/monitor/limit"] == [[3.6]]
    assert found[f"{root}/events"] == [["the model has stopped fitting"]]
