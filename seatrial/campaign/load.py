"""From the bytes of ``campaign.toml`` to a ``Campaign``, or to the error that says what is wrong with it."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ingest.errors import CampaignError, MissingLog, UsageError, nearest
from seatrial.campaign.build import campaign_of
from seatrial.campaign.data import Campaign
from seatrial.campaign.faults import campaign_error, faults_of, nearest_one
from seatrial.campaign.rules import faults_in
from seatrial.campaign.tables import CampaignTable

FILENAME = "campaign.toml"
#: How sure a reader is of what it takes for a log.
LIKELY = 0.25


def load_campaign(path: str | os.PathLike[str]) -> Campaign:
    """Read and check a campaign.

    Parameters
    ----------
    path : path-like
        The file, or the folder that holds a ``campaign.toml``.

    Returns
    -------
    Campaign

    Raises
    ------
    CampaignError
        A key or a value is wrong; where several are, the others are notes of the error.
    MissingLog
        A log that it names is not there.
    UsageError
        There is no such file.
    """
    file = campaign_file(Path(path))
    table = checked(file, parsed(file))
    campaign = campaign_of(file, table)
    check_files(campaign)
    return campaign


def campaign_file(path: Path) -> Path:
    """The file that a path means."""
    file = path / FILENAME if path.is_dir() else path
    if file.is_file():
        return file
    near = nearest(file.name, names_in(file.parent, "*.toml"))
    hint = f" Nearest there: {', '.join(near)}." if near else ""
    init = f" `seatrial init {path}` writes one." if path.is_dir() else ""
    raise UsageError(f"{file}: the campaign is not there.{hint}{init}")


def names_in(folder: Path, pattern: str = "*") -> list[str]:
    """Names of the files in a folder; none where it is not there."""
    return sorted(p.name for p in folder.glob(pattern) if p.is_file()) if folder.is_dir() else []


def bytes_of(file: Path) -> bytes:
    """The bytes of the file, if they may be read."""
    try:
        return file.read_bytes()
    except OSError as error:
        reason = (error.strerror or type(error).__name__).lower()
        raise UsageError(f"{file}: the campaign cannot be read ({reason}).") from error


def parsed(file: Path) -> dict[str, Any]:
    """The file's tables as plain Python."""
    try:
        return tomllib.loads(bytes_of(file).decode("utf-8-sig"))
    except tomllib.TOMLDecodeError as error:
        check_no_log(file)
        what, _, where = str(error).rpartition(" (at ")
        place = where.rstrip(")") if what else "the file"
        raise CampaignError(file, place, "TOML", (what or str(error)).lower()) from error
    except UnicodeDecodeError as error:
        check_no_log(file)
        raise CampaignError(
            file, f"byte {error.start}", "UTF-8 text", f"byte 0x{error.object[error.start]:02x}"
        ) from error


def check_no_log(file: Path) -> None:
    """A log may have been given where its campaign is meant.

    Raises
    ------
    UsageError
        The file is not called as a campaign is, and is a log.
    """
    from ingest.open import HEAD
    from ingest.readers import READERS

    head = bytes_of(file)[:HEAD]
    best = max(READERS, key=lambda r: r.sniff(head))
    if file.suffix != ".toml" and best.sniff(head) > LIKELY:
        cure = f"`seatrial init {file.parent}` writes a {FILENAME} for the logs there"
        raise UsageError(f"{file}: expected a campaign, found a log ({best.name}); {cure}.")


def checked(file: Path, tables: dict[str, Any]) -> CampaignTable:
    """The tables, with every key known and every value possible."""
    paths = log_paths(tables)
    try:
        table = CampaignTable.model_validate(tables)
    except ValidationError as error:
        raise campaign_error(file, faults_of(error), paths) from error
    faults = faults_in(table)
    if faults:
        raise campaign_error(file, faults, paths)
    return table


def log_paths(tables: dict[str, Any]) -> list[str]:
    """Paths of the logs as far as they are written."""
    logs = tables.get("log")
    return (
        [str(log.get("path", "")) for log in logs if isinstance(log, dict)] if isinstance(logs, list) else []
    )


def check_each_once(campaign: Campaign) -> None:
    """No log may be named twice, however its path is written: its results would overwrite each other."""
    first: dict[Path, str] = {}
    for number, log in enumerate(campaign.logs, 1):
        name = first.setdefault(log.file.resolve(), log.path)
        if name != log.path:
            place = f"[[log]] {number} ({log.path}) path"
            again = f"'{name}' a second time, as '{log.path}'"
            raise CampaignError(campaign.path, place, "a log that is not named yet", again)


def check_files(campaign: Campaign) -> None:
    """Every file that the campaign names must be there."""
    for number, log in enumerate(campaign.logs, 1):
        if log.file.is_dir():
            raise CampaignError(
                campaign.path, f"[[log]] {number} path", "the path of a log file", f"the folder {log.file}"
            )
        if not log.file.is_file():
            near = nearest(log.file.name, names_in(log.file.parent))
            raise MissingLog(log.file, f"{campaign.path}: [[log]] {number}", near)
    check_each_once(campaign)
    if campaign.dbc is not None and not campaign.dbc.is_file():
        closest = nearest_one(campaign.dbc.name, names_in(campaign.dbc.parent))
        raise CampaignError(
            campaign.path, "[can] dbc", "the path of a DBC file", f"no file at {campaign.dbc}", closest
        )
