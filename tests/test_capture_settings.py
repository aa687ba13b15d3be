"""What a capture is told, by ``capture.toml`` and the command line, and what is wrong with it."""

from __future__ import annotations

import os

import pytest
from doc_pages import ROOT, blocks

from ingest.errors import CampaignError
from seatrial.capture.settings import PortSettings, Protocol
from seatrial.capture.settings_file import Wanted, read_settings, settings_from


def test_the_command_line_wins_over_the_file(tmp_path):
    path = tmp_path / "capture.toml"
    path.write_text(
        'out = "day-{utc}.mcap"\nrotate_size = 2\nrotate_minutes = 1.5\nlive = true\n'
        '[[port]]\ndevice = "/dev/a"\nbaud = 4800\nprotocol = "nmea"\nname = "gps"\n'
        '[[port]]\ndevice = "/dev/b"\nbaud = 115200\n',
        encoding="utf-8",
    )
    found = settings_from(Wanted(path, rotate_size=5, no_decode=True))
    assert found.ports == (
        PortSettings("/dev/a", 4800, Protocol.nmea, "gps"),
        PortSettings("/dev/b", 115200, name="b"),
    )
    assert (found.rotate_bytes, found.rotate_s, found.live, found.decode) == (5e6, 90.0, True, False)
    assert found.out == tmp_path / "day-{utc}.mcap"
    assert settings_from(Wanted(path, ["/dev/c"], [9600])).ports == (PortSettings("/dev/c", 9600, name="c"),)


@pytest.mark.parametrize(
    ("text", "key", "near"),
    [
        ("[[prot]]", "prot", "port"),
        ('[[port]]\ndevice = "a"\nbuad = 3', "[[port]] 1: buad", "baud"),
        ('[[port]]\ndevice = "a"', "[[port]] 1: baud", None),
        ('[[port]]\ndevice = "a"\nbaud = "9600"', "[[port]] 1: baud", None),
        ('[[port]]\ndevice = "a"\nbaud = 9600\nprotocol = "mavlnk"', "[[port]] 1: protocol", "mavlink"),
        ('[[port]]\ndevice = "a"\nbaud = 9600\nheartbeat = true', "[[port]] 1: heartbeat", None),
        ("rotate_size = -1", "rotate_size", None),
        ("duration = true", "duration", None),
        ("out = ", "the file", None),
    ],
)
def test_a_wrong_file_is_told_where(text, key, near, tmp_path):
    path = tmp_path / "capture.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CampaignError) as error:
        settings_from(Wanted(path))
    assert (error.value.key, error.value.nearest_key) == (key, near)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--port", "/dev/ttyNO7", "--baud", "9600"], "no such port"),
        (["--port", "{tmp}", "--baud", "9600"], "found a folder"),
        (["--port", "{tmp}/file", "--baud", "9600"], "found a file"),
        (["--port", "/dev/null"], "--baud"),
        (["--port", "/dev/null", "--baud", "7"], "from 50"),
        (["--port", "/dev/null", "--baud", "96", "--baud", "48"], "expected 1 value for 1 port, found 2"),
        (["--port", "/dev/null", "--baud", "9600", "--protocol", "nema"], "Did you mean 'nmea'"),
        (["--port", "/dev/null", "--port", "/dev/null", "--baud", "9600"], "named twice"),
        (["--port", "/dev/null", "--baud", "9600", "--out", "{tmp}/old.mcap"], "not overwritten"),
        (["--port", "/dev/null", "--baud", "9600", "--out", "{tmp}/none/a.mcap"], "make it first"),
        (["--port", "/dev/null", "--baud", "9600", "--duration", "-1"], "positive"),
        (["--port", "/dev/null", "--baud", "9600", "--heartbeat"], "--protocol mavlink"),
        (["{tmp}/none.toml"], "no such file"),
    ],
)
def test_what_is_wrong_is_said_before_anything_begins(words, expected, tmp_path, capsys):
    from seatrial.__main__ import main

    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "old.mcap").write_bytes(b"")
    with pytest.raises(SystemExit) as exit_:
        main(["capture", *(w.format(tmp=tmp_path) for w in words)])
    assert exit_.value.code == 2
    assert expected in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "old.mcap"]


def test_a_port_that_one_may_not_open_is_said_with_the_cure(monkeypatch, capsys):
    from seatrial.__main__ import main

    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(SystemExit) as exit_:
        main(["capture", "--port", "/dev/null", "--baud", "9600"])
    said = " ".join(capsys.readouterr().err.split())
    assert exit_.value.code == 2
    assert "no permission to open this port" in said and "usermod -aG" in said


@pytest.mark.parametrize("page", ["serial", "sail-and-identify"])
def test_what_the_documents_say_of_the_file_is_right(page, tmp_path):
    found = [b.text for b in blocks(ROOT / "docs" / "how-to" / f"{page}.md") if b.language == "ini"]
    assert found
    for text in found:
        path = tmp_path / "capture.toml"
        path.write_text(text, encoding="utf-8")
        assert read_settings(path).out.parent.is_relative_to(tmp_path)


def test_a_file_that_cannot_be_read_is_said_so(tmp_path):
    with pytest.raises(CampaignError, match=r"capture\.toml: the file: expected one that can be read"):
        read_settings(tmp_path / "capture.toml")
