"""The start-up check: every stage is the one that was installed beside this program."""

from __future__ import annotations

import importlib.util
from pathlib import Path

#: A file that only this program's stage has.
STAGES = {
    "ingest": "log.py",
    "preprocess": "trial.py",
    "identify": "fit.py",
    "validate": "diagnosis.py",
}
#: Other distributions that bring a package of the same name.
NAMESAKES = {"identify": "identify", "validate": "configobj"}

CURE = (
    "Give Seatrial an environment of its own: `make`, `uv tool install seatrial` or `pipx install seatrial`."
)


def foreign_stage(root: Path | None = None) -> str | None:
    """What stands in the place of a stage, as a sentence; None where all is well.

    Parameters
    ----------
    root : Path, optional
        Folder that holds the stages; default: the one that holds ``seatrial``.
    """
    root = root or Path(__file__).resolve().parents[1]
    for stage, mark in STAGES.items():
        found = folder_of(stage)
        if found != root / stage or not (root / stage / mark).is_file():
            where = found or "nowhere"
            return f"the package '{stage}' is not Seatrial's own ({where} in place of {root / stage}). {CURE}"
    for stage, other in NAMESAKES.items():
        if next(root.glob(f"{other}-*.dist-info"), None):
            return f"the distribution '{other}' overwrites the package '{stage}' in {root}. {CURE}"
    return None


def folder_of(package: str) -> Path | None:
    """Where Python would import a package from."""
    spec = importlib.util.find_spec(package)
    return Path(spec.origin).resolve().parent if spec and spec.origin else None
