"""From a file to a log: unpacking, recognition by content, errors that say what was tried."""

from __future__ import annotations

import gzip
import lzma
import os
import subprocess
import sys
from codecs import BOM_UTF8
from pathlib import Path

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from ingest_tables import SECOND, table

import ingest.readers
from ingest import MissingLog, UnreadableLog, read_log
from ingest.container import open_contents
from ingest.errors import UsageError
from ingest.log import Finding
from ingest.looks import looks_like
from ingest.reader import Decoded, Reader


def toy_reader(name: str, magic: bytes, score: float, suffixes: tuple[str, ...] = (), **decoded) -> Reader:
    """A format for these tests: a magic and then whatever."""

    def read(path: Path, data: memoryview, options) -> Decoded:
        if bytes(data[len(magic) : len(magic) + 3]) == b"bad":
            raise ValueError("nothing good in it")
        return Decoded(tables={"A": table([5.0, 6.0], a=[1.0, 2.0])}, messages=2, **decoded)

    return Reader(name, suffixes, lambda head: score if head.startswith(magic) else 0.0, read)


@pytest.fixture
def toys(monkeypatch):
    def install(*readers: Reader) -> None:
        monkeypatch.setattr(ingest.readers, "READERS", readers)

    return install


def written(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


PACKERS = {"gzip": gzip.compress, "xz": lzma.compress, "zstd": zstandard.ZstdCompressor().compress}


@pytest.mark.parametrize("packed", PACKERS)
def test_unpacks_all_members(tmp_path, packed):
    pack = PACKERS[packed]
    contents = open_contents(written(tmp_path, "log", pack(b"first " * 1000) + pack(b"second")))
    assert bytes(contents.data) == b"first " * 1000 + b"second"
    assert contents.packed == packed
    assert not contents.findings


@pytest.mark.parametrize("packed", PACKERS)
def test_unpacks_as_far_as_it_goes(tmp_path, packed):
    data = np.random.default_rng(0).bytes(300_000)
    whole = PACKERS[packed](data)
    contents = open_contents(written(tmp_path, "log", whole[: len(whole) * 2 // 3]))
    assert data.startswith(bytes(contents.data))
    assert len(contents.data) > 50_000
    assert [f.kind for f in contents.findings] == ["truncated"]


def test_damaged_packing_is_a_finding(tmp_path):
    whole = bytearray(gzip.compress(np.random.default_rng(0).bytes(100_000)))
    whole[-6] ^= 0xFF
    contents = open_contents(written(tmp_path, "log", bytes(whole)))
    assert [f.kind for f in contents.findings] == ["damaged"]


def test_large_contents_go_through_a_file(tmp_path, monkeypatch):
    monkeypatch.setattr("ingest.container.IN_MEMORY", 1000)
    contents = open_contents(written(tmp_path, "log.gz", gzip.compress(b"x" * 5000)))
    assert bytes(contents.data) == b"x" * 5000


def test_a_bomb_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr("ingest.container.LARGEST", 1 << 20)
    contents = open_contents(written(tmp_path, "log.gz", gzip.compress(bytes(64 << 20))))
    assert len(contents.data) < 64 << 20
    assert contents.findings[0].kind == "truncated"


def test_plain_is_mapped_and_empty_is_empty(tmp_path):
    assert bytes(open_contents(written(tmp_path, "a", b"abc")).data) == b"abc"
    assert bytes(open_contents(written(tmp_path, "b", b"")).data) == b""


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_text_in_utf_16_is_text(tmp_path, encoding):
    mark = "" if encoding == "utf-16" else "\ufeff"
    contents = open_contents(written(tmp_path, "log", (mark + "1.5 $GPHDT,Ü\r\n").encode(encoding) + b"\0"))
    assert bytes(contents.data).decode() == "1.5 $GPHDT,Ü\r\n"
    assert [f.kind for f in contents.findings] == ["note"]
    raw = b"\xff\xfe" + bytes(range(256))
    assert bytes(open_contents(written(tmp_path, "binary", raw)).data) == raw


def test_a_mark_that_text_is_utf_8_costs_no_record_and_moves_no_offset(tmp_path):
    frames = [b"(0.%d0) can0 09F11201#0%d10270000000000\n" % (k, k) for k in range(1, 6)]
    lines = b"".join([*frames[:2], b"spoilt\n", *frames[2:]])
    plain, marked = (
        read_log(written(tmp_path, f"{len(mark)}.log", mark + lines), format="candump")
        for mark in (b"", BOM_UTF8)
    )
    assert [len(t) for t in marked.tables.values()] == [len(t) for t in plain.tables.values()]
    (there,), (here,) = ([f for f in log.findings if f.offset is not None] for log in (marked, plain))
    assert (there.offset, there.length) == (here.offset + 3, here.length)
    assert marked.bytes_read == plain.bytes_read + 3


def test_index_starts_at_the_first_record(tmp_path, toys):
    toys(toy_reader("toy", b"TOY", 1.0, utc_of_index_zero_ns=1_000 * SECOND))
    log = read_log(written(tmp_path, "x.toy", b"TOY...."))
    assert log.format == "toy"
    assert log.tables["A"].index.tolist() == [0, SECOND]
    assert log.tables["A"].index.name == "t_ns"
    assert log.utc_ns == 1_005 * SECOND
    assert (log.messages, log.bytes_read, log.duration_s) == (2, 7, 1.0)


def test_content_decides_and_the_suffix_breaks_a_tie(tmp_path, toys):
    toys(
        toy_reader("sure", b"T", 0.9),
        toy_reader("one", b"T", 0.8, (".one",)),
        toy_reader("two", b"TT", 0.9, (".two",)),
    )
    assert read_log(written(tmp_path, "x.one", b"TT")).format == "sure"
    assert read_log(written(tmp_path, "x.TWO", b"TT")).format == "two"
    assert read_log(written(tmp_path, "x.two.gz", gzip.compress(b"TT"))).format == "two"
    assert read_log(written(tmp_path, "y", b"TT"), format="one").format == "one"


def test_the_next_reader_is_tried(tmp_path, toys):
    toys(toy_reader("first", b"Tbad", 0.5), toy_reader("second", b"T", 0.9))
    assert read_log(written(tmp_path, "x", b"Tbad")).format == "first"


def test_unreadable_says_what_was_tried(tmp_path, toys):
    toys(toy_reader("toy", b"T", 0.9))
    with pytest.raises(
        UnreadableLog,
        match=r"looks like text whose first line is 'Tbad'; tried toy \(nothing good in it\)\.$",
    ):
        read_log(written(tmp_path, "x", b"Tbad\nmore"))


def test_of_many_formats_that_were_tried_the_number_is_said_and_the_names_on_demand(tmp_path, toys):
    toys(*(toy_reader(name, b"T", 0.0) for name in ("one", "two", "three", "four")))
    with pytest.raises(UnreadableLog, match=r"looks like a PNG image; none of 4 formats fits\.$") as caught:
        read_log(written(tmp_path, "x", b"\x89PNG"))
    assert "tried one, two, three, four" in caught.value.details


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "an empty file"),
        (bytes(5000), "zero"),
        (b"\x89PNG....", "a PNG image"),
        (b"PK\x03\x04....", "zip"),
        (b"\x01\x02\x03\x04", "01 02 03 04"),
        (b"Dear diary\n", "Dear diary"),
    ],
)
def test_looks_like(data, words):
    assert words in looks_like(data, len(data))


def test_empty_file_is_unreadable(tmp_path):
    with pytest.raises(UnreadableLog, match="an empty file"):
        read_log(written(tmp_path, "empty.tlog", b""))


def test_missing_log_names_the_nearest(tmp_path):
    written(tmp_path, "zigzag20.nmea", b"")
    with pytest.raises(MissingLog, match=r"zigzag20\.nmea") as caught:
        read_log(tmp_path / "zigzag02.nmea")
    assert caught.value.exit_status == 2
    with pytest.raises(MissingLog):
        read_log(tmp_path / "no" / "such" / "folder.bin")


def test_a_bag_is_a_folder(tmp_path, toys):
    toys(toy_reader("toy", b"T", 1.0))
    (tmp_path / "bag").mkdir()
    path = written(tmp_path / "bag", "bag_0.db3", b"T")
    assert read_log(tmp_path / "bag").path == path
    written(tmp_path / "bag", "bag_1.db3", b"T")
    with pytest.raises(MissingLog):
        read_log(tmp_path / "bag")


def test_a_folder_and_a_file_that_may_not_be_read_are_said(tmp_path, monkeypatch):
    (tmp_path / "harbour.nmea").write_bytes(b"x")
    with pytest.raises(MissingLog, match=r"expected a log file, found a folder\. Files in it: harbour\.nmea"):
        read_log(tmp_path)

    def forbidden(path: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("ingest.open.open_contents", forbidden)
    with pytest.raises(UnreadableLog, match="Permission denied"):
        read_log(tmp_path / "harbour.nmea")


def test_unknown_format_names_the_nearest(tmp_path):
    with pytest.raises(UsageError, match="dataflash"):
        read_log(written(tmp_path, "x.bin", b"x"), format="dataflsh")


def test_path_like(tmp_path, toys):
    toys(toy_reader("toy", b"T", 1.0))
    path = written(tmp_path, "x", b"T")
    assert read_log(os.fspath(path)).path == path


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=600))
def test_no_sniff_raises(data):
    for reader in ingest.readers.READERS:
        assert 0.0 <= reader.sniff(data) <= 1.0


def test_the_list_of_readers_loads_no_library_of_a_format():
    libraries = {
        "asammdf",
        "can",
        "cantools",
        "h5py",
        "mcap",
        "nmea2000",
        "numba",
        "pymavlink",
        "pyubx2",
        "rosbags",
    }
    code = f"import sys, ingest.readers; print({libraries} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_reader_names_are_unique():
    names = [r.name for r in ingest.readers.READERS]
    assert len(names) == len(set(names))


def test_finding_is_plain_data():
    assert Finding("gap", "x") == Finding("gap", "x")
