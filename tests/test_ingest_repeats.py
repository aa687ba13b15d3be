"""Records that stand in a log twice count once; a clock that was set back is no repetition."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marine_samples import epoch

from ingest import ReadOptions
from ingest.log import Log, Source
from ingest.marine.stream import decode_stream
from ingest.repeats import repeated
from ingest.tabular.delimited import DELIMITED
from preprocess.raw import read_raw
from preprocess.vessel import Vessel

HEADER = "time,north,east\n"


def lines(count, first=0):
    return [f"{1.7e9 + 0.05 * k:.2f},{np.sin(k):.4f},{0.1 * k:.4f}\n" for k in range(first, first + count)]


def decoded(body):
    return DELIMITED.read(Path("x.csv"), memoryview((HEADER + "".join(body)).encode()), ReadOptions())


@settings(deadline=None)
@given(st.integers(0, 150), st.integers(2, 50), st.integers(1, 3))
def test_a_block_that_was_written_again_counts_once(first, width, times):
    whole = lines(200)
    block = whole[first : first + width]
    found = decoded([*whole[: first + width], *block * times, *whole[first + width :]])
    pd.testing.assert_frame_equal(found.tables[""], decoded(whole).tables[""])
    (finding,) = found.findings
    assert (finding.kind, finding.count) == ("duplicate", len(block) * times)


def test_a_clock_that_was_set_back_goes_on():
    other = [f"{line.split(',')[0]},7.25,{k}\n" for k, line in enumerate(lines(60, 40))]
    found = decoded([*lines(100), *other])
    assert len(found.tables[""]) == 160
    assert any("went back" in f.message for f in found.findings)


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 2)), max_size=40))
def test_what_is_left_out_stands_there_all_the_same(records):
    t = np.array([a for a, _ in records], dtype=np.int64)
    twice = repeated(t, np.ones(len(t), bool), lambda a, b, n: records[a : a + n] == records[b : b + n])
    left = [r for r, again in zip(records, twice, strict=True) if not again]
    assert set(left) == set(records)


@pytest.mark.parametrize("width", [6, 43])
def test_sentences_that_were_written_again_count_once(width):
    whole = [sentence for k in range(80) for sentence in epoch(k)]
    again = [*whole[:201], *whole[201 - width : 201], *whole[201:]]
    found, expected = (decode_stream(b"".join(sentences)) for sentences in (again, whole))
    for topic, table in expected.tables.items():
        pd.testing.assert_frame_equal(found.tables[topic], table)
    assert [f.kind for f in found.findings] == ["duplicate"]


def test_a_sample_that_was_logged_twice_is_one():
    t = np.repeat(np.arange(50) * 100_000_000, 2)
    table = pd.DataFrame({"psi": np.repeat(np.sin(np.arange(50.0)), 2)}, index=pd.Index(t, name="t_ns"))
    source = Source("heading", "", {"value": "psi"}, "rad", None, 1.0, {})
    raw = read_raw(Log(Path("x"), "csv", {"": table}), source, None, Vessel("boat", 1.2, 0.4))
    assert raw.t == pytest.approx(0.1 * np.arange(50))
    assert raw.value.ravel() == pytest.approx(np.sin(np.arange(50.0)))
