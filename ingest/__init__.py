"""From the bytes of a log to its columns: ``read_log`` reads every format, found by its content."""

from ingest.errors import MissingLog, SeatrialError, UnreadableLog
from ingest.log import SOURCE, Finding, Log, Source
from ingest.open import read_log
from ingest.reader import Decoded, Reader, ReadOptions

__all__ = [
    "SOURCE", "Decoded", "Finding", "Log", "MissingLog", "ReadOptions", "Reader", "SeatrialError", "Source",
    "UnreadableLog", "read_log",
]  # fmt: skip
