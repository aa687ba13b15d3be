"""The reader of a CAN log: a transport that yields frames, and the decoding that all of them share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ingest.canbus.frames import Capture
from ingest.canbus.stamps import repaired
from ingest.reader import Decoded, Reader, ReadOptions


def can_reader(
    name: str,
    suffixes: tuple[str, ...],
    sniff: Callable[[bytes], float],
    transport: Callable[[memoryview], Capture],
) -> Reader:
    """A reader for a transport of CAN frames."""

    def read(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
        from ingest.canbus.decoding import decoded  # with the databases of NMEA 2000, which take long to load

        return decoded(repaired(transport(data)), options)

    return Reader(name, suffixes, sniff, read)
