"""Tables of numbers: delimited text and MATLAB files."""

from ingest.reader import Reader
from ingest.tabular.delimited import DELIMITED

READERS: tuple[Reader, ...] = (DELIMITED,)
