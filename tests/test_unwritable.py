"""What cannot be written or read is said in one sentence, before the work that it would cost."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from campaign_samples import SMALL

from ingest.errors import UsageError
from seatrial.__main__ import main
from seatrial.campaign.load import bytes_of
from seatrial.writable import check_file, check_folder


@pytest.fixture
def folder(tmp_path):
    """A campaign whose log is never read, a capture, and a file where a folder is expected."""
    (tmp_path / "campaign.toml").write_text(SMALL)
    for name in ("a.csv", "a.mcap", "file"):
        (tmp_path / name).write_text("")
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        "run {0} --out {0}/file/x",
        "run {0} --out /proc/x",
        "demo --out /proc/x",
        "demo --out {0}/file/x",
        "init /proc",
        "compare {0} --out /proc/x.svg",
        "simulate {0}/model.json --out /proc/x.svg",
        "simulate {0}/model.json --out {0}/nowhere/x.svg",
        "fleet {0} --out /proc/x.csv",
        "fleet {0} --results /proc/x",
        "recover {0}/a.mcap --out /proc/x.mcap",
        "replay {0}/a.csv --campaign {0} --model {0}/nowhere/m.json",
        "replay {0}/a.csv --campaign {0} --model /proc/m.json",
        "replay {0}/a.csv --campaign {0} --state /proc/s.json",
    ],
)
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder in which nobody can write")
def test_what_cannot_be_written_is_said_before_the_work(folder, words, capsys):
    with pytest.raises(SystemExit) as end:
        main([w.format(folder) for w in words.split()])
    out, err = capsys.readouterr()
    assert end.value.code == 2, err
    assert not out
    assert err.startswith("Error: ") and err.count("\n") == 1, err
    assert any(w in err for w in ("cannot be written to", "is not there; make it first", "expected a folder"))


def test_the_check_leaves_everything_as_it_was(tmp_path):
    kept = tmp_path / "kept.csv"
    kept.write_text("as it was")
    check_file(kept, "--out")
    check_file(tmp_path / "new.csv", "--out")
    check_folder(tmp_path / "new" / "folder", "--out")
    assert [p.name for p in tmp_path.iterdir()] == ["kept.csv"]
    assert kept.read_text() == "as it was"
    with pytest.raises(UsageError, match="found the folder"):
        check_file(tmp_path, "--out")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_one_may_not_enter(tmp_path):
    tmp_path.chmod(0o000)
    try:
        with pytest.raises(UsageError, match="permission denied"):
            check_folder(tmp_path / "a" / "b", "--out")
    finally:
        tmp_path.chmod(0o700)


def test_a_campaign_that_may_not_be_read(folder, monkeypatch):
    def refused(_: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refused)
    with pytest.raises(UsageError, match=r"the campaign cannot be read \(permission denied\)"):
        bytes_of(folder / "campaign.toml")
