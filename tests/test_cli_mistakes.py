"""What was given in place of what was meant, and what is said then."""

from __future__ import annotations

from dataclasses import replace

import pytest
from test_cli import CAMPAIGN, one_sentence, write_log

from ingest import read_log
from ingest.errors import MissingSignal, UsageError
from preprocess.actuators import read_input
from preprocess.vessel import Input
from seatrial.__main__ import main
from seatrial.models import load_model
from validate.report import model_file


@pytest.fixture
def cli(capsys):
    """Runs the command line here; gives exit status, stdout, stderr."""

    def call(*words):
        with pytest.raises(SystemExit) as end:
            main([str(w) for w in words])
        return end.value.code, *capsys.readouterr()

    return call


@pytest.fixture
def folder(tmp_path):
    write_log(tmp_path / "run.csv")
    return tmp_path


def test_an_unknown_schema_is_said_in_words(cli):
    _, _, err = cli("schema", "foo")
    assert "expected report, model, campaign, found 'foo'" in " ".join(err.replace("│", "").split())
    assert "Value error" not in err


def test_a_log_in_place_of_a_campaign_is_told(cli, folder):
    status, _, err = cli("run", folder / "run.csv")
    assert status == 2
    assert one_sentence(err)
    assert "expected a campaign, found a log (csv); `seatrial init" in err
    (folder / "run.cfg").write_text(CAMPAIGN + "[[log")
    assert "expected TOML" in cli("run", folder / "run.cfg")[2]


def test_what_else_was_tried_is_said_with_debug(cli, tmp_path):
    (tmp_path / "x.bin").write_bytes(bytes(range(128, 256)) * 9)
    for words, said in (((), False), (("--debug",), True)):
        status, _, err = cli("inspect", tmp_path / "x.bin", *words)
        assert status == 1
        assert "no usable record: the file looks like binary data" in err
        assert ("ulog" in err) == said


def test_a_text_is_not_recovered_and_called_what_it_is(cli, folder):
    status, _, err = cli("recover", folder / "run.csv")
    assert status == 1
    assert "the file looks like text whose first line is 't,north" in err


def test_a_model_is_found_in_the_results_of_a_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(model_file, "read_model", lambda file: file)
    with pytest.raises(UsageError, match=r"no model\.json is there"):
        load_model(tmp_path)
    results = tmp_path / "results"
    results.mkdir()
    (results / "model.json").write_text("{}")
    assert load_model(tmp_path) == load_model(results) == load_model(results / "model.json")


def test_a_log_that_is_not_there_is_said_without_the_name_of_a_function(cli, folder):
    status, _, err = cli("inspect", folder / "ran.csv")
    assert status == 2
    assert err == f"Error: The log {folder / 'ran.csv'} is not there. Nearest there: run.csv.\n"


def test_no_names_at_all_are_no_choice_of_models(cli, folder):
    status, _, err = cli("compare", folder, "--model", " , ")
    assert (status, err) == (2, "Error: --model: expected names between commas, found none.\n")


def test_an_input_without_a_standard_message_is_said_with_signals_of_its_kind(folder):
    log = read_log(folder / "run.csv")
    bare = replace(log, sources=(), tables={"": log.tables[""].assign(rpm_engine=1.0)})
    with pytest.raises(
        MissingSignal, match=r"inputs\.n names no signal, and .* a propeller .*: rpm_engine\."
    ):
        read_input(bare, Input("n", "propeller"))
    with pytest.raises(MissingSignal, match=r"of a rudder \(NMEA 0183 RSA.*'seatrial inspect' shows"):
        read_input(replace(bare, tables={"": log.tables[""][["north"]]}), Input("r", "rudder"))


def test_a_folder_whose_name_has_blanks_is_quoted_for_the_next_command(cli, folder):
    trials = folder / "Kieler Förde"
    trials.mkdir()
    write_log(trials / "run.csv")
    assert cli("init", trials)[1].endswith(f"then: seatrial run '{trials}'\n")
