"""Unpacking, recognition, one clock, errors, units, detection rules: what all formats share."""

from __future__ import annotations

import gzip
import lzma
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

import ingest.readers
from ingest import MissingLog, UnreadableLog, read_log
from ingest.clock import continue_clock, duplicates, gaps, mended, timing_findings
from ingest.container import open_contents
from ingest.detect import Rule, detect, quality_mask, stated_sigma
from ingest.errors import UsageError
from ingest.gps_time import gps_to_utc_ns, leap_seconds
from ingest.log import Finding
from ingest.looks import looks_like
from ingest.reader import Decoded, Reader
from ingest.units import UnknownUnit, factor_to_si, is_known

SECOND = 1_000_000_000


def table(t_s, **columns) -> pd.DataFrame:
    return pd.DataFrame(columns, index=pd.Index((np.asarray(t_s) * SECOND).astype(np.int64)))


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


# --- unpacking
# ------------------------------------------------------------------------------------------------


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


# --- read_log
# -------------------------------------------------------------------------------------------------


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
        UnreadableLog, match=r"tried toy \(nothing good in it\).*text whose first line is 'Tbad'"
    ):
        read_log(written(tmp_path, "x", b"Tbad\nmore"))


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


# --- clock
# ----------------------------------------------------------------------------------------------------


def test_restart_is_continued():
    t = np.array([100.0, 100.1, 100.2, *np.arange(20) * 0.1]) * SECOND
    out, findings = continue_clock(t.astype(np.int64))
    assert (np.diff(out) > 0).all()
    assert out[3] - out[2] == 100_000_000
    assert findings[0].kind == "clock"


def test_late_records_are_no_restart():
    t = (np.array([0, 1, 2, 0.5, 3, 4, 5]) * SECOND).astype(np.int64)
    out, findings = continue_clock(t)
    assert (out == t).all()
    assert not findings


@pytest.mark.parametrize("spoilt", [0, 7, 49, 98, 99])
@pytest.mark.parametrize("value", [0, 2**61, 55 * SECOND])
def test_one_broken_stamp_is_mended(spoilt, value):
    t = np.arange(100, dtype=np.int64) * SECOND // 10 + 50_000 * SECOND
    bad = t.copy()
    bad[spoilt] = value
    out, findings = mended(bad, np.zeros(100, dtype=bool), np.arange(100))
    assert np.abs(out - t).max() <= SECOND // 5
    assert findings[0].count >= 1


def test_two_logs_one_after_the_other_are_continued():
    one = np.r_[np.arange(0, 60.0, 1.0), 90.0, 90.01, 150.0] * SECOND
    t = np.r_[one, one, one].astype(np.int64)
    out, findings = mended(t, np.zeros(len(t), bool), np.arange(len(t)))
    assert sum(f.count for f in findings) <= 3
    continued, restarts = continue_clock(out)
    assert len(restarts) == 2 and (np.diff(continued) >= 0).all()
    assert continued[-1] >= 3 * 90 * SECOND


def test_slow_records_are_no_strays():
    t = (np.r_[np.arange(10.0) * 3, np.arange(10.0) * 3] * SECOND).astype(np.int64)
    out, findings = mended(t, np.zeros(len(t), bool), np.arange(len(t)))
    assert not findings and (out == t).all()


def test_a_gap_in_good_time_is_not_mended():
    t = np.concatenate([np.arange(50), np.arange(50) + 10_000]) * SECOND
    out, findings = mended(t.astype(np.int64), np.zeros(100, dtype=bool), np.arange(100))
    assert (out == t).all()
    assert not findings


def test_gaps_and_duplicates():
    t = np.concatenate([np.arange(100), np.arange(110, 200)]) * 0.1
    frame = table(t, a=np.arange(190.0))
    (gap,) = gaps("A", frame)
    assert gap.count == 1
    assert "1.10 s after 9.90 s" in gap.message
    assert not gaps("A", table([0, 1, 5, 30, 31, 90] * 5, a=[0.0] * 30).sort_index())
    double = pd.concat([frame, frame.iloc[[3, 4]]]).sort_index(kind="stable")
    assert duplicates("A", double)[0].count == 2
    assert {f.kind for f in timing_findings({"A": double})} == {"gap", "duplicate"}


def test_leap_seconds_of_the_date():
    assert gps_to_utc_ns(2290, 0) == 1_700_956_782 * SECOND
    assert gps_to_utc_ns(0, 0) == 315_964_800 * SECOND
    for week, leap in {1303: 13, 1357: 14, 1512: 14, 1513: 15, 1930: 17, 1931: 18}.items():
        assert leap_seconds((315_964_800 + week * 604_800) * SECOND) == leap


def test_leap_second_boundary():
    new_year = 1_483_228_800 * SECOND  # 2017-01-01T00:00:00Z
    gps_ns = new_year + 18 * SECOND
    assert leap_seconds(gps_ns) == 18
    assert leap_seconds(gps_ns - 1) == 17


# --- units
# ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "scale"),
    [
        ("deg", np.pi / 180), ("cdeg", np.pi / 18_000), ("degE7", np.pi / 1.8e9), ("rad", 1.0),
        ("mrad/s", 1e-3),
        ("deg/s", np.pi / 180), ("kn", 1852 / 3600), ("km/h", 1 / 3.6), ("m/s/s", 1.0), ("cm/s", 0.01),
        ("m/s^2", 1.0),
        ("rpm", 1 / 60), ("rev/s", 1.0), ("percent", 0.01), ("%", 0.01), ("kN", 1e3), ("Nm", 1.0),
        ("ft", 0.3048),
        ("kg.m²", 1.0), ("us", 1e-6), ("µs", 1e-6), ("ms", 1e-3), ("min", 60.0), ("1/s", 1.0),
        ("hPa", 100.0), ("mm", 1e-3),
        ("rad/s", 1.0), ("deg/min", np.pi / 10_800), ("nmi", 1852.0), ("dm/s", 0.1),
    ],
)  # fmt: skip
def test_factor_to_si(unit, scale):
    assert factor_to_si(unit) == (pytest.approx(scale, rel=1e-12), 0.0)


def test_temperature_has_an_offset():
    scale, offset = factor_to_si("cdegC")
    assert scale * 2_000 + offset == pytest.approx(293.15)


def test_unknown_unit_names_the_nearest():
    with pytest.raises(UnknownUnit, match="knots"):
        factor_to_si("knotz")


@given(st.text(max_size=12))
def test_any_text_is_a_unit_or_not(text):
    if is_known(text):
        scale, offset = factor_to_si(text)
        assert np.isfinite(offset)
        assert scale > 0 or not np.isfinite(scale)


# --- detection
# ------------------------------------------------------------------------------------------------


POSITION = Rule(
    "position", r"GPS(\[\d\])?", {"latitude": "lat", "longitude": "lon"}, "deg",
    options={"quality": "fix", "quality_min": 3, "satellites": "sats", "hdop": "hdop", "hdop_scale": 0.01},
)  # fmt: skip


def gps(n: int = 20, **more) -> pd.DataFrame:
    return table(np.arange(n) * 0.2, **({"lat": np.linspace(63, 63.1, n), "lon": np.full(n, 10.0)} | more))


def test_rule_holds():
    (source,) = detect([POSITION], {"GPS": gps(fix=np.full(20, 4)), "GPSX": gps()})
    assert (source.topic, source.device, source.unit) == ("GPS", None, "deg")
    assert source.options == {"quality": "fix", "quality_min": 3}


def test_placeholders_are_no_source():
    zero = np.zeros(20)
    assert not detect([POSITION], {"GPS": gps(lat=zero, lon=zero)})
    assert not detect([POSITION], {"GPS": gps(lat=np.full(20, np.nan))})
    assert not detect([POSITION], {"GPS": gps(fix=np.ones(20))})
    assert not detect([POSITION], {"GPS": gps(lat=["north"] * 20)})
    wind = Rule("wind", "W", {"speed": "s", "direction": "d"}, "deg")
    assert not detect([wind], {"W": table(np.arange(9), s=np.zeros(9), d=np.zeros(9))})


def test_a_rudder_may_be_amidships():
    rudder = Rule("rudder", "R", {"value": "angle"}, "deg")
    assert detect([rudder], {"R": table(np.arange(9), angle=np.zeros(9))})


def test_one_source_per_device_best_first():
    short, long = gps(5, source=np.full(5, 1)), gps(50, source=np.full(50, 2))
    both = pd.concat([short, long]).sort_index(kind="stable")
    sources = detect([POSITION], {"GPS": both})
    assert [s.device for s in sources] == [2, 1]
    assert "source 2" in sources[0].name


def test_a_direct_measurement_beats_a_filter():
    filtered = Rule("position", "POS", {"latitude": "lat", "longitude": "lon"}, "deg", rank=40)
    sources = detect([filtered, POSITION], {"POS": gps(200), "GPS": gps(20)})
    assert [s.topic for s in sources] == ["GPS", "POS"]


def test_the_more_precise_of_two_receivers_is_chosen():
    rule = replace(POSITION, options={**POSITION.options, "fixes": {3: 2.5, 4: 0.02}})
    plain, fixed = (
        gps(fix=np.full(20, 3), hdop=np.full(20, 90)),
        gps(fix=np.full(20, 4), hdop=np.full(20, 90)),
    )
    sources = detect([rule], {"GPS": plain, "GPS[1]": fixed})
    assert [s.topic for s in sources] == ["GPS[1]", "GPS"]
    assert sources[0].rank - sources[1].rank == pytest.approx(4.0, abs=0.3)


def test_a_stated_accuracy_orders_receivers_and_is_a_sigma():
    rule = replace(POSITION, options={"accuracy": "var", "accuracy_power": 0.5, "accuracy_scale": 10.0})
    good, poor = gps(var=np.full(20, 1e-6)), gps(var=np.r_[0.0, -1.0, np.nan, np.full(17, 4.0)])
    first, second = detect([rule], {"GPS": poor, "GPS[1]": good})
    assert (first.topic, second.topic) == ("GPS[1]", "GPS")
    sigma = stated_sigma(second.options, poor)
    assert np.isnan(sigma[:3]).all() and sigma[3:].tolist() == [20.0] * 17
    assert stated_sigma(detect([rule], {"GPS": gps()})[0].options, gps()) is None
    assert "accuracy_power" not in detect([rule], {"GPS": gps(var=np.zeros(20))})[0].options


def test_precision_never_lifts_a_filter_above_a_measurement():
    filtered = Rule(
        "position", "POS", {"latitude": "lat", "longitude": "lon"}, "deg", 40, {"accuracy": "acc"}
    )
    rule = replace(POSITION, options={"accuracy": "acc"})
    tables = {"POS": gps(acc=np.full(20, 1e-6)), "GPS": gps(acc=np.full(20, 1e3))}
    assert [s.topic for s in detect([filtered, rule], tables)] == ["GPS", "POS"]


def test_what_the_receiver_calls_bad_is_masked():
    rows = gps(6, fix=[4, 4, 4, 4, 1, 4], sats=[9, 2, 0, 9, 9, 9], hdop=[90, 90, 90, 9999, 90, np.nan])
    assert quality_mask(POSITION.options, rows).tolist() == [True, False, True, False, False, True]


# --- all readers
# ----------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=600))
def test_no_sniff_raises(data):
    for reader in ingest.readers.READERS:
        assert 0.0 <= reader.sniff(data) <= 1.0


def test_reader_names_are_unique():
    names = [r.name for r in ingest.readers.READERS]
    assert len(names) == len(set(names))


def test_finding_is_plain_data():
    assert Finding("gap", "x") == Finding("gap", "x")
