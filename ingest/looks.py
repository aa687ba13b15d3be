"""What an unreadable file looks like, in a few words for a person."""

from __future__ import annotations

#: Bytes from the beginning that are looked at.
HEAD = 4096
MAGICS: tuple[tuple[bytes, str], ...] = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a zip archive (unpack it first; an xlsx sheet must be saved as CSV)"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive (unpack it first)"),
    (b"BZh", "a bzip2 file (unpack it first)"),
    (b"Rar!", "a rar archive (unpack it first)"),
    (b"\x04\x22\x4d\x18", "an lz4 file (unpack it first)"),
    (b"#ROSBAG V2.0", "a ROS 1 bag (convert it to MCAP with `mcap convert` or `rosbags-convert`)"),
    (b"\x89HDF", "an HDF5 file"),
    (b"MATLAB", "a MATLAB file"),
    (b"SQLite format 3", "an SQLite database"),
    (b"\x89MCAP0\r\n", "an MCAP file"),
    (b"ULog", "a PX4 ULog"),
    (b"PAR1", "a Parquet file"),
    (b"\x0a\x0d\x0d\x0a", "a pcapng capture"),
    (b"\xd4\xc3\xb2\xa1", "a pcap capture"),
    (b"\x7fELF", "a program"),
    (b"<!DOCTYPE", "an HTML page"),
    (b"<html", "an HTML page"),
    (b"{", "JSON text"),
)


def looks_like(head: bytes, size: int) -> str:
    """Describe a file by its first bytes.

    Parameters
    ----------
    head : bytes
        The first few kilobytes.
    size : int
        Length of the file.
    """
    if not size:
        return "an empty file"
    if not head.strip(b"\0"):
        return f"{size} bytes of which the first {len(head)} are zero"
    for magic, name in MAGICS:
        if head.startswith(magic):
            return name
    return text_like(head) or f"binary data of {size} bytes that start with {head[:8].hex(' ')}"


def text_like(head: bytes) -> str | None:
    """Give a description of text by its first line that is not blank; None where it is not text."""
    sample = head[:2048]
    printable = sum(32 <= b < 127 or b in b"\t\r\n" or b >= 160 for b in sample)
    if printable < 0.95 * len(sample):
        return None
    line = next((x for x in sample.decode("latin-1").splitlines() if x.strip()), "").strip()
    return f"text whose first line is '{line[:60]}{'…' if len(line) > 60 else ''}'"
