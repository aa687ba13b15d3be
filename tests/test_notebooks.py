"""The notebooks: kept without outputs, and run from top to bottom in an empty folder."""

from __future__ import annotations

import warnings
from pathlib import Path

import nbformat
import pytest

from seatrial.demonstration import copy_demo

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
by_name = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)


def executed(path: Path, folder: Path) -> nbformat.NotebookNode:
    """The notebook with its outputs; the first error of a cell is raised with that cell."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of the kernel's own libraries
        from nbclient import NotebookClient
    book = nbformat.read(path, as_version=4)
    where = {"metadata": {"path": str(folder)}}
    return NotebookClient(book, timeout=300, kernel_name="python3", resources=where).execute()


def said(book: nbformat.NotebookNode) -> str:
    """Everything that the cells printed or showed as text."""
    shown = [o for c in book.cells if c.cell_type == "code" for o in c.outputs]
    return "\n".join(o.get("text", "") or o.get("data", {}).get("text/plain", "") for o in shown)


def with_logs(folder: Path, *names: str) -> None:
    """A copy of the demo whose campaign has these logs alone: what the notebook says does not hang on more."""
    campaign = copy_demo(folder)
    head, *logs = campaign.read_text(encoding="utf-8").split("[[log]]")
    mine = [log for log in logs if any(f'"{name}"' in log for name in names)]
    campaign.write_text("[[log]]".join([head, *mine]), encoding="utf-8")


def test_every_notebook_has_a_test_that_runs_it():
    assert {p.stem for p in NOTEBOOKS} == {"first_look"}


@by_name
def test_a_notebook_is_kept_without_outputs(path):
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    for cell in book.cells:
        if cell.cell_type == "code":
            assert not cell.outputs
            assert cell.execution_count is None


@pytest.mark.slow
def test_the_first_look_finds_the_current_of_the_demo(tmp_path):
    (path,) = (p for p in NOTEBOOKS if p.stem == "first_look")
    with_logs(tmp_path / "first-look", "01-zigzag.nmea", "02-circle.nmea", "04-zigzag10.nmea")
    book = executed(path, tmp_path)
    words = said(book)
    assert "nothing material remains" in words
    assert "current: speed 0.350 ±" in words
    assert "first_overshoot" in words
    pictures = [
        o for c in book.cells if c.cell_type == "code" for o in c.outputs if "image/png" in o.get("data", {})
    ]
    assert len(pictures) == 1
    assert (tmp_path / "first-look" / "results" / "report.html").is_file()
