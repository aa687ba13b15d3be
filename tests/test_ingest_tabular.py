"""Delimited text and MATLAB files: dialects, clocks, units, damage."""

import contextlib
import functools
import io
import struct
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from ingest import ReadOptions, read_log
from ingest.reader import Decoded
from ingest.tabular.delimited import DELIMITED
from ingest.tabular.lines import spans_of
from ingest.tabular.matlab import MATLAB
from ingest.tabular.naming import sources_of, split_unit
from ingest.tabular.timeline import clock_of

DATA = Path(__file__).parents[2] / "shared" / "data"


def decode(text: str | bytes, **dialect: object) -> Decoded:
    raw = text.encode() if isinstance(text, str) else text
    return DELIMITED.read(Path("x.csv"), memoryview(raw), ReadOptions(dialect=dialect))


def rows(n: int, form: str = "{t:.2f},{a:.4f},{b:.4f}\n", start: float = 0.0, step: float = 0.1) -> str:
    return "".join(form.format(t=start + step * i, a=0.5 * i, b=-0.25 * i) for i in range(n))


def source(decoded: Decoded, quantity: str):
    return next(s for s in decoded.sources if s.quantity == quantity)


def test_header_units_and_quantities():
    text = "t,lat,lon,heading_deg,r_deg_s,sog_kn,cog_deg,rudder_deg,rpm\n"
    text += "".join(
        f"{i / 10},{60 + i * 1e-6},{10 + i * 1e-6},{i % 360},1.5,3.0,90,{i},600\n" for i in range(1, 50)
    )
    decoded = decode(text)
    assert len(decoded.tables[""]) == 49
    assert source(decoded, "position").fields == {"latitude": "lat", "longitude": "lon"}
    assert (source(decoded, "heading").unit, source(decoded, "yaw_rate").unit) == ("deg", "deg/s")
    assert source(decoded, "velocity").options["speed_unit"] == "kn"
    assert source(decoded, "rudder").fields["value"] == "rudder_deg"
    assert source(decoded, "propeller").unit == "rpm"
    assert decoded.units["", "r_deg_s"] == "deg/s"


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|", " ", "   "])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_delimiters_and_line_ends(delimiter, end):
    text = ("t,north,east\n" + rows(30)).replace(",", delimiter).replace("\n", end)
    table = decode(text).tables[""]
    assert list(table.columns) == ["t", "north", "east"]
    np.testing.assert_allclose(table["east"], -0.25 * np.arange(30))
    np.testing.assert_array_equal(table.index, np.arange(30) * 100_000_000)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(encoding):
    table = decode(("t;Kurs (°);Drehrate [°/s]\n" + rows(20, "{t:.2f};{a:.4f};{b:.4f}\n")).encode(encoding))
    assert table.units["", "Kurs (°)"] == "deg"
    assert len(table.tables[""]) == 20


def test_decimal_comma_and_a_row_of_units():
    text = "Zeit;Heading;Rate\ns;deg;deg/s\n" + rows(20, "{t:.2f};{a:.4f};{b:.4f}\n").replace(".", ",")
    decoded = decode(text)
    np.testing.assert_allclose(decoded.tables[""]["Heading"], 0.5 * np.arange(20))
    assert source(decoded, "heading").unit == "deg"


def test_fortran_exponents_and_comment_header():
    decoded = decode("% measured\n% t x y\n" + "".join(f"{i}.0 {i}.5D+01 -.5D-01\n" for i in range(9)))
    np.testing.assert_allclose(decoded.tables[""]["x"], 10 * (np.arange(9) + 0.5))
    np.testing.assert_allclose(decoded.tables[""]["y"], -0.05)


def test_empty_cells_for_sensors_at_different_rates():
    text = "t,x,heading_deg\n" + "".join(f"{i / 10},{i if i % 5 == 0 else ''},{i}\n" for i in range(50))
    table = decode(text).tables[""]
    assert table["x"].notna().sum() == 10
    assert table["heading_deg"].notna().all()


@pytest.mark.parametrize(
    ("stamp", "utc_ns"),
    [
        ("2024-06-01T12:00:{:06.3f}Z", 1_717_243_200_000_000_000),
        ("2024-06-01 14:00:{:06.3f}+02:00", 1_717_243_200_000_000_000),
        ("01.06.2024 12:00:{:06.3f}", 1_717_243_200_000_000_000),
        ("17172432{:06.3f}", 1_717_243_200_000_000_000),
        ("17172432{:06.3f}000", 1_717_243_200_000_000_000),
    ],
)
def test_stamps(stamp, utc_ns):
    texts = [stamp.format(i / 10) for i in range(20)]
    if stamp.endswith("000"):
        texts = [t.replace(".", "")[:-3] for t in texts]
    decoded = decode("time,x,y\n" + "".join(f"{t},{i},{i}\n" for i, t in enumerate(texts)))
    assert decoded.utc_of_index_zero_ns == 0
    np.testing.assert_allclose(
        decoded.tables[""].index, utc_ns + np.arange(20) * 100_000_000, atol=300, rtol=0
    )


def test_time_of_day_goes_on_over_midnight():
    times = [
        f"{(86390 + i) // 3600 % 24:02d}:{(86390 + i) // 60 % 60:02d}:{(86390 + i) % 60:02d}.5"
        for i in range(20)
    ]
    table = decode("time,x,y\n" + "".join(f"{t},1,2\n" for t in times)).tables[""]
    np.testing.assert_array_equal(np.diff(table.index), 1_000_000_000)


def test_a_restarted_clock_is_carried_on_and_said():
    decoded = decode("t,x,y\n" + rows(50, start=100.0) + rows(50))
    assert (np.diff(decoded.tables[""].index) > 0).all()
    assert [f.kind for f in decoded.findings].count("clock") == 1


def test_bad_lines_are_findings_with_their_offset():
    lines = ("t,north,east\n" + rows(100)).splitlines(keepends=True)
    lines[40] = "4.0,1.0\n"
    lines[60] = "\x00\x01garbage\n"
    lines[70] = "7.0,oops,2.0\n"
    text = "".join(lines)
    decoded = decode(text)
    damaged = [f for f in decoded.findings if f.kind == "damaged" and f.offset is not None]
    assert [f.offset for f in damaged] == [text.index("4.0,1.0\n"), text.index("\x00")]
    assert len(decoded.tables[""]) == 98
    assert any("oops" not in f.message and "'north'" in f.message for f in decoded.findings)
    assert decoded.bytes_damaged == len("4.0,1.0\n") + len("\x00\x01garbage\n")


def test_pieces_of_a_text_make_the_same_table(monkeypatch):
    text = "t,a,b,mode\n" + "".join(
        f"{i / 10},{'' if i % 7 == 3 else i},{i * 0.5 if i > 40 else i},{'AUTO' if i % 3 else 'x'}\n"
        for i in range(300)
    )
    text = text.replace("12.0,", "12.0;")
    whole = decode(text)
    monkeypatch.setattr("ingest.tabular.delimited.spans_of", functools.partial(spans_of, size=128))
    pieces = decode(text)
    pd.testing.assert_frame_equal(whole.tables[""], pieces.tables[""], check_dtype=False)
    assert whole.findings == pieces.findings and whole.bytes_damaged == pieces.bytes_damaged > 0


def test_a_last_line_that_is_cut_off():
    decoded = decode("t,x,y\n" + rows(20) + "2.0,1")
    assert [f.kind for f in decoded.findings if f.offset] == ["truncated"]
    assert len(decoded.tables[""]) == 20


def test_given_columns_and_skip():
    decoded = decode(
        "junk 1 2 3\nmore\n" + rows(20, "{t:.2f} {a:.4f} {b:.4f}\n"), columns="t x psi_deg", skip=2
    )
    assert list(decoded.tables[""].columns) == ["t", "x", "psi_deg"]
    with pytest.raises(ValueError, match="names 5 columns, the rows have 3"):
        decode(rows(20), columns="a b c d e")


def test_no_clock_is_said():
    with pytest.raises(ValueError, match="no column looks like time"):
        decode("a,b\n" + "5,1\n3,1\n4,2\n" * 5)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Heading [deg]", ("heading", "deg")),
        ("r_deg_s", ("r", "deg/s")),
        ("windSpeed_kn", ("wind_speed", "kn")),
        ("pos_n", ("pos_n", "")),
        ("n (rpm)", ("n", "rpm")),
        ("time_boot_ms", ("time_boot", "ms")),
        ("vn_ms", ("vn", "m/s")),
        ("sog_ms", ("sog", "m/s")),
        ("surge_speed_ms", ("surge_speed", "m/s")),
        ("true_wind_speed_ms", ("true_wind_speed", "m/s")),
    ],
)
def test_units_in_names(name, expected):
    assert split_unit(name) == expected


@given(st.binary(max_size=400))
@settings(max_examples=150, deadline=None)
def test_junk_never_raises_anything_else(raw):
    assert 0.0 <= DELIMITED.sniff(raw) <= 1.0
    with contextlib.suppress(ValueError):
        decode(raw)


@given(st.integers(0, 1500), st.binary(min_size=1, max_size=20))
@settings(max_examples=100, deadline=None)
def test_lines_without_damage_survive(at, junk):
    raw = ("t,north,east\n" + rows(80)).encode()
    at = min(max(at, 200), len(raw) - 1)
    table = decode(raw[:at] + junk + raw[at:]).tables[""]
    first = raw.count(b"\n", 0, at) - 1
    touched = 1 + junk.count(b"\n") + junk.count(b"\r")
    assert len(table) >= 80 - touched
    np.testing.assert_allclose(table["north"].iloc[:first], 0.5 * np.arange(first))


def test_a_quote_that_nothing_closes_costs_its_own_line_alone():
    raw = ("t,north,east\n" + rows(80)).encode()
    for at in range(200, 300):
        found = decode(raw[:at] + b'"' + raw[at:])
        assert len(found.tables[""]) >= 79
        assert sum(f.count for f in found.findings if f.kind == "damaged") == 80 - len(found.tables[""])


@pytest.mark.real
def test_measured_model_tests():
    import tomllib

    folder = DATA / "kvlcc2-hsva"
    if not folder.is_dir():
        pytest.skip("the measured data are not beside the project")
    campaign = tomllib.loads((folder / "campaign.toml").read_text())
    for entry in campaign["log"]:
        log = read_log(folder / entry["path"], dialect=entry["dialect"])
        table = log.tables[""]
        assert log.format == "csv"
        np.testing.assert_allclose(np.diff(table.index) * 1e-9, 0.05, atol=1e-6)
        assert not [f for f in log.findings if f.kind in {"damaged", "truncated"}]
        assert {s.quantity for s in log.sources} >= {"position", "heading", "yaw_rate", "velocity", "rudder"}


def test_an_xsens_export():
    head = "// General information:\n//  MT Manager version: 2022.0\n"
    names = "PacketCounter\tSampleTimeFine\tUTC_Nano\tUTC_Year\tUTC_Month\tUTC_Day\tUTC_Hour"
    text = head + names + "\tUTC_Minute\tUTC_Second\tGyr_Z\tRoll\tPitch\tYaw\n"
    start = 2**32 - 1000
    for i in range(60):
        ticks, nano = (start + 100 * i) % 2**32, i * 10_000_000
        text += f"{i}\t{ticks}\t{nano}\t2024\t6\t1\t12\t0\t0\t0.01\t0.5\t0.5\t{-170 + i}\n"
    decoded = decode(text)
    index = decoded.tables[""].index.to_numpy()
    np.testing.assert_array_equal(np.diff(index), 10_000_000)
    assert (index[0], decoded.utc_of_index_zero_ns) == (1_717_243_200_000_000_000, 0)
    assert (source(decoded, "heading").unit, source(decoded, "heading").options["frame"]) == ("deg", "enu")
    assert source(decoded, "yaw_rate").unit == "rad/s"


def vectors(n: int = 40) -> dict[str, np.ndarray]:
    t = 0.1 * np.arange(n)
    return {
        "t": t,
        "psi": np.linspace(0, 9, n),
        "north": 2.0 * t,
        "east": -t,
        "delta_deg": 5 * np.sin(t),
        "k": np.ones(3),
    }


@pytest.mark.parametrize("compressed", [True, False])
def test_matlab_5(tmp_path, compressed):
    gps = {
        "time": 1_717_200_000 + np.arange(9.0),
        "lat": 60 + np.arange(9) * 1e-6,
        "lon": 10 + np.arange(9) * 1e-6,
    }
    path = tmp_path / "run.mat"
    savemat(
        path, {**vectors(), "gps": gps, "acc": np.ones((40, 3)), "note": "text"}, do_compression=compressed
    )
    log = read_log(path)
    assert log.format == "matlab"
    assert len(log.tables[""]) == 40
    assert {"acc[2]", "psi", "delta_deg"} <= set(log.tables[""].columns)
    np.testing.assert_allclose(log.tables["gps"]["lat"], gps["lat"])
    assert {s.quantity for s in log.sources} >= {"position", "heading", "rudder"}
    assert any("k" in f.message for f in log.findings if f.kind == "note")


def test_matlab_73(tmp_path):
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in vectors().items():
            file[name] = values.reshape(1, -1)
        file["sub/time"], file["sub/heading_deg"] = np.arange(5.0), np.arange(5.0)
    raw = bytearray(path.read_bytes())
    raw[:20] = b"MATLAB 7.3 MAT-file "
    path.write_bytes(raw)
    log = read_log(path)
    np.testing.assert_allclose(log.tables[""]["psi"], vectors()["psi"])
    assert log.tables["sub"]["heading_deg"].tolist() == [0, 1, 2, 3, 4]


def test_matlab_day_numbers(tmp_path):
    path = tmp_path / "run.mat"
    savemat(path, {"time": 719_529 + 19_875.5 + np.arange(20) / 86_400, "psi": np.linspace(0, 1, 20)})
    log = read_log(path)
    assert log.utc_ns == pytest.approx(1_717_243_200_000_000_000, abs=1e6)
    np.testing.assert_allclose(np.diff(log.tables[""].index), 1e9, atol=1e5)


@pytest.mark.parametrize("keep", [0.45, 0.7, 0.9])
def test_matlab_cut_or_broken(tmp_path, keep):
    path = tmp_path / "run.mat"
    savemat(path, vectors(400), do_compression=False)
    raw = path.read_bytes()
    log = read_log(_written(tmp_path / "cut.mat", raw[: int(len(raw) * keep)]), format="matlab")
    assert "truncated" in {f.kind for f in log.findings}
    assert {"t", "psi"} & set(log.tables[""].columns)


def _written(path: Path, raw: bytes) -> Path:
    path.write_bytes(raw)
    return path


@pytest.mark.parametrize("kind", [0, 8, 14, 15, 49, 255])
def test_matlab_numbers_of_a_type_that_is_none_cost_their_variable_alone(tmp_path, kind):
    with io.BytesIO() as file:
        savemat(file, vectors(), do_compression=False)
        raw = bytearray(file.getvalue())
    first = raw.index(b"\x09\x00\x00\x00", 128)
    second = raw.index(b"\x09\x00\x00\x00", first + 400)
    raw[second] = kind  # the type of a variable's numbers: scipy reads beyond memory
    log = read_log(_written(tmp_path / "run.mat", bytes(raw)), format="matlab")
    assert [f.kind for f in log.findings].count("damaged") == 1
    assert len(log.tables[""].columns) >= 1


def test_a_matlab_function_handle_costs_nothing(tmp_path):
    """Its part is a matrix itself (class 16), as those of the opaque texts and times of newer versions are (17)."""
    with (tmp_path / "plain.mat").open("wb") as file:
        savemat(file, vectors(), do_compression=False)
    raw = (tmp_path / "plain.mat").read_bytes()
    size = 8 + struct.unpack_from("<I", raw, 132)[0]
    flags, extent, name = (
        struct.pack("<4I", 6, 8, 16, 0),
        struct.pack("<4I", 5, 8, 1, 1),
        b"\x01\0\x01\0f\0\0\0",
    )
    inside = flags + extent + name + raw[128 : 128 + size]
    path = _written(tmp_path / "run.mat", raw + struct.pack("<2I", 14, len(inside)) + inside)
    plain, log = read_log(tmp_path / "plain.mat"), read_log(path)
    assert log.findings == plain.findings
    assert set(plain.tables[""].columns) <= set(log.tables[""].columns)


@given(st.integers(0, 3000), st.binary(min_size=1, max_size=8))
@example(397, b"\x00\xf0\x7f")  # an infinite time
@settings(max_examples=80, deadline=None)
def test_matlab_damage_raises_nothing_but_value_error(at, junk):
    with io.BytesIO() as file:
        savemat(file, vectors(), do_compression=False)
        raw = bytearray(file.getvalue())
    at = min(at, len(raw) - 1)
    raw[at : at + len(junk)] = junk
    with contextlib.suppress(ValueError):
        MATLAB.read(Path("x.mat"), memoryview(bytes(raw)), ReadOptions())
    assert 0.0 <= MATLAB.sniff(junk) <= 1.0


def test_sides_and_rates_are_offered_where_a_unit_is_stated():
    table = pd.DataFrame({k: np.linspace(0.0, 1.0, 20) for k in ("rate_deg_s", "left_rpm", "port", "rate")})
    found = sources_of(table, {})
    assert {(s.quantity, s.fields["value"]) for s in found} == {
        ("yaw_rate", "rate_deg_s"),
        ("propeller", "left_rpm"),
    }


@pytest.mark.parametrize(
    ("names", "layout"),
    [
        (("Datum",), "%Y-%m-%dT%H:%M:%S.%f"),
        (("Datum Uhrzeit",), "%Y-%m-%d %H:%M:%S.%f"),
        (("Fecha", "Hora"), "%d.%m.%Y %H:%M:%S.%f"),
    ],
)
def test_a_date_with_the_time_of_day_is_a_clock_whatever_its_name_and_a_date_alone_is_none(names, layout):
    stamps = pd.date_range("2026-05-01T08:00:00", periods=20, freq="100ms").strftime(layout)
    parts = zip(*(s.split(" ", len(names) - 1) for s in stamps), strict=True)
    clock = clock_of(pd.DataFrame({"Kurs": np.zeros(20)} | dict(zip(names, map(list, parts), strict=True))))
    assert clock is not None
    assert clock.utc
    assert np.all(np.diff(clock.ns) == 100_000_000)
    assert clock_of(pd.DataFrame({"Kurs": np.zeros(20), "Datum": ["2026-05-01"] * 20})) is None


def test_a_gyro_is_offered_where_it_states_a_rate():
    table = pd.DataFrame({k: np.linspace(0.0, 1.0, 20) for k in ("gyro_deg_s", "gyro")})
    assert [(s.quantity, s.fields["value"]) for s in sources_of(table, {})] == [("yaw_rate", "gyro_deg_s")]
