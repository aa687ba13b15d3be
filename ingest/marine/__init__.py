"""Serial text and binary of ships' instruments: NMEA 0183, u-blox UBX, VectorNav text, interleaved."""

from ingest.marine.readers import NMEA0183, UBX
from ingest.reader import Reader

READERS: tuple[Reader, ...] = (NMEA0183, UBX)
"""Formats of this family."""
