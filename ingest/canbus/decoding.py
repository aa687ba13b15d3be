"""From the frames of a CAN log to tables and sources: NMEA 2000, and DBC messages where a file says them."""

from __future__ import annotations

from dataclasses import replace

from ingest.canbus import n2k, utc
from ingest.canbus.frames import Capture
from ingest.canbus.sources import instance_tables, sources
from ingest.log import Finding, Source
from ingest.reader import Decoded, ReadOptions


def decoded(capture: Capture, options: ReadOptions) -> Decoded:
    """Tables by PGN, and by DBC message where a DBC file is given.

    Raises
    ------
    ValueError
        There are no frames, or none that can be decoded.
    """
    if not len(capture.frames) and not capture.packets:
        raise ValueError("no CAN frames")
    from_dbc, named = n2k.Tables({}, {}), tuple[Source, ...]()
    rest = capture
    if options.dbc is not None:
        from ingest.canbus.dbc import decode_dbc, named_sources

        from_dbc, left = decode_dbc(capture.frames, options.dbc)
        named = named_sources(from_dbc)
        rest = replace(capture, frames=left)
    topics = (
        None if options.topics is None else options.topics | {t.partition("[")[0] for t in options.topics}
    )
    found = n2k.decode(
        rest, lambda pgn, name: topics is None or bool({name, str(pgn)} & topics) or pgn in utc.TIMES
    )
    tables = {**found.tables, **from_dbc.tables}
    if not tables and topics is None:
        raise ValueError("CAN frames, but none of NMEA 2000; a DBC file can tell what they mean: [can] dbc")
    zero, clock_findings = utc_origin(capture, found)
    notes = (*clock_findings, *undescribed(rest))
    findings = (*capture.findings, *found.findings, *from_dbc.findings, *notes)
    wanted = {t: v for t, v in tables.items() if topics is None or asked_for(t, topics)}
    wanted |= instance_tables(wanted)
    units = {**found.units, **from_dbc.units}
    return Decoded(
        wanted,
        {
            (t, str(c)): units[key]
            for t, v in wanted.items()
            for c in v
            if (key := (t.partition("[")[0], str(c))) in units
        },
        zero,
        findings,
        found.messages + from_dbc.messages,
        capture.bytes_damaged,
        tuple(sorted((*sources(wanted), *(s for s in named if s.topic in wanted)), key=lambda s: -s.rank)),
        senders={t: who for t, who in from_dbc.senders.items() if t in wanted},
    )


def undescribed(capture: Capture) -> tuple[Finding, ...]:
    """A note on frames with 11-bit identifiers, which NMEA 2000 does not use."""
    count = int((~capture.frames.extended).sum())
    if not count:
        return ()
    message = f"{count} frames with 11-bit identifiers; a DBC file can tell what they mean: [can] dbc"
    return (Finding("unknown", message, count=count),)


def asked_for(topic: str, topics: frozenset[str]) -> bool:
    """Whether to keep a table: those with the time were decoded for the clock's sake."""
    numbers = {name: str(pgn) for pgn, name in utc.TIMES.items()}
    return topic not in numbers or bool({topic, numbers[topic]} & topics)


def utc_origin(capture: Capture, found: n2k.Tables) -> tuple[int | None, tuple[Finding, ...]]:
    """UTC at index 0, and what there is to say about it."""
    if capture.clock == "utc":
        return 0, utc.disagreement(found.tables)
    return utc.utc_of_zero(found.tables), ()
