"""Time stamps of a table that are damaged one by one, and tables in no order."""

from pathlib import Path

import numpy as np
import pytest

from ingest import ReadOptions, read_log
from ingest.log import Log
from ingest.reader import Decoded
from ingest.tabular.delimited import DELIMITED


def decode(text: str) -> Decoded:
    return DELIMITED.read(Path("x.csv"), memoryview(text.encode()), ReadOptions())


YEAR = 31_536_000.0


@pytest.mark.parametrize(
    ("row", "wrong"),
    [(40, -YEAR), (40, YEAR), (40, 200.0), (40, -7.0), (0, YEAR), (0, -YEAR), (99, YEAR), (99, -YEAR)],
)
def test_a_single_stamp_that_is_damaged_costs_no_time(row, wrong):
    t = 1_757_800_000.0 + 0.1 * np.arange(100)
    stamps = t.copy()
    stamps[row] += wrong
    text = "time,heading\n" + "".join(f"{x:.2f},{k}\n" for k, x in enumerate(stamps))
    decoded = decode(text)
    table = decoded.tables[""]
    assert table["heading"].tolist() == list(range(100))
    np.testing.assert_allclose(table.index.to_numpy() * 1e-9, t, rtol=0.0, atol=0.25)
    [said] = [f for f in decoded.findings if f.kind == "clock"]
    assert said.count == 1 and "broken" in said.message and said.offset is None


def test_a_table_that_somebody_shuffled_is_left_in_its_own_times():
    order = np.random.default_rng(5).permutation(100)
    text = "time,heading\n" + "".join(f"{1_757_800_000 + 60 * k},{k}\n" for k in order)
    decoded = decode(text)
    assert sorted(decoded.tables[""].index) == [(1_757_800_000 + 60 * k) * 10**9 for k in range(100)]
    assert [f for f in decoded.findings if f.kind == "clock"] == []


def moved(t: np.ndarray, *borders: int) -> np.ndarray:
    """Times whose second and third block are exchanged."""
    a, b, c = borders
    return np.r_[t[:a], t[b:c], t[a:b], t[c:]]


def as_log(folder: Path, t: np.ndarray) -> Log:
    """A table of these times and their rows, in a file."""
    text = "t,heading\n" + "".join(f"{x:.2f},{k}\n" for k, x in enumerate(t))
    (folder / "a.csv").write_text(text)
    return read_log(folder / "a.csv")


def test_a_block_in_the_wrong_place_goes_where_it_fits(tmp_path):
    t = 0.2 * np.arange(600)
    log = as_log(tmp_path, moved(t, 200, 300, 400))
    np.testing.assert_allclose(log.tables[""].index.to_numpy() * 1e-9, t)
    [said] = [f for f in log.findings if f.kind == "clock"]
    assert said.count == 100 and said.message == "100 records go back in time; sorted"


def test_a_clock_that_restarts_is_still_moved_on(tmp_path):
    t = 0.2 * np.arange(300)
    for restarted in (np.r_[t, t], np.r_[t + 500.0, t], np.r_[t, t[200:] - 10.0]):
        log = as_log(tmp_path, restarted)
        assert log.duration_s == pytest.approx(0.2 * (len(restarted) - 1))
        assert "moved on" in next(f.message for f in log.findings if f.kind == "clock")
