"""CAN logs: transports that yield frames as columns, and decoders (NMEA 2000, DBC) that make tables."""

from __future__ import annotations

from ingest.canbus import actisense, asc, blf, can_table, candump, mf4, trc, ydraw
from ingest.canbus.reader import can_reader
from ingest.reader import Reader

READERS: tuple[Reader, ...] = (
    can_reader("candump", (".log",), candump.sniff, candump.read),
    can_reader("asc", (".asc",), asc.sniff, asc.read),
    can_reader("blf", (".blf",), blf.sniff, blf.read),
    can_reader("trc", (".trc",), trc.sniff, trc.read),
    can_reader("can-csv", (".csv",), can_table.sniff, can_table.read),
    can_reader("mf4", (".mf4",), mf4.sniff, mf4.read),
    can_reader("actisense", (".raw", ".txt"), actisense.sniff, actisense.read),
    can_reader("ydraw", (".raw", ".txt"), ydraw.sniff, ydraw.read),
)
