"""Make the numbers, tables and pictures of the case studies from the measured campaigns.

    python docs/make_case_studies.py DATA [--only blueboat] [--results FOLDER] [--out docs/case-studies]

DATA holds a folder for each campaign, with its ``campaign.toml``. Each campaign is run as ``seatrial run`` would, into
``FOLDER/NAME`` (or a folder that is thrown away); results that are there already are used as they are. What stands
between ``<!-- made: … -->`` and ``<!-- end -->`` on a page is written anew; the prose around it is left alone.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import case_checks
import case_tables
import case_words
from case_facts import Case
from case_pictures import all_of

OUT = Path(__file__).parent / "case-studies"
#: Page and campaign: the pictures that it shows.
CASES = {
    "blueboat": ["turning", "tracks", "channels", "evidence", "residuals"],
    "kvlcc2-hsva": ["headings", "tracks", "channels", "evidence", "residuals"],
}
BLOCKS: dict[str, Callable[[Case], str]] = {
    **{f.__name__: f for f in (case_tables.vessel, case_tables.logs, case_tables.unseen, case_tables.seen)},
    **{
        f.__name__: f
        for f in (case_words.verdict, case_words.outcome, case_words.left, case_words.known, case_words.made)
    },
    "candidates": case_tables.candidates,
    "turning": case_checks.turning,
    "yaw_forms": case_checks.yaw_forms,
    "overshoots": case_checks.overshoot_table,
}
MADE = re.compile(r"<!-- made: (\w+) -->\n.*?<!-- end -->", re.DOTALL)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with a folder for each campaign")
    parser.add_argument("--only", choices=CASES, help="one of them")
    parser.add_argument(
        "--results", type=Path, help="keep the results here; those that are there are not made again"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the pages")
    a = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        for name in [a.only] if a.only else CASES:
            case = Case(a.data / name, (a.results or Path(scratch)) / name)
            if not (case.results / "report.json").is_file():
                run(case)
            for path in write(case, name, a.out):
                print(path)
    return 0


def run(case: Case) -> None:
    """The campaign from bytes to report, by the command line."""
    case.results.parent.mkdir(parents=True, exist_ok=True)
    words = [
        sys.executable,
        "-m",
        "seatrial",
        "run",
        str(case.campaign),
        "--out",
        str(case.results),
        "--quiet",
    ]
    subprocess.run(words, check=True)


def write(case: Case, name: str, out: Path) -> list[Path]:
    """The pictures of a page, and the page with its numbers."""
    page = out / f"{name}.md"
    (out / "pictures").mkdir(parents=True, exist_ok=True)
    pictures = all_of(case, out / "pictures", name, CASES[name])
    page.write_text(filled(page.read_text(encoding="utf-8"), case), encoding="utf-8")
    return [page, *pictures]


def filled(text: str, case: Case) -> str:
    """A page with all that is made of results made anew."""

    def block(found: re.Match[str]) -> str:
        made = BLOCKS[found[1]](case).rstrip()
        return f"<!-- made: {found[1]} -->\n\n{made}\n\n<!-- end -->"

    return MADE.sub(block, text)


if __name__ == "__main__":
    raise SystemExit(main())
