"""Cells that read as numbers and hold no quantity: they are empty, and told."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from ingest import ReadOptions, read_log
from ingest.tabular.delimited import DELIMITED


def decoded(cell, every=10, n=100):
    lines = (f"{0.1 * i:.1f},{10 + i % 7},{cell if i % every == 0 else 20 + i % 5}" for i in range(n))
    text = "time,rudder_deg,rps\n" + "\n".join(lines) + "\n"
    return DELIMITED.read(Path("x.csv"), memoryview(text.encode()), ReadOptions())


@pytest.mark.parametrize("cell", ["1e300", "-1e31", "inf", "-inf", "Infinity", "1e999", "1d300"])
def test_cells_that_no_quantity_reaches_are_empty_and_told(cell):
    found = decoded(cell)
    assert np.isnan(found.tables[""]["rps"].to_numpy()[::10]).all()
    assert found.tables[""]["rps"].count() == 90
    said = [f for f in found.findings if f.kind == "damaged"]
    assert [(f.message.startswith("10 cells of 'rps' are"), f.count) for f in said] == [(True, 10)]


@pytest.mark.parametrize("cell", ["inf", "1e300"])
def test_a_unit_is_guessed_from_what_is_measured(cell):
    text = "time,propeller\n" + "\n".join(f"{0.1 * i:.1f},{cell if i == 7 else 20}" for i in range(50))
    found = DELIMITED.read(Path("x.csv"), memoryview(text.encode()), ReadOptions())
    assert [s.unit for s in found.sources if s.quantity == "propeller"] == ["rev/s"]


def test_large_numbers_stay():
    found = decoded("1e29")
    assert not [f for f in found.findings if f.kind == "damaged"]
    assert found.tables[""]["rps"].max() == 1e29


def test_of_a_matlab_file_too(tmp_path):
    t = np.arange(0.0, 10.0, 0.1)
    savemat(tmp_path / "x.mat", {"time": t, "rps": np.where(t > 9.0, np.inf, 20.0)})
    log = read_log(tmp_path / "x.mat")
    assert any("'rps' are infinite" in f.message for f in log.findings)
    assert not any(np.isinf(table["rps"]).any() for table in log.tables.values() if "rps" in table)
