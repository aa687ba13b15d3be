"""Ctrl-C for real: a signal to the whole process group, as a terminal sends it, at every stage of a run."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import ModuleType

import pytest

from seatrial.__main__ import main
from seatrial.cli.stage_lines import StageLines
from seatrial.demonstration import demo_source

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")
SCRIPT = Path(sys.executable).parent / "seatrial"


def heard() -> None:
    """A shell starts what runs behind it deaf to Ctrl-C, and so would be all that is started from there."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class Started:
    """A command in a process group of its own; what it says is read as it comes."""

    def __init__(self, folder: Path, *words: str) -> None:
        self.process = subprocess.Popen(
            [str(SCRIPT), *words],
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=heard,
        )
        self.said = ""
        self.reader = threading.Thread(target=self._read)
        self.reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as stream:
            for line in stream:
                self.said += line

    def until(self, there: Callable[[str], bool], patience: float = 120.0) -> None:
        last = time.monotonic() + patience
        while not there(self.said):
            assert self.process.poll() is None, f"ended too early: {self.said}"
            assert time.monotonic() < last, self.said
            time.sleep(0.005)

    def interrupted(self) -> int:
        os.killpg(self.process.pid, signal.SIGINT)
        status = self.process.wait(30)
        self.reader.join(10)
        return status


@pytest.fixture
def folder(tmp_path):
    """The demo's campaign with one log to identify on and one to validate on: what is left behind is looked at."""
    shutil.copytree(demo_source(), tmp_path / "demo", ignore=shutil.ignore_patterns(".*", "results"))
    campaign = tmp_path / "demo" / "campaign.toml"
    head, *logs = campaign.read_text(encoding="utf-8").split("[[log]]")
    some = [next(log for log in logs if role in log) for role in ("identify", "validate")]
    campaign.write_text("[[log]]".join([head, *some]), encoding="utf-8")
    return tmp_path / "demo"


def unfinished(folder: Path) -> list[Path]:
    return list(folder.glob(".results-*/results/*"))


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["start", "identify", "write"])
def test_an_interrupted_run_leaves_what_was_there_and_nothing_else(folder, stage):
    (folder / "results").mkdir()
    (folder / "results" / "report.json").write_text("old")
    before = {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    # a quick model: what is looked at is what is left behind, not what is found
    run = Started(folder, "run", ".", "--no-loop", "--model", "linear", "--estimator", "ls")
    moment = {
        "start": lambda said: "Reading" in said,
        "identify": lambda said: "Preprocessing" in said,
        "write": lambda said: bool(unfinished(folder)),
    }
    run.until(moment[stage])
    status = run.interrupted()
    assert status == 130, run.said
    assert run.said.endswith("Interrupted: nothing half-written is left.\n")
    assert "Traceback" not in run.said
    assert {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before
    assert not list(folder.glob(".results-*"))


def test_an_interrupt_that_a_library_keeps_to_itself_ends_the_run_at_its_next_step():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), StageLines(quiet=True) as progress:
            progress("ingest")
            with suppress(KeyboardInterrupt):
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(5.0)
            progress("preprocess")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        with StageLines(quiet=True) as progress:
            progress("ingest")
    finally:
        signal.signal(signal.SIGINT, before)


def test_an_interrupt_where_none_can_be_raised_says_nothing_and_ends_the_run_all_the_same(monkeypatch):
    """As a process forks, or an object goes: Python would write its trace to the terminal and go on."""

    class Going:
        def __init__(self, fault):
            self.fault = fault

        def __del__(self):
            if self.fault is KeyboardInterrupt:
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(5.0)
            raise self.fault

    said = []
    monkeypatch.setattr(sys, "unraisablehook", lambda what: said.append(what.exc_type))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), StageLines(quiet=True) as progress:
            progress("ingest")
            going = Going(ValueError)
            del going
            assert said == [ValueError]
            going = Going(KeyboardInterrupt)
            del going
            progress("preprocess")
        assert said == [ValueError]
        going = Going(ValueError)
        del going
        assert said == [ValueError] * 2
    finally:
        signal.signal(signal.SIGINT, before)


ENDED = """
import seatrial.cli.program as program
from seatrial.__main__ import main

def handled(words):
    try:
        exec("raise KeyboardInterrupt")
    except KeyboardInterrupt:
        raise SystemExit(130)

program.run_program = handled
main()
"""


def test_an_interrupt_in_code_made_of_text_ends_with_the_status_that_is_said():
    assert subprocess.run([sys.executable, "-c", ENDED], check=False).returncode == 130


def test_an_interrupt_while_the_program_is_loaded_is_said(monkeypatch, capsys):
    class Loading(ModuleType):
        def __getattr__(self, name: str) -> object:
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "seatrial.cli.program", Loading("program"))
    with pytest.raises(SystemExit) as ended:
        main(["inspect"])
    assert ended.value.code == 130
    assert capsys.readouterr().err == "Interrupted: nothing half-written is left.\n"
