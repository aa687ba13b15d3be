"""The readers of MCAP files and ROS 2 bags."""

from __future__ import annotations

from pathlib import Path

from ingest.reader import Decoded, Reader, ReadOptions

_MCAP = b"\x89MCAP0\r\n"
_SQLITE = b"SQLite format 3\x00"


def sniff_mcap(head: bytes) -> float:
    """Whether the bytes begin as an MCAP file does."""
    return 1.0 if head.startswith(_MCAP) else 0.0


def sniff_bag(head: bytes) -> float:
    """How sure a database is a ROS 2 bag: whether its schema has the tables of one."""
    if not head.startswith(_SQLITE):
        return 0.0
    return 0.95 if b"CREATE TABLE topics" in head and b"CREATE TABLE messages" in head else 0.2


def read_mcap(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Read an MCAP file, finished or not.

    Raises
    ------
    ValueError
        Where no message could be decoded.
    """
    from ingest.ros.gathering import finish, gather
    from ingest.ros.records import Contents, batches

    contents = Contents()
    gathered = gather(batches(data, contents), contents.channels, options.topics)
    return finish(gathered, contents.findings, contents.damaged, options.topics)


def read_bag(path: Path, data: memoryview, options: ReadOptions) -> Decoded:
    """Read a ROS 2 bag in SQLite form.

    Raises
    ------
    ValueError
        Where the database is no bag, or no message could be decoded.
    """
    import sqlite3

    from ingest.ros.bag import batches, channels_of, database
    from ingest.ros.gathering import finish, gather
    from ingest.ros.records import Contents

    contents = Contents()
    try:
        with database(path, data) as connection:
            channels = channels_of(connection)
            gathered = gather(batches(connection, contents), channels, options.topics)
    except sqlite3.DatabaseError as error:
        raise ValueError(f"not a readable bag ({error})") from error
    return finish(gathered, contents.findings, contents.damaged, options.topics)


MCAP = Reader("mcap", (".mcap",), sniff_mcap, read_mcap)
ROSBAG2 = Reader("rosbag2", (".db3",), sniff_bag, read_bag)
