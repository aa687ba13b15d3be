"""The run as a whole: stages in order, options passed on, results whole; the analysis is another test's."""

from __future__ import annotations

import json
import sys
from types import ModuleType, SimpleNamespace

import pytest
from test_cli import CAMPAIGN, write_log

from benchmarks.results_example import example_results
from seatrial import load_campaign, run
from seatrial.__main__ import main
from seatrial.cli.compiling import SAID
from seatrial.progress import Stopwatch
from validate.report.scores import has_two

PARTS = (
    *("before", "after", "validation_before", "validation_after", "diagnosis"),
    *("predictions", "actuators", "equations", "papers", "carried"),
)


@pytest.fixture
def asked(monkeypatch):
    """What the analysis was asked for; it answers with prepared results."""
    calls: list[dict[str, object]] = []
    found, alone = example_results(), example_results(loop=False)

    def analyse(trials: object, **options: object) -> SimpleNamespace:
        calls.append({"trials": trials, **options})
        options["progress"]("identify", "base fit", 0.5)
        options["progress"]("validate", "free run", 0.5)
        results = found if options["loop"] else alone
        return SimpleNamespace(**{name: getattr(results, name) for name in PARTS})

    module = ModuleType("validate.analysis")
    module.analyse = analyse
    monkeypatch.setitem(sys.modules, "validate.analysis", module)
    return calls


@pytest.fixture
def folder(tmp_path):
    write_log(tmp_path / "run.csv")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    return tmp_path


def test_the_python_door(folder, asked):
    stages = []
    results = run(
        load_campaign(folder),
        model="linear",
        seed=7,
        loop=False,
        progress=lambda stage, text="", fraction=None: stages.append(stage),
    )
    (call,) = asked
    assert (call["model"], call["estimator"], call["seed"], call["loop"]) == ("linear", "auto", 7, False)
    assert call["materiality"] == 0.10
    assert [t.role for t in call["trials"]] == ["identify", "validate"], "no log has a role"
    assert list(dict.fromkeys(stages)) == ["ingest", "preprocess", "identify", "validate"]
    assert [log.format for log in results.logs] == ["csv"]
    assert set(results.timing_s) == {"ingest", "preprocess", "identify", "validate", "total"}
    assert results.timing_s["total"] == pytest.approx(
        sum(results.timing_s[s] for s in dict.fromkeys(stages)), abs=0.05
    )
    assert sorted(p.name for p in folder.iterdir()) == ["campaign.toml", "run.csv"], (
        "nothing is written unasked"
    )


def test_the_results_are_beside_the_campaign_and_whole(folder, asked, capsys):
    for _ in range(2):
        with pytest.raises(SystemExit) as end:
            main(["run", str(folder)])
        assert end.value.code in (0, None)
    names = {p.name for p in (folder / "results").iterdir()}
    assert names == {"report.json", "report.html", "model.json", "recording.rrd", "predictions", "trial"}
    assert sorted(p.name for p in folder.iterdir()) == ["campaign.toml", "results", "run.csv"]
    out, err = capsys.readouterr()
    for word in ("run.csv", "Verdict", str(folder / "results" / "report.html"), "seatrial view"):
        assert word in out
    assert max(map(len, out.replace(str(folder), "").splitlines())) <= 80
    told = [line for line in err.splitlines() if line != SAID]  # a new installation compiles
    assert [line.split()[0] for line in told[:5]] == [
        *("Reading", "Preprocessing", "Identifying", "Validating", "Writing")
    ]


def test_where_nothing_was_taken_the_report_has_one_column_and_one_prediction(folder, asked):
    results = run(load_campaign(folder), folder / "a", loop=False)
    page = (folder / "a" / "report.html").read_text()
    assert not has_two(results)
    assert "with effects" not in page and 'class="before"' not in page
    run(load_campaign(folder), folder / "b")
    assert "with effects" in (folder / "b" / "report.html").read_text()


def test_json_is_the_report_and_quiet_is_quiet(folder, asked, capsys):
    with pytest.raises(SystemExit):
        main(["run", str(folder), "--out", str(folder / "a"), "--json", "--no-loop", "--materiality", "0.2"])
    out, err = capsys.readouterr()
    assert not err
    assert json.loads(out) == json.loads((folder / "a" / "report.json").read_text())
    assert (asked[0]["loop"], asked[0]["materiality"]) == (False, 0.2)
    with pytest.raises(SystemExit):
        main(["run", str(folder), "--out", str(folder / "a"), "--quiet"])
    assert capsys.readouterr() == ("", "")


def test_what_fails_while_writing_leaves_nothing(folder, asked, monkeypatch, capsys):
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("validate.report_files.write_results", full)
    with pytest.raises(SystemExit) as end:
        main(["run", str(folder)])
    assert end.value.code == 1
    assert "No space left on device" in capsys.readouterr().err
    assert sorted(p.name for p in folder.iterdir()) == ["campaign.toml", "run.csv"]


def test_time_goes_to_the_stage_that_was_named():
    watch = Stopwatch()
    watch("ingest")
    watch("identify", "", 0.1)
    watch("identify", "", 1.0)
    watch("diagnose")
    timing = watch.timing()
    assert list(timing) == ["ingest", "preprocess", "identify", "validate", "total"]
    assert timing["total"] == pytest.approx(sum(v for k, v in timing.items() if k != "total"))
    assert timing["preprocess"] == 0.0 < timing["validate"]
