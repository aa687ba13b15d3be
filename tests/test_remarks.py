"""What is said of the logs of a campaign together: divided, nothing to validate on, copies, overlaps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_cli import CAMPAIGN, write_log

from benchmarks.results_example import example_results
from ingest.errors import DataError, NothingToValidate
from ingest.log import Log
from preprocess.run_of_log import LoggedRun
from seatrial import load_campaign, run
from seatrial.cli.summary import finding_lines
from seatrial.remarks import beyond_the_end, divided, not_validated, overlaps, require_unseen, same_records
from validate.report.page import evidence
from validate.report.words import headline

STARTS = {"a": 0.0, "b": 60.0, "c": 130.0}


def logged(name, role="identify", seed=0, **more):
    """A log of 100 s."""
    t = pd.Index(np.arange(0, 100_000_000_001, 10**9), name="t_ns")
    table = pd.DataFrame({"x": np.random.default_rng(seed).normal(size=len(t))}, index=t)
    return LoggedRun(name, Log(Path(name), "csv", {"": table}, utc_ns=more.pop("utc_ns", None)), role, **more)


def test_that_no_log_validates_as_a_whole_is_one_line():
    assert "the last third of each" in "".join(divided([logged("a", None), logged("b", None)]))
    assert not list(divided([logged("a"), logged("b", "validate")]))


@pytest.mark.parametrize(
    ("roles", "said"),
    [
        (("identify", "validate"), "a and b hold the same records: predicting one is no test of the other."),
        (("identify", "identify"), "a and b hold the same records: what they say counts more than once."),
        ((None, None), "a and b hold the same records: what they say counts more than once."),
    ],
)
def test_copies_are_said(roles, said):
    a, b = map(logged, "ab", roles)
    assert list(same_records([a, logged("c", seed=1), b])) == [said]
    three = said.replace("a and b", "a, b and d").replace("the other", "another")
    assert list(same_records([a, b, logged("d", roles[0])])) == [three]
    halves = [replace(r, slice=s) for r, s in zip((a, b), ((0.0, 50.0), (50.0, 100.0)), strict=True)]
    assert not list(same_records(halves))


def test_a_slice_that_ends_after_its_log_is_said():
    a, b = logged("a", slice=(30.0, 1200.0)), logged("b", seed=1, slice=(0.0, 100.5))
    (said,) = beyond_the_end([a, b, logged("c", seed=2)])
    assert said == (
        "The slice [30, 1200] of a ends after the log, which lasts 100.0 s: 70.0 s of it are used."
    )
    (both,) = beyond_the_end([a, replace(b, slice=(10.0, 500.0))])
    assert "lasts 100.0 s (2 such slices in all): 70.0 s" in both


def test_logs_in_one_anothers_time_are_counted():
    a, b, c = (logged(n, seed=k, start=STARTS[n]) for k, n in enumerate("abc"))
    (said,) = overlaps([a, b, c], STARTS)
    assert said.startswith("a and b overlap by 40 s in campaign time (2 such pairs in all): check `start`")
    assert not list(overlaps([a, c], STARTS))
    assert not list(overlaps([a, replace(b, slice=(50.0, 60.0))], STARTS))


def test_logs_whose_times_nobody_knows_do_not_overlap_and_copies_are_said_once():
    a, b = (logged(n, seed=k) for k, n in enumerate("ab"))
    assert not list(overlaps([a, b], {}))
    assert not list(overlaps([a, replace(b, log=a.log, start=10.0)], {"b": 10.0}))
    assert list(overlaps([logged("a", utc_ns=1), logged("b", seed=1, utc_ns=1)], {}))


@pytest.fixture
def short(tmp_path):
    """A campaign of one log whose last third is too short."""
    write_log(tmp_path / "run.csv", seconds=12)
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    return load_campaign(tmp_path)


def test_nothing_left_to_validate_on_is_no_verdict(short):
    with pytest.raises(
        NothingToValidate, match=r"the last third of no log .* more than 15 s, or give role"
    ) as e:
        run(short, short.path.parent / "results")
    assert isinstance(e.value, DataError)
    assert not (short.path.parent / "results").exists()


def test_a_role_that_no_log_can_play_is_said_too():
    (trial, other), path = example_results(logs=2, duration=5.0).trials[:2], Path("campaign.toml")
    used, unused = replace(trial, role="identify"), replace(other, role="validate", segments=())
    runs = [logged("a"), logged("b", "validate")]
    with pytest.raises(NothingToValidate, match=r'no log with role = "validate" has .*--no-loop'):
        require_unseen(path, runs, [used, unused])
    require_unseen(path, runs, [used, replace(other, role="validate")])
    require_unseen(path, runs, [replace(used, segments=()), unused])
    assert "Nothing was validated" in "".join(not_validated([used, unused]))


def test_remarks_come_first_and_the_sentence_does_not_claim_a_validation():
    results = replace(example_results(logs=2, duration=5.0, loop=False), remarks=("Two of them are one.",))
    assert next(finding_lines(results)) == "  · Two of them are one."
    assert next(iter(evidence(results)["noticed"])) == ("The logs together", ("Two of them are one.",))
    assert "it predicts unseen logs with an R² of" in headline(results)
    alone = replace(results, validation_after=replace(results.validation_after, logs=()))
    assert "nothing was left to validate it on" in headline(alone)
