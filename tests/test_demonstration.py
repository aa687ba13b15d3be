"""The demo never writes over a file of the user's."""

from __future__ import annotations

import pytest

from ingest.errors import UsageError
from seatrial.campaign.load import FILENAME
from seatrial.demonstration import copy_demo, demo_files, is_changed


def test_a_copy_is_whole_and_a_second_one_keeps_what_was_changed_in_its_campaign(tmp_path):
    file = copy_demo(tmp_path / "new" / "demo")
    assert {p.name: p.read_bytes() for p in file.parent.iterdir()} == demo_files()
    assert not is_changed(file)
    (file.parent / "results").mkdir()
    file.write_text(file.read_text().replace("modulus", "blanke"))
    assert copy_demo(file.parent) == file
    assert "blanke" in file.read_text()
    assert is_changed(file)


def test_what_is_missing_of_a_copy_is_put_back(tmp_path):
    file = copy_demo(tmp_path)
    (tmp_path / "02-circle.nmea").unlink()
    (tmp_path / ".DS_Store").touch()
    copy_demo(tmp_path)
    (tmp_path / ".DS_Store").unlink()
    assert {p.name: p.read_bytes() for p in file.parent.iterdir()} == demo_files()


@pytest.mark.parametrize(
    "names", [(FILENAME,), ("01-zigzag.nmea",), (FILENAME, "01-zigzag.nmea"), ("notes",)]
)
def test_a_folder_of_the_users_own_is_left_as_it_is(tmp_path, names):
    for name in names:
        (tmp_path / name).write_text("mine")
    with pytest.raises(UsageError, match="not the demo's own"):
        copy_demo(tmp_path)
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == dict.fromkeys(names, "mine")
