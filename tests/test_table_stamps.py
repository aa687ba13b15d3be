"""Time stamps of a table that are damaged one by one, and tables in no order."""

from pathlib import Path

import numpy as np
import pytest

from ingest import ReadOptions
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
