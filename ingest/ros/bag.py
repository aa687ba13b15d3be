"""ROS 2 bags in SQLite form (``.db3``)."""

from __future__ import annotations

import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np

from ingest.log import Finding
from ingest.ros.records import BATCH, Batch, Channel, Contents

MAGIC = b"SQLite format 3\x00"


@contextmanager
def database(path: Path, data: memoryview) -> Iterator[sqlite3.Connection]:
    """Open a bag for reading; one that came out of a packed file goes through a temporary one."""
    with path.open("rb") as file:
        plain = file.read(len(MAGIC)) == MAGIC
    with tempfile.TemporaryDirectory() as folder:
        place = path if plain else Path(folder) / "bag.db3"
        if not plain:
            place.write_bytes(data)
        with closing(
            sqlite3.connect(f"{place.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        ) as connection:
            yield connection


def channels_of(connection: sqlite3.Connection) -> dict[int, Channel]:
    """Return the topics of a bag, with the definitions that newer bags carry."""
    texts: dict[str, tuple[str, bytes]] = {}
    if connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone():
        rows = connection.execute(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        )
        texts = {name: (encoding, str(text).encode()) for name, encoding, text in rows}
    topics = connection.execute("SELECT id, name, type, serialization_format FROM topics")
    return {
        number: Channel(str(name), str(encoding), str(kind), *texts.get(kind, ("ros2msg", b"")))
        for number, name, kind, encoding in topics
    }


def batches(connection: sqlite3.Connection, contents: Contents) -> Iterator[Batch]:
    """Messages of a bag in pieces of bounded size; a broken page ends the reading of what follows it."""
    rows = connection.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
    held: list[tuple[int, int, bytes]] = []
    size = 0
    try:
        for row in rows:
            if not (isinstance(row[0], int) and isinstance(row[1], int) and isinstance(row[2], bytes)):
                contents.findings.append(Finding("damaged", "a row of the table of messages is garbled"))
                continue
            held.append(row)
            size += len(row[2])
            if size > BATCH:
                yield _batch(held)
                held, size = [], 0
    except sqlite3.DatabaseError as error:
        contents.findings.append(Finding("damaged", f"the database is broken ({error}); read up to there"))
    if held:
        yield _batch(held)


def _batch(rows: list[tuple[int, int, bytes]]) -> Batch:
    sizes = np.array([len(r[2]) for r in rows], np.int64)
    end = np.cumsum(sizes)
    return Batch(
        np.frombuffer(b"".join(r[2] for r in rows), np.uint8),
        np.array([r[0] for r in rows], np.int64),
        end - sizes,
        end,
        np.array([r[1] for r in rows], np.int64),
    )
