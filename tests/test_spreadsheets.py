"""Tables as spreadsheets write them: quotes, thousands, dates in days, a header alone."""

from pathlib import Path

import numpy as np
import pytest

from ingest import ReadOptions, read_log
from ingest.errors import UnreadableLog
from ingest.reader import Decoded
from ingest.tabular.delimited import DELIMITED
from ingest.tabular.sexagesimal import is_written
from ingest.units import factor_to_si


def decode(text: str | bytes) -> Decoded:
    raw = text.encode() if isinstance(text, str) else text
    return DELIMITED.read(Path("x.csv"), memoryview(raw), ReadOptions())


def test_quoted_fields_may_hold_the_delimiter():
    form = '{t:.2f},"{a:.4f}",{b:.4f},"turn, now"\n'
    decoded = decode(
        't,"heading, true [deg]","pos ""n""",note\n'
        + "".join(form.format(t=0.1 * i, a=0.5 * i, b=1.0 * i) for i in range(20))
    )
    table = decoded.tables[""]
    assert list(table.columns) == ["t", "heading, true [deg]", 'pos "n"', "note"]
    assert len(table) == 20 and not decoded.findings
    np.testing.assert_allclose(table["heading, true [deg]"], 0.5 * np.arange(20))
    assert [(s.quantity, s.unit) for s in decoded.sources] == [("heading", "deg")]


@pytest.mark.parametrize("every", [1, 7])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_quoted_fields_may_go_over_the_end_of_a_line(every, end):
    notes = ['"two' + end + 'lines, ""here"""' if i % every == 0 else "ok" for i in range(60)]
    text = "t,note,x" + end + "".join(f"{i}.5,{note},{2 * i}{end}" for i, note in enumerate(notes))
    decoded = decode(text)
    np.testing.assert_array_equal(decoded.tables[""]["x"], 2 * np.arange(60))
    assert not decoded.findings and DELIMITED.sniff(text.encode()) > 0.3
    assert decoded.tables[""]["note"].iloc[0].split() == ["two", "lines,", '"here"']


@pytest.mark.parametrize("delimiter", [",", ";"])
@pytest.mark.parametrize(
    ("field", "value"),
    [('"1,404.5"', 1404.5), ('"1,234,404.5"', 1_234_404.5), ('"1.404,5"', 1404.5), ('"-14,25"', -14.25)],
)
def test_quoted_decimal_commas_and_thousands(field, value, delimiter):
    english = field.rfind(".") > field.rfind(",")
    lines = [("t", "x", "rpm"), *((f"{i}.5", f"{i}.0", field) for i in range(20))]
    if not english:
        lines = [
            lines[0],
            *((f'"{a}"'.replace(".", ","), f'"{b}"'.replace(".", ","), c) for a, b, c in lines[1:]),
        ]
    decoded = decode("".join(delimiter.join(line) + "\n" for line in lines))
    np.testing.assert_array_equal(decoded.tables[""]["rpm"], np.full(20, value))
    np.testing.assert_array_equal(decoded.tables[""]["x"], np.arange(20))
    assert not decoded.bytes_damaged


def test_whole_thousands_between_commas_are_no_decimals():
    decoded = decode("t,x,rpm\n" + "".join(f'{i},{2 * i},"1,{400 + i}"\n' for i in range(20)))
    np.testing.assert_array_equal(decoded.tables[""]["rpm"], 1400 + np.arange(20))


@pytest.mark.parametrize("step", [0.01, 0.1, 1.0, 10.0])
def test_a_date_as_a_number_counts_days(step):
    days = 46_156.5 + step * np.arange(200) / 86_400.0
    decoded = decode("time,x,y\n" + "".join(f"{d:.10f},{i},{i}\n" for i, d in enumerate(days)))
    assert decoded.utc_of_index_zero_ns == 0
    index = decoded.tables[""].index.to_numpy()
    assert index[0] == 1_778_760_000 * 10**9  # 2026-05-14, noon
    np.testing.assert_allclose(np.diff(index), step * 1e9, atol=1e5)
    assert any("days since 1899-12-30" in f.message for f in decoded.findings)


@pytest.mark.parametrize("step", [0.001, 0.1, 1.0])
def test_the_time_of_day_in_seconds_is_no_date(step):
    decoded = decode("time,x,y\n" + "".join(f"{46_156.0 + step * i:.3f},{i},{i}\n" for i in range(200)))
    np.testing.assert_allclose(np.diff(decoded.tables[""].index), step * 1e9)
    assert decoded.utc_of_index_zero_ns is None


@pytest.mark.parametrize("end", ["\n", "", "\r\n\r\n"])
@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("", r"csv \(a header \(time, lat, lon\) and no row below it\)"),
        ("\n0.0,52.1,4.2", "a table of one row"),
    ],
)
def test_a_table_without_rows_is_said_to_be_one(tmp_path, rows, said, end):
    path = tmp_path / "run.csv"
    path.write_text("time,lat,lon" + rows + end, newline="")
    with pytest.raises(UnreadableLog, match=said) as raised:
        read_log(path)
    assert raised.value.tried[0].startswith("csv") and len(raised.value.tried) == 1


def test_two_rows_are_a_log(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("time,lat,lon\n0.0,52.1,4.2\n1.0,52.2,4.2\n")
    assert len(read_log(path).tables[""]) == 2


def placed(names: str, row: str) -> Decoded:
    """A table of positions: ``#`` in a row stands for two more digits."""
    return decode(names + "\n" + "".join(f"{i}," + row.replace("#", f"{i:02d}") + "\n" for i in range(40)))


def degrees(decoded: Decoded) -> np.ndarray:
    table, position = decoded.tables[""], next(s for s in decoded.sources if s.quantity == "position")
    factor, _ = factor_to_si(position.unit)
    return np.degrees(factor * table[list(position.fields.values())].to_numpy(float))


def test_whole_numbers_of_tiny_degrees_are_positions():
    decoded = placed("time,lat,lon", "5200001#,-44000#")
    assert [s.unit for s in decoded.sources] == ["degE7"]
    assert decoded.units["", "lat"] == "degE7" and "1e-7 degrees" in decoded.findings[0].message
    expected = [[52.00001 + 1e-7 * i, -0.44 - 1e-7 * i] for i in range(40)]
    np.testing.assert_allclose(degrees(decoded), expected, rtol=0, atol=1e-12)


def test_degrees_and_minutes_are_positions():
    decoded = placed("time,lat,N/S,lon,E/W", "5230.0#,S,00424.6#,W")
    expected = [[-52.5 - i / 60_000, -4.41 - i / 60_000] for i in range(40)]
    np.testing.assert_allclose(degrees(decoded), expected, rtol=0, atol=1e-12)
    assert sum("degrees and minutes" in f.message for f in decoded.findings) == 1
    plain = degrees(placed("time,lat,lon", "5230.0#,-00424.6#"))
    np.testing.assert_allclose(plain, np.abs(expected) * [1.0, -1.0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("south", ["52.1#", "-52.1#"])
def test_degrees_have_the_sign_of_their_hemisphere(south):
    found = degrees(placed("time,lat,ns,lon", f"{south},S,4.2#"))
    np.testing.assert_allclose(found, [[-52.1 - 1e-3 * i, 4.2 + 1e-3 * i] for i in range(40)])
    assert not placed("time,lat,lon", "52.1#,4.2#").findings


@pytest.mark.parametrize("place", [0, 1, 20])
def test_a_row_that_lost_fields_is_told_wherever_it_is(place):
    rows = [f"{0.1 * i:.1f},{52.0 + 1e-5 * i:.5f},4.5,{i}" for i in range(40)]
    rows[place] = rows[place].rsplit(",", 2)[0]
    decoded = decode("time,lat,lon,heading\n" + "\n".join(rows) + "\n")
    assert len(decoded.tables[""]) == 39
    (damage,) = (f for f in decoded.findings if f.kind == "damaged")
    assert damage.offset == len("time,lat,lon,heading\n" + "".join(f"{r}\n" for r in rows[:place]))
    assert decoded.bytes_damaged == damage.length == len(rows[place]) + 1


@pytest.mark.parametrize(
    ("latitude", "longitude"),
    [
        ("52°30.0#'S", "4°24.6#'W"),
        ("S 52 30.0#", "W004 24.6#"),
        ("-52.5000°", "4.41000 W"),
        ('"52°30\'0.0#""S"', '"4°24\'36.0#""W"'),
    ],
)
def test_degrees_as_chart_plotters_write_them_are_positions(latitude, longitude):
    decoded = placed("time,lat,lon", f"{latitude},{longitude}")
    per = 0.0 if "#" not in latitude else 3.6e6 if '"' in latitude else 6e4
    moved = np.arange(40) / per if per else np.zeros(40)
    expected = np.column_stack([-52.5 - moved, -4.41 - moved])
    np.testing.assert_allclose(degrees(decoded), expected, rtol=0, atol=1e-12)
    assert sum("are text, read as degrees" in f.message for f in decoded.findings) == 1


def test_a_latitude_that_is_spoilt_costs_no_other():
    rows = [f"{i},52°30.{i:02d}'N,4°24.{i:02d}'E" for i in range(40)]
    rows[3] = "3,52°x0.03'N,4°24.03'E"
    decoded = decode("time,lat,lon\n" + "\n".join(rows) + "\n")
    assert list(np.flatnonzero(np.isnan(degrees(decoded)[:, 0]))) == [3]
    assert sum("; 1 of them cannot be" in f.message for f in decoded.findings) == 1


@pytest.mark.parametrize("text", ["12:30:05", "52.5", "5230.125", "N", "1.5s", "NE 52.5", "52 30 07 08 N"])
def test_what_has_no_hemisphere_or_is_more_than_degrees_is_no_position_in_text(text):
    assert not is_written(text)


def test_what_is_no_latitude_is_no_position():
    decoded = placed("time,lat,lon", "5776001.7#,512000.1#")
    assert not decoded.sources
    assert "'lat' goes from 5.776e+06 to 5.776e+06" in decoded.findings[0].message
