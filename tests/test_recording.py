"""The Rerun recording, read back with the library's own reader."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.results_example import CURRENT, example_results
from validate.recording import entities, write_recording
from validate.recording.glyphs import drawable
from validate.recording.ranges import ranges_of
from validate.recording.recording import recording_id
from validate.recording.stream import most_rows, strips
from validate.recording.tracks import geographic, on_plan

NAME = "zigzag0.nmea"


@pytest.fixture(scope="module")
def results():
    return example_results(logs=2, duration=20.0)


@pytest.fixture(scope="module")
def file(results, tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "recording.rrd"
    write_recording(results, path)
    return path


@pytest.fixture(scope="module")
def chunks(file):
    return read(file)


@pytest.fixture
def rerun(tmp_path):
    """The command that comes with the library, with its analytics off and a home of its own."""
    found = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if found is None:
        pytest.skip("the rerun command is not installed beside Python")
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}

    def call(*words):
        done = subprocess.run(
            [found, *map(str, words)], capture_output=True, text=True, timeout=60, env=environment
        )
        return done.returncode

    assert call("analytics", "disable") == 0
    return call


def read(path):
    """Entity path without its slash to its chunks."""
    from rerun.chunk import RrdReader

    out = {}
    for chunk in RrdReader(path).stream().to_chunks():
        out.setdefault(str(chunk.entity_path).lstrip("/"), []).append(chunk)
    return out


def moving(chunks, path):
    """The chunks of an entity that lie on time lines."""
    return [c for c in chunks[path] if not c.is_static]


def column(chunks, path, component):
    """All values of a component along the time line, flattened."""
    parts = [c.to_record_batch() for c in moving(chunks, path)]
    arrays = [
        np.array(batch.column(name).flatten().to_numpy(zero_copy_only=False))
        for batch in parts
        for name in batch.schema.names
        if name.endswith(component)
    ]
    return np.concatenate(arrays)


def test_every_log_has_its_views(chunks):
    for path in (
        entities.plan(NAME, "raw"),
        entities.plan(NAME, "outliers"),
        entities.plan(NAME, "smoothed"),
        entities.plan(NAME, "before"),
        entities.plan(NAME, "after"),
        entities.plan(NAME, "hull_smoothed"),
        entities.plan(NAME, "current"),
        entities.chart(NAME, "smoothed"),
        entities.signal(NAME, "x", "outliers"),
        entities.signal(NAME, "r", "cleaned"),
        entities.signal(NAME, "u", "band/high"),
        entities.prediction(NAME, "v", "before"),
        entities.residual(NAME, "r", "noise/low"),
        entities.actuator(NAME, "rudder", "commanded"),
        entities.actuator(NAME, "rudder", "actuator"),
        f"{entities.EVENTS}/{NAME}",
        entities.REPORT,
        entities.VERDICT,
        f"{entities.DIAGNOSIS}/round_1/candidates",
    ):
        assert path in chunks, path


def test_the_timelines_are_elapsed_and_utc(chunks):
    chunk = moving(chunks, entities.prediction(NAME, "u", "after"))[0]
    assert set(chunk.timeline_names) == {"elapsed", "utc"}


def test_without_utc_and_origin_there_is_only_elapsed_and_no_map(tmp_path):
    write_recording(example_results(logs=1, duration=5.0, utc=False, origin=None), tmp_path / "x.rrd")
    chunks = read(tmp_path / "x.rrd")
    assert moving(chunks, entities.prediction(NAME, "u", "after"))[0].timeline_names == ["elapsed"]
    assert not any("/map/" in path for path in chunks)


@pytest.mark.parametrize("channel", ["u", "v", "r", "psi"])
def test_values_and_rows_are_those_of_the_tables(chunks, results, channel):
    table = results.predictions[f"logs/{NAME}"]
    for part in ("before", "after"):
        found = column(chunks, entities.prediction(NAME, channel, part), "scalars")
        np.testing.assert_array_equal(found, table[f"{channel}_{part}"])
    residual = column(chunks, entities.residual(NAME, channel, "after"), "scalars")
    np.testing.assert_array_equal(residual, table[channel] - table[f"{channel}_after"])


def test_times_are_those_of_the_tables(chunks, results):
    table = results.predictions[f"logs/{NAME}"]
    batch = moving(chunks, entities.prediction(NAME, "u", "after"))[0].to_record_batch()
    elapsed = (
        batch.column("elapsed").to_numpy(zero_copy_only=False).astype("timedelta64[ns]").astype(np.int64)
    )
    np.testing.assert_array_equal(elapsed, np.rint(table["t"] * 1e9).astype(np.int64))
    utc = batch.column("utc").to_numpy(zero_copy_only=False).astype("datetime64[ns]").astype(np.int64)
    np.testing.assert_array_equal(utc, table["utc_ns"])


def test_raw_is_everything_and_cleaned_is_without_the_outliers(chunks, results):
    position = results.trials[0].measurements["position"]
    raw, cleaned, outliers = (
        column(chunks, entities.signal(NAME, "x", part), "scalars") for part in ("raw", "cleaned", "outliers")
    )
    np.testing.assert_array_equal(raw, position.value[:, 0])
    np.testing.assert_array_equal(cleaned, position.value[position.good, 0])
    np.testing.assert_array_equal(outliers, position.value[~position.good, 0])


def test_the_hull_is_to_scale_and_turns_with_the_heading(chunks, results):
    path = entities.plan(NAME, "hull_smoothed")
    table, vessel = results.predictions[f"logs/{NAME}"], results.after.vessel
    outline = chunks[f"{path}/outline"][0].to_record_batch()
    name = next(n for n in outline.schema.names if n.endswith("strips"))
    points = np.array(outline.column(name).to_pylist()[0][0])
    assert np.ptp(points[:, 1]) == pytest.approx(vessel.length)
    assert np.ptp(points[:, 0]) == pytest.approx(vessel.beam)
    translation = np.stack(column(chunks, path, "translation")).reshape(-1, 3)
    quaternion = np.stack(column(chunks, path, "quaternion")).reshape(-1, 4)
    np.testing.assert_allclose(translation[:, 0], table["y"], atol=1e-4)
    np.testing.assert_allclose(translation[:, 1], -table["x"], atol=1e-4)
    turned = 2 * np.arctan2(quaternion[:, 2], quaternion[:, 3])
    np.testing.assert_allclose(np.cos(turned), np.cos(table["psi"]), atol=1e-5)


@pytest.mark.parametrize("part", entities.COLOURS)
def test_colours_stand_out_from_a_dark_and_from_a_light_ground(part):
    def luminance(colour):
        parts = np.array(colour[:3]) / 255
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    own = luminance(entities.COLOURS[part])
    for ground in ((13, 16, 17), (255, 255, 255)):
        light, dark = sorted((own, luminance(ground)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) >= 3.0


def test_north_is_up_and_east_is_right():
    np.testing.assert_array_equal(on_plan(np.array([1.0]), np.array([2.0])), [[2.0, -1.0]])


def test_the_current_points_where_the_water_flows(chunks):
    batch = chunks[entities.plan(NAME, "current")][0].to_record_batch()
    name = next(n for n in batch.schema.names if n.endswith("vectors"))
    right, down = np.array(batch.column(name).to_pylist()[0][0])
    assert np.arctan2(right, -down) == pytest.approx(CURRENT[1], abs=0.05)


def test_the_map_starts_at_the_origin():
    origin = (59.43, 24.75)
    found = geographic(np.array([0.0, 100.0]), np.array([0.0, 0.0]), origin)
    np.testing.assert_allclose(found[0], origin)
    assert found[1, 0] - found[0, 0] == pytest.approx(100 / 111_400, rel=0.01)


def test_a_track_is_cut_where_nothing_was_measured():
    track = np.column_stack([np.arange(6.0), np.arange(6.0)])
    track[2] = np.nan
    assert [len(s) for s in strips(track)] == [2, 3]


def test_candidates_and_verdict_are_in_words(chunks):
    batch = chunks[f"{entities.DIAGNOSIS}/round_1/table"][0].to_record_batch()
    words = str(batch.to_pydict())
    assert words.index("current") < words.index("wind") < words.index("quadratic damping")
    assert "a current of 0.178 m/s" in str(chunks[entities.VERDICT][0].to_record_batch().to_pydict())


def test_without_effects_there_is_no_before(tmp_path):
    write_recording(example_results(logs=1, duration=5.0, loop=False), tmp_path / "x.rrd")
    chunks = read(tmp_path / "x.rrd")
    assert entities.prediction(NAME, "u", "before") not in chunks
    assert entities.prediction(NAME, "u", "after") in chunks


def test_a_log_without_anything_to_draw_is_no_end(results, tmp_path):
    name, states = f"logs/{NAME}", [c for c in results.predictions[f"logs/{NAME}"] if c not in ("t", "role")]
    empty = results.predictions[name].assign(**dict.fromkeys(states, np.nan))
    idle = replace(results.trials[0], states=results.trials[0].states.assign(x=np.nan, y=np.nan), segments=())
    without = replace(
        results, predictions={**results.predictions, name: empty}, trials=(idle, *results.trials[1:])
    )
    write_recording(without, tmp_path / "x.rrd")
    other = next(n for n in results.predictions if n != name).removeprefix("logs/")
    assert entities.prediction(other, "u", "after") in read(tmp_path / "x.rrd")


def with_gaps(results):
    """The same with nothing known of one channel for a while, as across a gap."""
    name = f"logs/{NAME}"
    table, trial = results.predictions[name].copy(), results.trials[0]
    hole = table["t"].between(4.0, 6.0) | (table["t"] < 0.5)
    columns = ["u", "u_before", "u_after", "x", "x_after"]
    table.loc[hole, columns] = np.nan
    states = trial.states.copy()
    states.loc[hole, ["u", "x", "sigma_u"]] = np.nan
    pieces = replace(trial, states=states)
    return replace(
        results, predictions={**results.predictions, name: table}, trials=(pieces, *results.trials[1:])
    )


def test_a_gap_is_a_row_without_a_value(results, tmp_path):
    gappy = with_gaps(results)
    write_recording(gappy, tmp_path / "x.rrd")
    chunks, table = read(tmp_path / "x.rrd"), gappy.predictions[f"logs/{NAME}"]
    path = entities.prediction(NAME, "u", "after")
    found = column(chunks, path, "scalars")
    np.testing.assert_array_equal(found, table["u_after"].dropna())
    first, last = table["u_after"].first_valid_index(), table["u_after"].last_valid_index()
    assert sum(c.num_rows for c in moving(chunks, path)) == last - first + 1 > len(found)


def test_a_plot_shows_the_measurement_whole_and_a_runaway_only_where_it_is_near(results):
    name = f"logs/{NAME}"
    wild = results.predictions[name].assign(u_after=np.geomspace(1.0, 1e9, len(results.predictions[name])))
    shown = ranges_of(wild, results.actuators[name], [results.trials[0]])
    measured = wild["u"].max() - wild["u"].min()
    low, high = shown["prediction/u"]
    assert low < wild["u"].min() < wild["u"].max() < high < wild["u"].max() + measured
    assert shown["residual/v"][0] < 0 < shown["residual/v"][1]
    assert shown.keys() >= {"signals/x", "inputs/rudder", "inputs/n", "prediction/psi"}
    assert all(np.isfinite(r).all() and r[0] < r[1] for r in shown.values())


def test_the_recording_is_sound_and_repeatable(results, rerun, tmp_path):
    results = with_gaps(results)
    file, again, other = (tmp_path / f"{name}.rrd" for name in ("file", "again", "other"))
    later = {"ingest": 99.0, "total": 123.0}
    write_recording(results, file)
    write_recording(replace(results, timing_s=later), again)
    table = results.predictions[f"logs/{NAME}"].assign(u_after=0.0)
    write_recording(replace(results, predictions={**results.predictions, f"logs/{NAME}": table}), other)
    assert rerun("rrd", "verify", file) == 0
    assert rerun("rrd", "compare", "--unordered", file, again) == 0
    assert rerun("rrd", "compare", "--unordered", file, other) != 0


def test_the_identity_depends_on_the_seed_and_not_on_the_time(results):
    assert recording_id(results) == recording_id(replace(results, timing_s={}))
    assert recording_id(results) != recording_id(replace(results, after=replace(results.after, seed=1)))


@pytest.mark.slow
@pytest.mark.parametrize("logs", [1, 30])
def test_an_hour_at_fifty_hertz_is_small(tmp_path, logs):
    results = example_results(logs=logs, duration=3600.0 / logs, rate=50.0)
    write_recording(results, tmp_path / "x.rrd")
    assert (tmp_path / "x.rrd").stat().st_size < 150e6
    chunks, table = read(tmp_path / "x.rrd"), results.predictions[f"logs/{NAME}"]
    for part in ("before", "after"):
        found = column(chunks, entities.prediction(NAME, "v", part), "scalars")
        assert len(found) <= most_rows(logs) + 2
        assert (found.min(), found.max()) == (table[f"v_{part}"].min(), table[f"v_{part}"].max())


@pytest.mark.parametrize(
    ("text", "drawn"),
    [
        ("u̇ = −0.55 |u|u, 3·10⁻⁵ m/s²", "u̇ = −0.55 |u|u, 3·10⁻⁵ m/s²"),
        ("so: `ṙ = 4.91·10⁻⁵ T − 2·10³ e₂`.", "so: `ṙ = 4.91e-5 T − 2e3 e₂`."),
        ("Ægir, Øresund, Нева, Αθηνά, 海", "Ægir, Øresund, Нева, Αθηνά, ?"),
        ("| ψ | 12 °/s → 4 |\n`a⁻`", "| ψ | 12 °/s → 4 |\n`a-`"),
    ],
)
def test_text_has_only_characters_that_the_viewer_has(text, drawn):
    assert drawable(text) == drawn


def test_every_document_of_a_campaign_can_be_drawn(tmp_path):
    write_recording(odd(example_results(logs=1, duration=5.0)), tmp_path / "x.rrd")
    for path, found in read(tmp_path / "x.rrd").items():
        for chunk in found:
            for name in chunk.to_record_batch().schema.names:
                if name.endswith((":text", ":labels", ":names")):
                    text = str(chunk.to_record_batch()[name].to_pylist())
                    assert "海" not in text, path
                    assert not re.search(r"`[^`]*⁻[^`]*`", text), path


def odd(results):
    """The same with names and numbers that the viewer has no letters for."""
    vessel = replace(results.after.vessel, name="海 No. 5")
    return replace(results, after=replace(results.after, vessel=vessel), equations=("u̇ = 4.91e-05 T",))


@pytest.mark.slow
def test_the_viewer_opens_it_without_a_complaint(file, results, tmp_path):
    write_recording(odd(results), tmp_path / "odd.rrd")
    command = shutil.which("rerun", path=str(Path(sys.executable).parent))
    if command is None:
        pytest.skip("the rerun command is not installed beside Python")
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path)}
    words = [command, "--headless", "--bind", "127.0.0.1", "--port", str(port), "--hide-welcome-screen"]
    silent = subprocess.DEVNULL
    with subprocess.Popen(
        words, env=environment, stdout=silent, stderr=silent, start_new_session=True
    ) as viewer:
        try:
            state = state_of(f"rerun+http://127.0.0.1:{port}/proxy", tmp_path / "odd.rrd")
        finally:
            os.killpg(viewer.pid, signal.SIGTERM)  # the viewer is a child of the command
    if state is None:
        pytest.skip("the viewer does not start here: no graphics driver")
    origins = {view.origin.lstrip("/") for view in state.views}
    assert {entities.REPORT, entities.plan(NAME, "").rstrip("/"), f"{entities.DIAGNOSIS}/summary"} <= origins
    assert not [(view.name, view.reports) for view in state.views if view.reports]
    timelines = {t.name: t for r in state.recordings for t in r.timelines}
    assert timelines["elapsed"].end == round(results.trials[0].states["t"].max() * 1e9)
    assert timelines["utc"].start == results.trials[0].utc_ns


def state_of(url, file):
    """What a viewer shows after it has opened a file; None where it cannot be reached."""
    from rerun.experimental import ViewerClient

    patience = time.monotonic() + 20
    while time.monotonic() < patience:
        try:
            client = ViewerClient(url)
            client.take_screenshot()  # without a graphics driver it answers at first, and then ends
        except ConnectionError:
            time.sleep(0.3)
            continue
        client.open(str(file))
        client.take_screenshot()
        return client.get_state()
    return None


def test_a_hopeless_candidate_does_not_squash_the_bars_of_the_others(tmp_path):
    results = example_results(logs=1, duration=10.0)
    first = results.diagnosis.rounds[0]
    hopeless = replace(first.candidates[-1], evidence=-18_000.0)
    turn = replace(first, candidates=(*first.candidates, hopeless))
    changed = replace(results, diagnosis=replace(results.diagnosis, rounds=(turn,)))
    write_recording(changed, tmp_path / "x.rrd")
    (chunk,) = read(tmp_path / "x.rrd")[f"{entities.DIAGNOSIS}/round_1/candidates"]
    drawn = np.array(chunk.to_record_batch()["BarChart:values"].to_pylist()[0][0]["buffer"])
    assert len(drawn) == len(turn.candidates)
    assert drawn.max() == max(c.evidence for c in first.candidates)
    assert drawn.min() >= -0.2 * drawn.max()
