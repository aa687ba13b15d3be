"""Progress as a person sees it: bars on a terminal, nothing or one plain line per stage elsewhere."""

from __future__ import annotations

import multiprocessing
import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import numba
import pytest

from seatrial.cli.compiling import told_of_compiling
from seatrial.cli.stage_lines import StageLines
from seatrial.demonstration import demo_source

SCRIPT = Path(sys.executable).parent / "seatrial"
LOG = demo_source() / "01-zigzag.nmea"


def on_a_terminal(*words: str) -> tuple[str, str]:
    """What a command writes to stdout (a pipe) and to stderr (a terminal)."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "80"}
    process = subprocess.Popen(
        [str(SCRIPT), *words], stdout=subprocess.PIPE, stderr=theirs, env=environment, text=True
    )
    os.close(theirs)
    seen = b""
    try:
        while part := os.read(ours, 4096):
            seen += part
    except OSError:
        pass  # the other end is closed: that is how a terminal ends
    os.close(ours)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    return out, seen.decode()


def test_a_terminal_sees_a_bar_with_colour_and_the_pipe_beside_it_neither():
    out, err = on_a_terminal("inspect", str(LOG))
    assert "Reading" in err
    assert "━" in err
    assert re.search(r"\x1b\[\d", err)
    assert "\x1b" not in out
    assert "Looks like" in out


def test_elsewhere_short_commands_say_nothing_on_stderr():
    done = subprocess.run([SCRIPT, "inspect", LOG], capture_output=True, text=True, check=True)
    assert done.stderr == ""


def test_a_line_per_stage_only_where_it_is_wanted(capsys):
    for lines, wanted in ((True, ["Reading", "Writing"]), (False, [])):
        with StageLines(lines=lines) as progress:
            progress("ingest", "a.log", 0.5)
            progress("write", "", 1.0)
        said = capsys.readouterr().err.splitlines()
        assert [line.split()[0] for line in said] == wanted


def test_quiet_is_quiet(capsys):
    with StageLines(quiet=True) as progress:
        progress("fleet", "", 0.0)
        progress.say("1/2  harbour: explained")
    assert capsys.readouterr().err == ""


def test_what_is_said_beside_the_bars_is_said_whole(capsys):
    line = "1/2  " + "harbour " * 20 + "[a]: explained"
    with StageLines(lines=False) as progress:
        progress("fleet", "", 0.0)
        progress.say(line)
    assert capsys.readouterr().err == line + "\n"


def test_compiling_is_told_once_and_loading_is_not():
    said = []
    with told_of_compiling(said.append) as listen:
        listen()
        listen()
        assert not said
        for number in (1, 1.0):
            numba.njit(lambda x: x + 1)(number)
    numba.njit(lambda x: x + 2)(1)
    assert len(said) == 1
    assert "once" in said[0]


def test_a_process_beside_says_nothing_of_its_own_compiling():
    read, write = os.pipe()
    compiling = partial(numba.njit(lambda x: x + 3), 1)
    with told_of_compiling(lambda _: os.write(write, b".")) as listen:
        listen()
        beside = multiprocessing.get_context("fork").Process(target=compiling)
        beside.start()
        beside.join()
        compiling()
    os.close(write)
    with os.fdopen(read, "rb") as told:
        assert told.read() == b"."
