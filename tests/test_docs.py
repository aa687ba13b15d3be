"""The documents say what is so: commands run, options and links exist, the reference is whole, the site builds."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
from doc_pages import (
    MEASURED,
    NOT_RUN,
    PAGES,
    README,
    ROOT,
    SHARED,
    TRIALS,
    blocks,
    run_command,
    run_page,
    runs,
)

from identify.effects import EFFECTS
from identify.models import MODELS
from ingest import errors
from ingest.readers import READERS
from preprocess.signals import VOCABULARY
from seatrial.campaign.tables import CampaignTable, InputTable
from seatrial.cli.app import COMMANDS, make_app

#: Names the folder in which ``seatrial demo`` was done already, as a check of a clean clone does first; what it said is
#: beside it.
DEMO = "SEATRIAL_DEMO"

by_name = pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The documents with their reference, and the site made from them."""
    docs = tmp_path_factory.mktemp("docs") / "docs"
    shutil.copytree(ROOT / "docs", docs, ignore=shutil.ignore_patterns("reference"))
    for words in (
        [str(docs / "generate.py"), "--out", str(docs / "reference")],
        ["-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", str(docs), str(docs / "site")],
    ):
        done = subprocess.run([sys.executable, *words], cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    return docs


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """Does a command once: what it said, and where it did it."""

    @cache
    def done(command):
        if command == "seatrial demo" and (made := os.environ.get(DEMO)):
            return Path(made).with_suffix(".txt").read_text(encoding="utf-8"), Path(made)
        folder = tmp_path_factory.mktemp("shared")
        return run_command(command, folder), folder

    return done


def is_error(value):
    return isinstance(value, type) and issubclass(value, errors.SeatrialError)


def offered():
    from typer.main import get_command

    return get_command(make_app()).commands


def beside_others(page):
    """A page that shares no command with others may be tried on another worker than they."""
    alone = not any(c in SHARED for b in blocks(page) for c in b.commands)
    marks = [pytest.mark.xdist_group(f"page-{page.stem}")] if alone else []
    return pytest.param(page, marks=marks, id=page.stem)


@pytest.mark.slow
@pytest.mark.parametrize("page", [beside_others(p) for p in PAGES if runs(p)])
def test_what_a_page_says_can_be_done(page, tmp_path, shared):
    if any(not log.is_file() for log in MEASURED.get(page.stem, ())):
        pytest.skip("the measured logs are not beside this clone")
    run_page(page, tmp_path, shared)


@by_name
def test_commands_and_options_exist(page):
    text = page.read_text(encoding="utf-8")
    lines = [c for b in blocks(page) if b.language == "sh" for c in b.commands]
    lines += re.findall(r"(?<!`)`(seatrial [a-z][^`]*)`", text)
    for line in (x for x in lines if x.startswith("seatrial ") and "COMMAND" not in x):
        name, *words = re.split(r"\s+", line.removeprefix("seatrial "))
        if name.startswith("-"):
            continue
        assert name in COMMANDS, line
        if name in offered():
            known = {o for p in offered()[name].params for o in p.opts} | {"--help", "--debug"}
            assert {w.split("=")[0] for w in words if w.startswith("--")} <= known, line


@by_name
def test_shell_blocks_are_sound(page):
    for block in (b for b in blocks(page) if b.language == "sh"):
        for command in block.commands:
            assert shlex.split(command)
            known = ("seatrial ", "python -m benchmarks.", *NOT_RUN)
            assert command.startswith(known), command


@by_name
def test_campaigns_are_valid(page):
    for block in (b for b in blocks(page) if b.language == "toml"):
        table = tomllib.loads(block.text)
        if "vessel" in table:
            CampaignTable.model_validate(table)
        else:
            assert table.keys() == {"inputs"}
            for declared in table["inputs"].values():
                InputTable.model_validate(declared)


@by_name
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        assert "reference/" in target or (page.parent / target).exists(), target


def test_pictures_are_small():
    pictures = list((ROOT / "docs" / "pictures").iterdir())
    assert pictures
    assert all(p.stat().st_size <= 300_000 for p in pictures)


def test_prepared_folders_belong_to_pages():
    assert set(TRIALS) <= {p.stem for p in PAGES}


@pytest.mark.parametrize(
    ("page", "names"),
    [
        ("commands", [f"## seatrial {c.name}" for c in make_app().registered_commands]),
        ("models", [f"## {m.name}" for m in MODELS]),
        ("effects", [f"## {e.name}" for e in EFFECTS]),
        ("signals", [f"| `{s.name}` |" for s in VOCABULARY]),
        ("formats", [f"| `{r.name}` |" for r in READERS]),
        ("errors", [f"| `{c.__name__}` |" for c in vars(errors).values() if is_error(c)]),
        ("campaign", [f"`{k}`" for k in InputTable.model_fields]),
        ("files", ["`unexplained`", "`covariance`"]),
    ],
)
def test_the_reference_is_whole(site, page, names):
    text = (site / "reference" / f"{page}.md").read_text(encoding="utf-8")
    assert [n for n in names if n not in text] == []


def test_the_reference_leaves_no_cell_empty(site):
    for page in ("effects", "signals", "formats", "campaign", "errors"):
        for line in (site / "reference" / f"{page}.md").read_text(encoding="utf-8").splitlines():
            if line.startswith("| `"):
                assert re.split(r"(?<!\\)\|", line)[2].strip(), line


def test_the_site_needs_no_network(site):
    pages = list((site / "site").rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert not re.search(r"<(?:script|img|link)[^>]*(?:src|href)=\"https?://", text), page.name


def test_every_page_is_in_the_site(site):
    for page in PAGES:
        if page != README:
            assert (site / "site" / page.relative_to(ROOT / "docs").with_suffix(".html")).exists()
