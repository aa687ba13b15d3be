"""Which receiver, or which message, a quantity comes from: what comes from one has one clock."""

from __future__ import annotations

import re

import numpy as np

from ingest.log import SOURCE, Log, Source

#: Messages of u-blox receivers, and of GNSS receivers on NMEA 2000: each of the latter has an address of its own.
_UBX = re.compile(r"(NAV2?|HNR)-")
_N2K = ("positionRapidUpdate", "gnssPositionData", "cogSogRapidUpdate")


def sender_of(log: Log, source: Source) -> str:
    """Name of the receiver that a position or velocity comes from, else of the message.

    A satellites' receiver sends both in several sentences of one epoch (NMEA 0183, UBX, NMEA 2000), in several
    messages of one node (DBC), or in several topics with the same stamps (ROS); elsewhere what stands in one message is
    of one moment. A row of a table is no message, and a node may send what others measure: there, velocities along the
    hull's axes are those of another sensor, and velocities over ground those of the receiver.
    """
    from ingest.marine.definitions import GNSS_TALKERS

    device = "" if source.device is None else f"[{source.device}]"
    table = log.tables[source.topic]
    if "talker" in table and SOURCE not in table:
        talkers = {str(x) for x in table["talker"].unique()}
        return "GNSS" if talkers <= GNSS_TALKERS else "+".join(sorted(talkers))
    if _UBX.match(source.topic):
        return "GNSS"
    if source.topic in _N2K and SOURCE in table:
        found = np.unique(table[SOURCE].dropna().to_numpy(np.int64))
        own = source.device if source.device is not None else int(found[0]) if len(found) == 1 else None
        return source.topic if own is None else f"receiver [{own}]"
    if source.topic.startswith("/"):
        return _first_of_epoch(log, source.topic)
    said = log.senders.get(source.topic)
    along = "forward" in source.fields and (said or not source.topic)
    return f"{said or source.topic}{device}" + (" along the hull" if along else "")


def _first_of_epoch(log: Log, topic: str) -> str:
    """The first, by name, of the topics that have the stamps of one, but for some that were lost; of sensors' first."""
    stamps, sensors = log.tables[topic].index.to_numpy(), {s.topic for s in log.sources}
    same = [t for t, x in log.tables.items() if t == topic or _same(stamps, x.index.to_numpy())]
    return min(same, key=lambda t: (t not in sensors, t))


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two series of stamps are the same, but for a tenth of each at most."""
    shared = np.isin(one, other).sum()
    return bool(min(len(one), len(other)) > 0 and shared > 0.9 * max(len(one), len(other)))
