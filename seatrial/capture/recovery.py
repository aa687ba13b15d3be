"""Mend an MCAP file that was never finished, or is damaged: everything that can be read, in a whole file."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ingest.errors import UnreadableLog, UsageError
from ingest.log import Finding
from ingest.looks import HEAD, looks_like
from ingest.ros.records import Batch, Channel, Contents, batches
from seatrial.capture.recording_file import Message, RecordingFile
from seatrial.capture.records import ChannelSpec
from seatrial.writable import check_file

#: Messages of so many bytes make a chunk.
CHUNK_BYTES = 1 << 18
#: Publish time and log time stand before a message's payload, eight bytes each.
_TIMES = struct.Struct("<QQ")


@dataclass(frozen=True)
class Recovered:
    """What was mended.

    Attributes
    ----------
    path : Path
        The whole file; the damaged one itself where there was nothing to mend.
    messages : int
    findings : tuple of Finding
        What was wrong; empty where nothing was.
    """

    path: Path
    messages: int
    findings: tuple[Finding, ...]


def recover(path: Path, out: Path | None = None) -> Recovered:
    """Write everything that can be read of an MCAP file to a new one.

    Parameters
    ----------
    path : Path
        It is left as it is.
    out : Path, optional
        Default: ``NAME-recovered.mcap`` beside it. Nothing is written where nothing is wrong.

    Raises
    ------
    UsageError
        There is no such file, or ``out`` is there or cannot be written.
    UnreadableLog
        It holds no message.
    """
    out = out or path.with_name(f"{path.stem}-recovered.mcap")
    check_file(out, "--out")
    if not path.is_file():
        raise UsageError(f"{path}: there is no such file.")
    if out.exists():
        raise UsageError(f"{out}: there is such a file, and it is not overwritten; name another with --out.")
    data = mapped(path)
    contents = Contents()
    partial = out.with_name(f".{out.name}.partial-{os.getpid()}")
    try:
        count = rewrite(data, contents, partial)
        if not count:
            raise UnreadableLog(path, [f"mcap ({said(contents.findings)})"], "a file without a whole message")
        if not contents.findings:
            return Recovered(path, count, ())
        partial.rename(out)
    except ValueError as error:
        seen = looks_like(bytes(data[:HEAD]), len(data))
        raise UnreadableLog(path, [f"mcap ({error})"], seen) from error
    finally:
        partial.unlink(missing_ok=True)
    return Recovered(out, count, tuple(contents.findings))


def mapped(path: Path) -> memoryview:
    """The bytes of a file, without reading them."""
    return memoryview(np.memmap(path, np.uint8, mode="r")) if path.stat().st_size else memoryview(b"")  # type: ignore[arg-type]


def said(findings: list[Finding]) -> str:
    """What the findings say, in short."""
    return "; ".join(f.message for f in findings[:3]) or "no messages"


def rewrite(data: memoryview, contents: Contents, out: Path) -> int:
    """Write what can be read to a new file; how many messages that is."""
    file = RecordingFile(out)
    part: list[Message] = []
    size = 0
    for message in messages(data, contents):
        part.append(message)
        size += len(message.payload)
        if size >= CHUNK_BYTES:
            file.append(part)
            part, size = [], 0
    file.append(part)
    file.finish()
    return file.messages


def messages(data: memoryview, contents: Contents) -> Iterator[Message]:
    """Every message that can be read and whose channel is known."""
    specs: dict[int, tuple[Channel, ChannelSpec]] = {}
    for batch in batches(data, contents):
        for number, start, end in zip(
            batch.channel.tolist(), batch.start.tolist(), batch.end.tolist(), strict=True
        ):
            channel = contents.channels.get(number)
            if channel is None:
                continue
            if number not in specs or specs[number][0] is not channel:
                specs[number] = channel, spec_of(channel)
            yield message_at(batch, specs[number][1], start, end)


def message_at(batch: Batch, spec: ChannelSpec, start: int, end: int) -> Message:
    """The message whose payload is ``start:end``."""
    log_ns, publish_ns = _TIMES.unpack(batch.data[start - _TIMES.size : start].tobytes())
    return Message(spec, log_ns, publish_ns, batch.data[start:end].tobytes())


def spec_of(channel: Channel) -> ChannelSpec:
    """A channel as it is declared in a new file."""
    return ChannelSpec(
        channel.topic, channel.encoding, channel.schema, channel.schema_encoding,
        channel.definition, tuple(channel.metadata.items()),
    )  # fmt: skip
