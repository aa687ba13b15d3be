"""The shape of the project: imports point one way, the wheel holds what it should, names do not clash."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from seatrial.cli.app import COMMANDS, make_app
from seatrial.compiled_code import forget_stale_code
from seatrial.stages import STAGES, foreign_stage

ROOT = Path(__file__).parents[1]
ORDER = ("ingest", "preprocess", "identify", "validate", "seatrial")
SCRIPT = Path(sys.executable).parent / "seatrial"


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Top-level names of everything that a module imports, wherever in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("package", ORDER)
def test_imports_point_one_way(package):
    later = set(ORDER[ORDER.index(package) + 1 :]) | {"fixtures", "tests", "benchmarks"}
    assert modules(package)
    wrong = {str(p.relative_to(ROOT)): imported(p) & later for p in modules(package)}
    assert not {k: v for k, v in wrong.items() if v}


def test_the_simulator_knows_nothing_of_the_product():
    wrong = {str(p.relative_to(ROOT)): imported(p) & set(ORDER) for p in modules("fixtures")}
    assert not {k: v for k, v in wrong.items() if v}


@pytest.mark.parametrize("package", ORDER)
def test_a_module_is_read_in_one_sitting(package):
    long = {
        str(p.relative_to(ROOT)): lines
        for p in modules(package)
        if (lines := len(p.read_text(encoding="utf-8").splitlines())) > 300
    }
    assert not long


@pytest.mark.parametrize("package", ORDER)
def test_no_module_bears_the_name_of_a_library_that_its_stage_imports(package):
    own = {p.stem for p in modules(package)} | {p.parent.name for p in modules(package)}
    libraries = set().union(*(imported(p) for p in modules(package))) - set(ORDER) - sys.stdlib_module_names
    assert not own & libraries


def test_every_stage_is_the_one_beside():
    assert foreign_stage() is None


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_of_somebody_else_is_named(stage, tmp_path):
    (tmp_path / stage).mkdir()
    (tmp_path / stage / "__init__.py").write_text("")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([SCRIPT, "--help"], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert f"'{stage}'" in done.stderr
    assert str(tmp_path) in done.stderr
    assert "Traceback" not in done.stderr


def test_a_namesake_in_the_same_environment_is_named(tmp_path):
    for stage, mark in STAGES.items():
        (tmp_path / stage).mkdir()
        (tmp_path / stage / "__init__.py").write_text("")
        (tmp_path / stage / mark).write_text("")
    (tmp_path / "configobj-5.0.9.dist-info").mkdir()
    code = "from pathlib import Path; from seatrial.stages import *; print(foreign_stage(Path.cwd()))"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "'configobj' overwrites the package 'validate'" in done.stdout


def test_the_wheel_holds_the_five_packages_and_the_demo(tmp_path):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("seatrial-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    top = {n.split("/")[0] for n in names if ".dist-info" not in n}
    assert top == set(ORDER)
    for package in ORDER:
        assert {str(p.relative_to(ROOT)) for p in modules(package)} <= set(names)
    demo = {p.name for p in (ROOT / "fixtures" / "demo").iterdir() if p.name != ".keep"}
    assert {f"seatrial/demo/{n}" for n in demo} <= set(names)
    assert any(n.endswith("licenses/LICENSE") for n in names)


def test_what_was_tested_is_pinned_without_addresses():
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert pins
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.!+_-]+", p) for p in pins)


def test_the_readme_has_every_command_and_no_other():
    table = re.findall(r"^\| `seatrial (\w+)", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    offered = {c.name for c in make_app().registered_commands}
    assert sorted(table) == sorted(COMMANDS)
    assert offered <= set(COMMANDS)


def test_the_readmes_options_exist():
    from typer.main import get_command

    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for command in make_app().registered_commands:
        row = re.search(rf"^\| `seatrial {command.name}.*$", text, re.MULTILINE)
        said = set(re.findall(r"`(--[a-z-]+)`", row.group()))
        there = {o for p in get_command(make_app()).commands[command.name].params for o in p.opts}
        assert said <= there


def test_make_names_the_targets_of_the_readme():
    makefile = (ROOT / "Makefile").read_text()
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for target in set(re.findall(r"(?:`|^)make (\w+)", readme, re.MULTILINE)):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_compiled_code_is_forgotten_when_any_source_changed(tmp_path):
    cache = tmp_path / "identify" / "inner" / "__pycache__"
    cache.mkdir(parents=True)
    source = tmp_path / "preprocess" / "called.py"
    source.parent.mkdir()
    source.write_text("x = 1\n")
    forget_stale_code(tmp_path)
    (cache / "caller.nbc").write_bytes(b"old")
    assert forget_stale_code(tmp_path) == 0
    assert (cache / "caller.nbc").exists()
    source.write_text("x = 22\n")
    assert forget_stale_code(tmp_path) == 1
    assert not (cache / "caller.nbc").exists()


@pytest.mark.skipif("PYTEST_XDIST_WORKER" not in os.environ, reason="all tests are on one worker")
def test_the_tests_of_a_file_are_on_one_worker(request):
    """What a file prepares once would be prepared by every worker: an xdist that pytest outgrew says nothing of it."""
    assert request.node.nodeid.endswith("@test_project")
