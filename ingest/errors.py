"""Every error that a user may meet, in one tree; each is built from facts and says how to cure it.

::

    SeatrialError
    ├── UsageError            exit status 2: the command line or campaign.toml is wrong
    │   ├── CampaignError         a key or a value in campaign.toml
    │   ├── MissingLog            a file that is not there
    │   │   └── FolderGiven           a folder where a file is expected
    │   └── MissingSignal         a named signal that is not in the log
    │       └── NoStandardMessage     nor one that need not be named
    └── DataError             exit status 1: the data cannot give an answer
        ├── UnreadableLog         no usable record in the file
        ├── MissingQuantity       no position, or no heading
        ├── NotIdentifiable       nothing can be identified from these trials
        └── NothingToValidate     no log, or part of one, is left to validate on
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import ClassVar

#: Formats that were tried are named up to so many: more would hide what the file is.
MOST_NAMED = 3


def nearest(name: str, known: Iterable[str], most: int = 3) -> list[str]:
    """The known names that are closest to ``name``, best first, letter case ignored."""
    by_lower = {k.lower(): k for k in known}
    return [by_lower[m] for m in difflib.get_close_matches(name.lower(), by_lower, n=most, cutoff=0.5)]


class SeatrialError(Exception):
    """Base of all errors that are reported to the user without a traceback."""

    exit_status = 1
    #: What else there is to say to who looks for the cause.
    details = ""


class UsageError(SeatrialError):
    """The command line or the campaign file is wrong."""

    exit_status = 2


class CampaignError(UsageError):
    """A key or a value in ``campaign.toml`` is wrong."""

    def __init__(
        self, path: Path, key: str, expected: str, found: str, nearest_key: str | None = None
    ) -> None:
        self.path, self.key, self.nearest_key = path, key, nearest_key
        self.expected, self.found = expected, found
        hint = f" Did you mean '{nearest_key}'?" if nearest_key else ""
        super().__init__(f"{path}: {key}: expected {expected}, found {found}.{hint}")


class MissingLog(UsageError):
    """A log file is not there: one that the campaign names (``named_in``), or that was asked for."""

    def __init__(self, path: Path, named_in: str, near: list[str]) -> None:
        self.path, self.near = path, near
        hint = f" Nearest there: {', '.join(near)}." if near else ""
        super().__init__(f"{f'{named_in}: the' if named_in else 'The'} log {path} is not there.{hint}")


class FolderGiven(MissingLog):
    """A folder stands where a log file is expected."""

    def __init__(self, path: Path, files: list[str]) -> None:
        self.path, self.near, self.files = path, files[:5], files
        more = f" and {len(files) - 5} more" if len(files) > 5 else ""
        there = f" Files in it: {', '.join(files[:5])}{more}." if files else " There are no files in it."
        UsageError.__init__(self, f"{path}: expected a log file, found a folder.{there}")


class MissingSignal(UsageError):
    """A signal that the campaign names is not in the log."""

    def __init__(self, path: Path, key: str, signal: str, known: Iterable[str], reason: str = "") -> None:
        self.path, self.key, self.signal = path, key, signal
        names = list(known)
        near = nearest(signal, names) or names[:5]
        hint = f" Nearest there: {', '.join(near)}." if near else ""
        super().__init__(f"{path}: {key} names the signal '{signal}', which is not in the log{reason}.{hint}")


class NoStandardMessage(MissingSignal):
    """An input of a kind is to be found by its standard message, which the log does not have."""

    #: The standard messages of each kind, and what signals that may be meant have in their names.
    KINDS: ClassVar[Mapping[str, tuple[str, tuple[str, ...]]]] = {
        "rudder": ("NMEA 0183 RSA; NMEA 2000 127245", ("rudder", "helm", "steer")),
        "propeller": ("NMEA 0183 RPM; NMEA 2000 127488 or 127489", ("propeller", "rpm", "engine", "shaft")),
    }

    def __init__(self, path: Path, name: str, kind: str, known: Iterable[str]) -> None:
        self.path, self.key, self.signal = path, f"inputs.{name}", ""
        messages, words = self.KINDS.get(kind, ("there is none", ()))
        near = [n for n in known if any(w in n.lower() for w in words)][:5]
        hint = f"Nearest there: {', '.join(near)}." if near else "'seatrial inspect' shows what there is."
        UsageError.__init__(
            self,
            f"{path}: inputs.{name} names no signal, and the log has no standard message of a {kind} ({messages}): "
            f"expected signal = TOPIC.FIELD. {hint}",
        )


class DataError(SeatrialError):
    """The data cannot give an answer."""

    exit_status = 1


class UnreadableLog(DataError):
    """No usable record in a file."""

    def __init__(self, path: Path, tried: Iterable[str], looks_like: str) -> None:
        self.path, self.tried, self.looks_like = path, tuple(tried), looks_like
        self.details = f"{path}: tried {', '.join(self.tried)}."
        many = len(self.tried) > MOST_NAMED
        which = f"none of {len(self.tried)} formats fits" if many else f"tried {', '.join(self.tried)}"
        super().__init__(f"{path}: no usable record: the file looks like {looks_like}; {which}.")


class MissingQuantity(DataError):
    """A log has no position or no heading."""

    def __init__(self, path: Path, quantity: str, consequence: str, cure: str) -> None:
        self.path, self.quantity = path, quantity
        super().__init__(f"{path}: no {quantity} in this log; {consequence}. {cure}")


class NotIdentifiable(DataError):
    """The trials cannot identify the model that was asked for."""


class NothingToValidate(DataError):
    """No log, or part of one, is left to validate on; ``divided``: where the last third of each log is to validate."""

    def __init__(self, path: Path, divided: bool) -> None:
        self.path, self.divided = path, divided
        whose = "the last third of no log" if divided else 'no log with role = "validate"'
        longer = "Use logs that last for more than 15 s, or give" if divided else "Give"
        super().__init__(
            f"{path}: nothing is left to validate on: {whose} has an unbroken stretch of five seconds with position, "
            f'heading and inputs. {longer} role = "validate" to a log that has one; --no-loop identifies without.'
        )
