"""MAVLink and its relatives: tlog, ArduPilot DataFlash (binary and text), PX4 ULog."""

from ingest.mavlink.tlog import TLOG

READERS = (TLOG,)
