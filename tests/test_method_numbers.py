"""The method's table of thresholds has the numbers of the code, and every question of it a heading."""

import re
from importlib import import_module
from pathlib import Path

import pytest

METHOD = (Path(__file__).parents[1] / "docs" / "method.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| [^|]+ \| ([\d.]+) \| `([\w.]+)\.(\w+)` \|$", METHOD, re.MULTILINE)


def test_the_table_is_found():
    assert len(ROWS) > 30


@pytest.mark.parametrize(("number", "module", "name"), ROWS)
def test_a_threshold_is_the_one_in_the_code(number, module, name):
    module = module if module.startswith("identify.") else f"validate.{module}"
    assert getattr(import_module(module), name) == float(number)


def test_no_part_of_what_is_missing_goes_on_for_pages_without_a_heading():
    parts = re.split(r"^#+ .*$", METHOD[METHOD.index("## What is missing") :], flags=re.MULTILINE)
    assert max(len(p.split()) for p in parts) < 1200
