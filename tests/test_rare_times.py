"""Times that are in a smaller unit than seconds without saying so: read where it is sure, refused where it is not."""

from pathlib import Path

import numpy as np
import pytest
from test_guessed_units import VESSEL, logged

from ingest import ReadOptions
from ingest.errors import NotIdentifiable
from ingest.log import Log
from ingest.reader import Decoded
from ingest.tabular.delimited import DELIMITED
from preprocess.response import even_grid, linear_response
from preprocess.run_of_log import LoggedRun
from preprocess.trials import make_trials
from preprocess.vessel import Input


def decode(name: str, step: int, start: int = 0, units: str = "") -> Decoded:
    rows = "".join(f"{start + step * k},{k}\n" for k in range(50))
    return DELIMITED.read(Path("x.csv"), memoryview(f"{name},psi_deg\n{units}{rows}".encode()), ReadOptions())


def seconds(decoded: Decoded) -> float:
    """How long a table lasts, s."""
    return float(np.ptp(decoded.tables[""].index)) * 1e-9


@pytest.mark.parametrize("start", [0, 5_000_000, 400_000_000])
def test_whole_microseconds_that_a_flight_stack_counts_are_told_by_their_steps(start):
    decoded = decode("timestamp", 100_000, start)
    assert seconds(decoded) == pytest.approx(4.9)
    assert decoded.utc_of_index_zero_ns is None
    assert decoded.findings[0].message.startswith("'timestamp' states no unit; taken as us since the start")


@pytest.mark.parametrize(
    ("step", "start", "called"),
    [(100, 0, "t_ms"), (4_000, 0, "t_ms or t_us"), (100_000, 0, "t_us"), (100_000, 400_000_000, "t_us")],
)
def test_a_column_that_only_seems_to_be_in_smaller_units_is_to_say_so(step, start, called):
    decoded = decode("t", step, start)
    assert seconds(decoded) == pytest.approx(49.0 * step)
    assert decoded.findings[0].message.endswith(f"their column is to be called so: {called}")


def test_nanoseconds_that_would_be_centuries_are_nanoseconds():
    assert seconds(decode("t", 100_000_000, 10**12)) == pytest.approx(4.9)


def test_dates_and_stated_units_are_left_alone():
    dated = decode("timestamp", 60, 1_757_800_000)
    assert dated.utc_of_index_zero_ns == 0 and not dated.findings
    assert seconds(decode("t", 100, units="ms,deg\n")) == pytest.approx(4.9)


def slowed(run: LoggedRun, times: float) -> LoggedRun:
    """A log whose times were read in a unit that is so many times too large."""
    log = run.log
    tables = {k: t.set_axis((times * t.index).astype("int64"), axis=0) for k, t in log.tables.items()}
    return LoggedRun(run.name, Log(log.path, log.format, tables, log.units, sources=log.sources), "identify")


@pytest.mark.parametrize(("times", "called"), [(1e3, "t_ms"), (1e6, "t_us")])
def test_samples_minutes_apart_are_refused_before_anything_is_made_of_them(tmp_path, times, called):
    run = slowed(logged(tmp_path, "a.csv", lambda t: {"n": np.sin(t)}), times)
    with pytest.raises(NotIdentifiable, match=rf"a\.csv has a position every .*called so: {called}\."):
        make_trials([run], VESSEL, [Input("n", "thruster", "n")], {})


def test_a_response_is_not_fitted_on_a_grid_that_is_coarser_than_its_windows():
    t = even_grid(np.array([0.0, 1.2e8]))
    assert linear_response(t, np.sin(t), [np.cos(t)], ((0.0, 1.2e8),)) is None
