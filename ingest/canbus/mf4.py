"""ASAM MDF 4 with CAN frames, through python-can and asammdf (the extra ``mf4``)."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ingest.canbus.candump import clock_of
from ingest.canbus.frames import Capture, Frames, no_frames
from ingest.errors import DataError
from ingest.log import Finding

if TYPE_CHECKING:
    from can import Message

MAGIC = (b"MDF     4.", b"UnFinMF 4.")


class ExtraMissing(DataError):
    """A format whose library is not installed."""

    def __init__(self, format_name: str, library: str, extra: str) -> None:
        self.format_name, self.library, self.extra = format_name, library, extra
        super().__init__(
            f"reading {format_name} needs {library}: install it with pip install 'seatrial[{extra}]'."
        )


def sniff(head: bytes) -> float:
    """How sure the first bytes are of MDF 4."""
    return 0.95 if head.startswith(MAGIC) else 0.0


def read(data: memoryview) -> Capture:
    """CAN frames of an MDF 4 file."""
    try:
        import asammdf  # noqa: F401
        from can.io import MF4Reader
    except ImportError as error:
        raise ExtraMissing("MF4", "asammdf", "mf4") from error
    messages: list[Message] = []
    findings: tuple[Finding, ...] = ()
    try:
        with MF4Reader(io.BytesIO(bytes(data))) as reader:
            messages.extend(reader)
    except MemoryError:
        raise
    except Exception as error:  # of a damaged file asammdf lets through whatever its parsing meets
        if not messages:
            raise ValueError(f"no CAN frames that asammdf can read: {error}") from error
        findings = (Finding("damaged", f"asammdf gave up after {len(messages)} frames: {error}", 0),)
    frames = frames_of(messages)
    return Capture(frames, {}, findings, 0, clock_of(frames.time_ns))


def frames_of(messages: Iterable[Message]) -> Frames:
    """python-can's messages as columns; only classic data frames."""
    kept = [m for m in messages if not (m.is_remote_frame or m.is_error_frame or m.is_fd) and m.dlc <= 8]
    if not kept:
        return no_frames()
    block = b"".join(bytes(m.data).ljust(8, b"\0") for m in kept)
    names = list(dict.fromkeys(str(m.channel) for m in kept))
    return Frames(
        np.rint(np.array([m.timestamp for m in kept]) * 1e9).astype(np.int64),
        np.array([m.arbitration_id for m in kept], np.uint32),
        np.array([m.is_extended_id for m in kept], np.bool_),
        np.array([names.index(str(m.channel)) for m in kept], np.int16),
        np.array([m.dlc for m in kept], np.uint8),
        np.frombuffer(block, np.uint8).reshape(-1, 8),
        tuple(names),
    )
