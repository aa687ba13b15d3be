"""What is said of the logs of a campaign together: nothing to validate on."""

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
from seatrial.remarks import not_validated, require_unseen
from validate.report.page import evidence
from validate.report.words import headline


def logged(name, role="identify", seed=0, **more):
    """A log of 100 s."""
    t = pd.Index(np.arange(0, 100_000_000_001, 10**9), name="t_ns")
    table = pd.DataFrame({"x": np.random.default_rng(seed).normal(size=len(t))}, index=t)
    return LoggedRun(name, Log(Path(name), "csv", {"": table}, utc_ns=more.pop("utc_ns", None)), role, **more)


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
    assert "fitted and validated" in headline(results)
    alone = replace(results, validation_after=replace(results.validation_after, logs=()))
    assert "nothing was left to validate it on" in headline(alone)
