"""What a campaign says of its logs, against the logs as they were read; and mistakes that bring no others with them."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from campaign_samples import SMALL, load, with_logs

from ingest.errors import CampaignError
from ingest.log import Log
from seatrial.campaign import check_against

#: A campaign with two inputs whose place must be said.
AZIMUTH = """[inputs.rudder]
kind = "azimuth"
signal = "a"
drives = "n_prot"
position = [-0.4, 0.0]
[inputs.n_port]
kind = "thruster"
signal = "b"
"""


def log_of(path, form, lasting=30.0):
    index = pd.Index(100_000_000 * np.arange(round(10 * lasting) + 1))
    return Log(path, form, {"": pd.DataFrame({"x": 0.0}, index=index)}, {})


def check(folder, line, form, lasting=30.0):
    campaign = load(with_logs(folder), SMALL + line)
    check_against(campaign, [log_of(folder / "a.csv", form, lasting)])


@pytest.mark.parametrize(("keys", "form"), [("skip = 1", "csv"), ('mavlink = "common"', "tlog"), ("", "ubx")])
def test_a_dialect_that_its_format_reads_is_right(tmp_path, keys, form):
    check(tmp_path, f"dialect = {{ {keys} }}", form)


@pytest.mark.parametrize(
    ("keys", "form", "only"), [('columns = "t x"', "nmea0183", "csv"), ('mavlink = "common"', "csv", "tlog")]
)
def test_a_dialect_that_its_format_does_not_read_is_said(tmp_path, keys, form, only):
    with pytest.raises(CampaignError, match=rf"1 \(a\.csv\) dialect\.\w+: .* {form}: .*format = \"{only}\""):
        check(tmp_path, f"dialect = {{ {keys} }}", form)


def test_a_slice_of_which_a_log_has_next_to_nothing_is_said(tmp_path):
    check(tmp_path, "slice = [20, 60]", "csv")
    with pytest.raises(
        CampaignError, match=r"slice: expected .* with 5 s of the log, which goes from 0 to 30"
    ):
        check(tmp_path, "slice = [28, 60]", "csv")


def test_an_azimuth_that_drives_nothing_is_one_mistake(tmp_path):
    text = SMALL.replace('[inputs.rudder]\nkind = "rudder"\n', AZIMUTH).replace("blanke", "modulus")
    with pytest.raises(CampaignError) as caught:
        load(with_logs(tmp_path), text)
    assert (caught.value.key, caught.value.nearest_key) == ("[inputs.rudder] drives", "n_port")
    assert not getattr(caught.value, "__notes__", [])
