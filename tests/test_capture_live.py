"""The live view of a capture."""

from __future__ import annotations

import time

import numpy as np

from benchmarks.serial_line import nmea_record
from seatrial.capture.live_decoding import PortDecoder
from seatrial.capture.settings import PortSettings, Protocol


def test_the_live_view_shows_what_comes_and_is_prompt(tmp_path):
    import rerun as rr

    from seatrial.capture.live_view import LiveView
    from seatrial.capture.viewer_process import viewer_command

    path, port = tmp_path / "live.rrd", PortSettings("/dev/a", 115200, Protocol.nmea, "gps")
    recording = rr.RecordingStream("seatrial")
    recording.save(path)
    view = LiveView("trial", (port,), recording)
    decoder = PortDecoder(port, [view.show])
    for i in range(12):
        decoder.feed([(time.time_ns(), nmea_record(i))])
        time.sleep(0.05)
    view.close()
    assert len(view.latency_s) == 12 and view.not_shown == 0
    assert np.median(list(view.latency_s)[6:]) < 0.2
    del recording, view
    assert path.stat().st_size > 5000
    assert viewer_command(9)[3:5] == ["--bind", "127.0.0.1"]
