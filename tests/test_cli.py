"""The command line as a user meets it: output, errors, exit status, nothing half-written."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import seatrial
from ingest.errors import DataError, UsageError
from seatrial import load_campaign
from seatrial.__main__ import main
from seatrial.initial import column_name, initial_campaign
from seatrial.results_folder import check_replaceable, in_place
from seatrial.viewer import recording_in, viewer_command, viewer_environment

SCRIPT = Path(sys.executable).parent / "seatrial"

CAMPAIGN = """
[vessel]
name = "a"
length = 1.0
beam = 0.3
[inputs.rudder]
kind = "rudder"
signal = "rudder_deg"
unit = "deg"
[sensors.position]
north = "north"
east = "east"
[sensors.heading]
signal = "heading_deg"
unit = "deg"
[model]
name = "blanke"
[[log]]
path = "run.csv"
"""


def write_log(path: Path, columns: str = "t,north,east,heading_deg,rudder_deg", seconds: int = 60) -> None:
    t = np.arange(0.0, seconds, 0.1)
    values = {
        "t": t,
        "north": t * 0.8,
        "east": np.sin(t / 5.0),
        "heading_deg": 20.0 * np.cos(t / 5.0),
        "rudder_deg": 20.0 * np.sign(np.sin(t / 5.0)),
    }
    table = np.column_stack([values[c] for c in columns.split(",")])
    np.savetxt(path, table, delimiter=",", header=columns, comments="", fmt="%.4f")


@pytest.fixture
def folder(tmp_path):
    write_log(tmp_path / "run.csv")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    return tmp_path


@pytest.fixture
def cli(capsys):
    """Runs the command line here; gives exit status, stdout, stderr."""

    def call(*words: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            main([str(w) for w in words])
        out, err = capsys.readouterr()
        code = end.value.code
        return (code if isinstance(code, int) else 0 if code is None else 1), out, err

    return call


def one_sentence(err: str) -> bool:
    return err.startswith("Error: ") and err.count("\n") == 1 and "Traceback" not in err


def test_the_script_starts_without_heavy_imports():
    heavy = "{'numpy', 'pandas', 'numba', 'rerun', 'matplotlib', 'scipy', 'pymavlink', 'pydantic'}"
    code = (
        "import sys\nfrom seatrial.__main__ import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        f"print(sorted({heavy} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_help_has_every_command_and_examples(cli):
    status, out, _ = cli("--help")
    assert status == 0
    names = re.findall(r"│ (\w+) ", out.split("Commands")[1])
    assert {"run", "inspect", "init", "demo", "view", "schema"} <= set(names)
    for name in names:
        status, text, _ = cli(name, "--help")
        assert status == 0
        assert f"seatrial {name}" in text.split("Options")[0].split("Usage")[1].split("\n", 1)[1], (
            "an example"
        )


def test_the_script_and_the_module_say_the_same_version():
    for command in ([SCRIPT], [sys.executable, "-m", "seatrial"]):
        done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
        assert re.fullmatch(r"seatrial \d+\.\d+\.\d+\S*\n", done.stdout)


@pytest.mark.parametrize("words", [("rum",), ("run",), ("run", "x", "--seed", "a"), ("schema", "reports")])
def test_a_wrong_command_line_is_status_2(cli, words):
    status, out, err = cli(*words)
    assert status == 2
    assert not out
    assert "Usage" in err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "kind =",
            "knd =",
            r"\[inputs\.rudder\] knd: expected one of kind.*found the unknown key 'knd'.*'kind'",
        ),
        ("run.csv", "rum.csv", r"the log \S*rum\.csv is not there\. Nearest there: run\.csv"),
        ('"rudder_deg"', '"ruder_deg"', r"inputs\.rudder\.signal names the signal 'ruder_deg'.*rudder_deg"),
        ("[[log]]", "[[log", r"line \d+, column \d+: expected TOML"),
    ],
)
def test_a_wrong_campaign_is_status_2_and_one_sentence(cli, folder, old, new, said):
    (folder / "campaign.toml").write_text(CAMPAIGN.replace(old, new, 1))
    status, out, err = cli("run", folder)
    assert status == 2
    assert not out
    assert re.search(said, err), err
    assert "Traceback" not in err
    assert not (folder / "results").exists()


def test_a_slice_outside_of_its_log_is_status_2(cli, folder):
    (folder / "campaign.toml").write_text(CAMPAIGN + "slice = [100.0, 110.0]")
    status, _, err = cli("run", folder, "--quiet")
    assert status == 2
    assert one_sentence(err)
    assert "campaign.toml: [[log]] 1 (run.csv) slice: expected [from, to]" in err
    assert "from 0 to 59.9 s, found the list [100.0, 110.0]" in err


def test_a_campaign_that_is_not_there_is_status_2(cli, folder):
    status, _, err = cli("run", folder / "campain.toml")
    assert status == 2
    assert one_sentence(err)
    assert "campaign.toml" in err


def test_an_unknown_model_is_status_2(cli, folder):
    status, _, err = cli("run", folder, "--model", "blankee")
    assert status == 2
    assert "Did you mean 'blanke'?" in err


@pytest.mark.parametrize("quantity", ["position", "heading"])
def test_a_log_without_position_or_heading_is_status_1(cli, folder, quantity):
    names = {"position": "t,heading_deg,rudder_deg", "heading": "t,north,east,rudder_deg"}
    tables = CAMPAIGN.split("[")
    without = "[".join(t for t in tables if not t.startswith(f"sensors.{quantity}"))
    write_log(folder / "run.csv", names[quantity])
    (folder / "campaign.toml").write_text(without)
    status, out, err = cli("run", folder, "--quiet")
    assert status == 1
    assert not out
    assert one_sentence(err)
    assert f"no {quantity} in this log" in err
    assert not (folder / "results").exists()


def test_a_file_that_is_no_log_is_status_1(cli, folder):
    (folder / "run.csv").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(200))
    for words in (("run", folder, "--quiet"), ("inspect", folder / "run.csv")):
        status, _, err = cli(*words)
        assert status == 1
        assert one_sentence(err)
        assert "PNG" in err


def test_what_is_unexpected_is_one_sentence_unless_debug(cli, folder, monkeypatch):
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("as if")

    monkeypatch.setattr("seatrial.campaign.load_campaign", broken)
    status, _, err = cli("run", folder)
    assert status == 1
    assert one_sentence(err)
    assert "unexpected ZeroDivisionError" in err
    assert "--debug" in err
    status, _, err = cli("run", folder, "--debug")
    assert status == 1
    assert "Traceback" in err


def test_an_interrupt_leaves_nothing(cli, folder, monkeypatch):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("seatrial.pipeline.read_log", interrupted)
    status, _, err = cli("run", folder)
    assert status == 130
    assert err.endswith("Interrupted: nothing half-written is left.\n")
    assert "Traceback" not in err
    assert sorted(p.name for p in folder.iterdir()) == ["campaign.toml", "run.csv"]


def test_inspect_says_what_is_in_a_log(cli, folder):
    status, out, _ = cli("inspect", folder / "run.csv")
    assert status == 0
    for words in ("csv", "600 messages", "59.9 s", "10 Hz", "heading_deg", "rudder_deg"):
        assert words in out
    assert max(map(len, out.splitlines()[1:])) <= 80


def test_inspect_as_json(cli, folder):
    status, out, _ = cli("inspect", folder / "run.csv", "--json")
    facts = json.loads(out)
    assert status == 0
    assert facts["format"] == "csv"
    (topic,) = facts["topics"]
    assert topic["messages"] == 600
    assert topic["rate_hz"] == pytest.approx(10.0)
    there = {f["name"]: (f["low"], f["high"]) for f in topic["fields"]}
    assert there["rudder_deg"] == (-20.0, 20.0)
    assert "rudder_deg" in {c["signal"] for c in facts["candidates"] if c["quantity"].startswith("input")}


def test_inspect_of_a_file_that_is_not_there(cli, folder):
    status, _, err = cli("inspect", folder / "rum.csv")
    assert status == 2
    assert "run.csv" in err


def test_init_writes_what_loads_once_it_is_filled_in(cli, folder):
    (folder / "campaign.toml").unlink()
    status, out, _ = cli("init", folder)
    assert status == 0
    file = folder / "campaign.toml"
    text = file.read_text()
    marked = [line for line in text.splitlines()[2:] if "REQUIRED" in line]
    assert f"{len(marked)} values" in out
    with pytest.raises(UsageError, match="length"):
        load_campaign(file)
    filled = {"length": "1.0", "beam": "0.3", "kind": '"rudder"', "unit": '"deg"', "signal": '"x"'}
    for key, value in filled.items():
        text = re.sub(rf"^# {key} =[^#\n]*", f"{key} = {value} ", text, flags=re.MULTILINE)
    file.write_text(re.sub(r"^# (\[.*\])", r"\1", text, flags=re.MULTILINE))
    campaign = load_campaign(file)
    assert [log.path for log in campaign.logs] == ["run.csv"]
    assert [(i.signal, i.unit) for i in campaign.inputs] == [("rudder_deg", "deg")]


def test_init_of_servo_channels_marks_what_only_a_person_knows(cli, tmp_path):
    table = "t,north,east,heading_deg,servo1_raw,servo2_raw\n" + "".join(
        f"{i / 10},{i},0,{i % 90},{1100 + 8 * i},{1500}\n" for i in range(100)
    )
    (tmp_path / "a.csv").write_text(table)
    assert cli("init", tmp_path)[0] == 0
    file = tmp_path / "campaign.toml"
    text = file.read_text()
    assert "[inputs.servo1]" in text
    assert "[inputs.servo2]" not in text, "it never moved"
    for key, value in {"length": "1.0", "beam": "0.3", "kind": '"rudder"'}.items():
        text = re.sub(rf"^# {key} =[^#\n]*", f"{key} = {value} ", text, flags=re.MULTILINE)
    file.write_text(text)
    (servo,) = load_campaign(file).inputs
    assert (servo.name, servo.signal, servo.pwm) == ("servo1", "servo1_raw", (1100.0, 1500.0, 1900.0))


def test_init_never_overwrites(cli, folder):
    status, _, err = cli("init", folder)
    assert status == 2
    assert one_sentence(err)
    assert (folder / "campaign.toml").read_text() == CAMPAIGN


def test_init_without_logs(cli, tmp_path):
    (tmp_path / "notes.md").write_text("none")
    (tmp_path / "image.bin").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    status, _, err = cli("init", tmp_path)
    assert status == 1
    assert "image.bin" in err
    assert not (tmp_path / "campaign.toml").exists()
    assert cli("init", tmp_path / "nowhere")[0] == 2


def test_the_first_campaign_is_toml_whatever_the_folder_is_called(tmp_path):
    odd = tmp_path / 'a "b" ü'
    odd.mkdir()
    write_log(odd / "run 1.csv")
    tables = tomllib.loads(initial_campaign(odd).text)
    assert tables["vessel"]["name"] == odd.name
    assert tables["log"][0]["path"] == "run 1.csv"


@pytest.mark.parametrize(
    ("text", "name"),
    [("servo1_raw", "servo1"), ("C3", "c3"), ("output[0]", "output_0"), ("r", "input_r"), ("1x", "input_1x")],
)
def test_names_of_columns(text, name):
    assert column_name(text) == name


@pytest.mark.parametrize("which", ["report", "model", "campaign"])
def test_schemas_are_schemas(cli, which):
    status, out, _ = cli("schema", which)
    assert status == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(out))


def test_view_is_bound_to_this_machine(cli, tmp_path, monkeypatch):
    (tmp_path / "recording.rrd").write_bytes(b"RRF2")
    called = []

    def pretend(command: list[str], check: bool, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
        called.append(command)
        assert env["RUST_LOG"] == "error"
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(subprocess, "run", pretend)
    status, _, _ = cli("view", tmp_path)
    assert status == 0
    (command,) = called
    assert "web_viewer=info" in viewer_environment(web=True)["RUST_LOG"]
    monkeypatch.setenv("RUST_LOG", "debug")
    assert viewer_environment()["RUST_LOG"] == "debug"
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    assert command[-1] == str(tmp_path / "recording.rrd")


def test_the_viewers_options_exist():
    command = viewer_command(Path("x.rrd"), web=True)
    text = subprocess.run([*command[:3], "--help"], capture_output=True, text=True, check=True).stdout
    assert all(word in text for word in command if word.startswith("--"))


def test_view_without_a_recording_is_status_2(cli, tmp_path):
    status, _, err = cli("view", tmp_path)
    assert status == 2
    assert one_sentence(err)
    with pytest.raises(UsageError):
        recording_in(tmp_path / "nowhere")
    write_log(tmp_path / "recording.rrd")
    with pytest.raises(
        UsageError, match="expected a recording of Rerun, found text whose first line is 't,north"
    ):
        recording_in(tmp_path)


def test_results_appear_whole(tmp_path):
    target = tmp_path / "new" / "results"
    with in_place(target) as unfinished:
        (unfinished / "report.json").write_text("1")
        assert not target.exists()
    assert (target / "report.json").read_text() == "1"
    assert [p.name for p in target.parent.iterdir()] == ["results"]


@pytest.mark.parametrize("error", [DataError, KeyboardInterrupt])
def test_what_fails_leaves_the_old_results(tmp_path, error):
    target = tmp_path / "results"
    target.mkdir()
    (target / "report.json").write_text("old")
    with pytest.raises(error), in_place(target) as unfinished:
        (unfinished / "report.json").write_text("new")
        raise error
    assert (target / "report.json").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["results"]


def test_a_folder_with_other_things_is_never_replaced(cli, folder):
    status, _, err = cli("run", folder, "--out", folder)
    assert status == 2
    assert one_sentence(err)
    assert "campaign.toml" in err
    with pytest.raises(UsageError, match="file"):
        check_replaceable(folder / "run.csv")


def test_the_public_names_are_there():
    for name in seatrial.__all__:
        assert callable(getattr(seatrial, name))
    with pytest.raises(AttributeError):
        _ = seatrial.nothing
