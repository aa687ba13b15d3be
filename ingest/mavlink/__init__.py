"""MAVLink and its relatives: tlog, ArduPilot DataFlash (binary and text), PX4 ULog."""

from ingest.mavlink.dataflash import DATAFLASH
from ingest.mavlink.dataflash_text import DATAFLASH_TEXT
from ingest.mavlink.tlog import TLOG
from ingest.mavlink.ulog import ULOG

READERS = (TLOG, DATAFLASH, DATAFLASH_TEXT, ULOG)
