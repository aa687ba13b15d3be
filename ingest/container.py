"""From a file to its bytes: memory-mapped where it is plain, unpacked where it is gzip, zstd or xz."""

from __future__ import annotations

import lzma
import mmap
import tempfile
import zlib
from codecs import BOM_UTF8
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Protocol

from ingest.log import Finding

#: Packed bytes per step: little enough that what comes out of a bomb in one step still fits in memory.
CHUNK = 1 << 13
#: An unpacked log larger than this goes to an unnamed temporary file and is mapped from there.
IN_MEMORY = 64 << 20
#: Unpacking stops here: a bomb fills neither memory nor disk.
LARGEST = 32 << 30
#: Text in UTF-16 is told by its mark and by this share of zeros among every other byte of so many.
HEAD, MOSTLY = 1 << 12, 0.9

GZIP, XZ, ZSTD = b"\x1f\x8b\x08", b"\xfd7zXZ\x00", b"\x28\xb5\x2f\xfd"
INNER_SUFFIXES = (".gz", ".xz", ".zst")


class Decompressor(Protocol):
    """What the decompressors of zlib, lzma and zstandard have in common."""

    @property
    def eof(self) -> bool:
        """Whether the end of the member was reached."""

    @property
    def unused_data(self) -> bytes:
        """Bytes after the end of the member."""

    def decompress(self, data: bytes, /) -> bytes:
        """Unpack the next piece."""


@dataclass(frozen=True)
class Contents:
    """The bytes of a log.

    Attributes
    ----------
    data : memoryview
        The whole file, unpacked; read-only.
    packed : str, optional
        ``"gzip"``, ``"xz"`` or ``"zstd"``.
    findings : tuple of Finding
        What was wrong with the packing.
    before : int
        Bytes before ``data``: a mark that says that the text is UTF-8.
    """

    data: memoryview
    packed: str | None = None
    findings: tuple[Finding, ...] = ()
    before: int = 0

    def placed(self, findings: Iterable[Finding]) -> tuple[Finding, ...]:
        """What was found in ``data``, by offset in the file."""
        return tuple(f if f.offset is None else replace(f, offset=f.offset + self.before) for f in findings)


def packing(head: bytes) -> str | None:
    """Name of the compression that ``head`` starts with, if any."""
    names = {GZIP: "gzip", XZ: "xz", ZSTD: "zstd"}
    return next((name for magic, name in names.items() if head.startswith(magic)), None)


def open_contents(path: Path) -> Contents:
    """Map or unpack a file.

    A packed file that ends early or is damaged is unpacked as far as it goes, with a finding.
    """
    with path.open("rb") as file:
        packed = packing(file.read(8))
        file.seek(0)
        return recoded(Contents(map_file(file)) if packed is None else unpack(file, packed))


def recoded(contents: Contents) -> Contents:
    """Text in UTF-16, as Windows writes it, in UTF-8, and without a mark of either: what is no text stays as it is."""
    head = bytes(contents.data[:HEAD])
    if head.startswith(BOM_UTF8):
        return replace(contents, data=contents.data[len(BOM_UTF8) :], before=len(BOM_UTF8))
    wide = {b"\xff\xfe": 1, b"\xfe\xff": 0}.get(head[:2])
    if wide is None or head[2 + wide :: 2].count(0) < MOSTLY * len(head[2 + wide :: 2]) or len(head) < 4:
        return contents
    text = bytes(contents.data[: len(contents.data) & ~1]).decode("utf-16", "replace").encode()
    note = Finding("note", "text in UTF-16: bytes are counted as they are in UTF-8")
    return replace(contents, data=memoryview(text), findings=(*contents.findings, note))


def map_file(file: IO[bytes]) -> memoryview:
    """Give the file as a read-only memory map (empty files cannot be mapped)."""
    file.seek(0, 2)
    if file.tell() == 0:
        return memoryview(b"")
    return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))


def unpack(file: IO[bytes], packed: str) -> Contents:
    """Unpack all members of a compressed file, in pieces."""
    findings: list[Finding] = []
    with tempfile.SpooledTemporaryFile(max_size=IN_MEMORY) as out:
        size = 0
        for piece in pieces(file, packed, findings):
            size += out.write(piece)
            if size > LARGEST:
                findings.append(Finding("truncated", f"unpacked only the first {size} bytes", offset=size))
                break
        if size <= IN_MEMORY:
            out.seek(0)
            return Contents(memoryview(out.read()), packed, tuple(findings))
        out.rollover()
        return Contents(map_file(out), packed, tuple(findings))


def pieces(file: IO[bytes], packed: str, findings: list[Finding]) -> Iterator[bytes]:
    """Unpacked pieces of a compressed file; what went wrong is appended to ``findings``."""
    state, size, fresh = new_decompressor(packed), 0, True
    while chunk := file.read(CHUNK):
        while chunk:
            try:
                piece = state.decompress(chunk)
            except (zlib.error, lzma.LZMAError, EOFError) as error:
                findings.append(Finding("damaged", f"{packed} stream is broken ({error})", offset=size))
                return
            fresh = False
            size += len(piece)
            yield piece
            chunk = b""
            if state.eof:
                chunk = state.unused_data.lstrip(b"\0")
                state, fresh = new_decompressor(packed), True
    if not fresh:
        findings.append(Finding("truncated", f"{packed} stream ends early", offset=size))


def new_decompressor(packed: str) -> Decompressor:
    """Give a decompressor for one member."""
    if packed == "gzip":
        return zlib.decompressobj(wbits=31)
    if packed == "xz":
        return lzma.LZMADecompressor()
    return ZstdDecompressor()


class ZstdDecompressor:
    """zstandard's decompression object, with its errors turned into ``EOFError``."""

    def __init__(self) -> None:
        import zstandard

        self._error = zstandard.ZstdError
        self._object = zstandard.ZstdDecompressor().decompressobj()
        self.eof = False
        self.unused_data = b""

    def decompress(self, data: bytes, /) -> bytes:
        """Unpack the next piece."""
        try:
            piece: bytes = self._object.decompress(data)
        except self._error as error:
            raise EOFError(str(error)) from error
        self.eof, self.unused_data = self._object.eof, self._object.unused_data
        return piece
