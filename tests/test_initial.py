"""What a first campaign says where there is no input for all logs."""

from __future__ import annotations

import pytest

from seatrial.initial import initial_campaign


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (("helm_a", "helm_a", "helm_b"), "none moves in all logs; helm_a does in 2 of 3"),
        (("other", "other", "other"), "none was recognised"),
    ],
)
def test_inputs_that_only_some_logs_have_are_told_from_none(tmp_path, columns, said):
    for k, column in enumerate(columns):
        rows = "".join(f"{i / 10},{i},0,{i % 90},{i % 7}\n" for i in range(50))
        (tmp_path / f"{k}.csv").write_text(f"t,north,east,heading_deg,{column}\n{rows}")
    assert f"one table for each actuator; {said}\n" in initial_campaign(tmp_path).text
