"""The notebooks: kept without outputs, and run from top to bottom in an empty folder."""

from __future__ import annotations

import warnings
from pathlib import Path

import nbformat
import pytest

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
