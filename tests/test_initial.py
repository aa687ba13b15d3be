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


@pytest.mark.parametrize(
    ("most", "marks"), [(1.0, "none if shares of full thrust"), (60.0, "REQUIRED: rad, deg, rev/s")]
)
def test_a_share_of_full_thrust_need_not_have_a_unit(tmp_path, most, marks):
    rows = "".join(f"{i / 10},{i},0,{i % 90},{most * (i % 9) / 8}\n" for i in range(50))
    (tmp_path / "a.csv").write_text(f"t,north,east,heading_deg,cmd_left\n{rows}")
    start = initial_campaign(tmp_path)
    assert f'# unit = ""          # {marks}' in start.text
    assert start.open_marks == 3 + (most > 1.0)
