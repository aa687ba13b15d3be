"""The pages of the documents taken apart, and the folders in which their commands can run."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import pytest

from fixtures.make_campaign import main as make_campaign
from seatrial.__main__ import main

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
#: Every page that a person writes; the reference is made from the code.
PAGES = sorted([README, *(p for p in (ROOT / "docs").rglob("*.md") if "reference" not in p.parts)])
#: What a test cannot do: it would install, run every test, open a window, wait for a device, or need measured data.
NOT_RUN = (
    "make ",
    "python docs/make_case_studies.py DATA",
    "seatrial view ",
    "seatrial capture ",
    "seatrial replay trial.mcap --port",
)
#: Commands that need nothing of the page's folder, and with which several pages begin.
SHARED = ("seatrial demo",)
#: Commands that start processes of their own, or end with one.
OF_ITS_OWN = ("seatrial replay ",)
#: Measured logs that a page finds in ``trials``, where a folder beside the clone has them.
MEASURED = {
    "tutorial-measured": [
        ROOT.parent / "shared" / "data" / "blueboat" / f"{n}.bin"
        for n in ("00000216", "00000230", "00000233")
    ]
}
#: So much of each is enough for all that the page says; the search for what a model lacks takes long in whole ones.
MEASURED_SHARE = 0.65
#: Vessel and format of the logs that a page finds in ``trials``.
TRIALS = {
    "README": ("usv", "tlog"),
    "ardupilot": ("catamaran", "dataflash"),
    "nmea2000": ("usv", "candump"),
    "ros2": ("tug", "mcap-joints"),
    "serial": ("usv", "nmea0183-epochs"),
    "csv": ("usv", "csv"),
    "sail-and-identify": ("usv", "nmea0183"),
    "choose-a-model": ("usv", "tlog"),
    "read-a-verdict": ("usv", "tlog"),
    "simulate": ("usv", "tlog"),
}

FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PLACED = re.compile(r"# (\S+)\n")


@dataclass(frozen=True)
class Block:
    """A block of code of a page."""

    language: str
    text: str

    @property
    def place(self) -> str | None:
        """The file that a block is to become, from its first line."""
        found = PLACED.match(self.text)
        return found[1] if found and self.language == "toml" else None

    @property
    def commands(self) -> list[str]:
        """Commands of a shell block without their remarks."""
        lines = (re.sub(r"\s+# .*", "", line).strip() for line in self.text.splitlines())
        return [line for line in lines if line and not line.startswith("#")]


def blocks(page: Path) -> list[Block]:
    return [Block(*found) for found in FENCE.findall(page.read_text(encoding="utf-8"))]


def runs(page: Path) -> bool:
    """Whether the page has anything to run."""
    return any(
        b.language == "python" or (b.language == "sh" and any(not c.startswith(NOT_RUN) for c in b.commands))
        for b in blocks(page)
    )


def prepare(page: Path, folder: Path) -> None:
    """The logs that the page speaks of; the campaign only where the page does not write it itself."""
    for log in MEASURED.get(page.stem, ()):
        (folder / "trials").mkdir(exist_ok=True)
        whole = log.read_bytes()
        (folder / "trials" / log.name).write_bytes(whole[: round(MEASURED_SHARE * len(whole))])
    if page.stem not in TRIALS:
        return
    vessel, form = TRIALS[page.stem]
    trials = folder / "trials"
    duration = "60" if page.stem == "sail-and-identify" else "45"
    words = ["--vessel", vessel, "--format", form, "--logs", "3", "--duration", duration, "--seed", "7"]
    make_campaign([str(trials), *words])
    if any(b.place == "trials/campaign.toml" for b in blocks(page)):
        (trials / "campaign.toml").unlink()
    if page.stem == "serial":
        cut_off(folder / "trial.mcap")


def cut_off(path: Path) -> None:
    """A recording that ends in the middle of a record."""
    make_campaign([str(path.parent / "cut"), "--format", "mcap", "--logs", "1", "--duration", "20"])
    (whole,) = (path.parent / "cut").glob("*.mcap")
    path.write_bytes(whole.read_bytes()[:-5000])


def run_command(command: str, folder: Path) -> str:
    """Output of a command; a benchmark runs in the clone, all else in the page's folder."""
    beside = str(Path(sys.executable).parent)
    environment = {**os.environ, "PATH": f"{beside}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "200"}
    where = ROOT if command.startswith("python -m benchmarks") else folder
    done = subprocess.run(
        command,
        shell=True,
        cwd=where,
        env=environment,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, f"{command}: exit status {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def run_here(command: str, folder: Path) -> str:
    """Output of a command of the program's own, done in this process: many take no longer than one takes to start."""
    said, wrong = io.StringIO(), io.StringIO()
    words = shlex.split(command)[1:]
    with (
        contextlib.chdir(folder),
        patch.dict(os.environ, COLUMNS="200"),
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(wrong),
        pytest.raises(SystemExit) as end,
    ):
        main(words)
    assert not end.value.code, f"{command}: {end.value.code}\n{said.getvalue()}\n{wrong.getvalue()}"
    return said.getvalue()


def run_page(page: Path, folder: Path, shared: Callable[[str], tuple[str, Path]]) -> None:
    """Do what the page says, from top to bottom: what the README says as a shell does it.

    ``shared`` does a command of ``SHARED`` once for all pages: what it said, and the folder with what it made.
    """

    def run(command: str) -> str:
        if command not in SHARED:
            here = page != README and command.startswith("seatrial ") and not command.startswith(OF_ITS_OWN)
            return (run_here if here else run_command)(command, folder)
        said, made = shared(command)
        shutil.copytree(made, folder, dirs_exist_ok=True)
        return said

    prepare(page, folder)
    said = ""
    for block in blocks(page):
        if block.language == "sh":
            said += "".join(run(c) for c in block.commands if not c.startswith(NOT_RUN))
        elif block.language == "python":
            script = folder / "example.py"
            script.write_text(block.text, encoding="utf-8")
            said += run_command("python example.py", folder)
        elif block.place:
            (folder / block.place).write_text(block.text, encoding="utf-8")
        elif block.language == "text":
            assert squeezed(block.text) in squeezed(said), block.text


def squeezed(text: str) -> str:
    return " ".join(text.split())
