"""Tables of numbers: delimited text and MATLAB files."""

from ingest.reader import Reader
from ingest.tabular.delimited import DELIMITED
from ingest.tabular.matlab import MATLAB

READERS: tuple[Reader, ...] = (DELIMITED, MATLAB)
"""Formats of this family."""
