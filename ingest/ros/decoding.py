"""Messages of one channel to a table, by their encoding: CDR, JSON or protobuf."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ingest.log import Finding
from ingest.ros.program import MOST_ELEMENTS, BadDefinition, Definitions
from ingest.ros.records import Channel

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Decoded:
    """A table with a row for each good message, which messages those are, and what was odd."""

    table: pd.DataFrame
    good: NDArray[np.bool_]
    findings: tuple[Finding, ...] = ()


Decoder = Callable[[Channel, Bytes, Integers, Integers], Decoded]


def decode(channel: Channel, data: Bytes, start: Integers, end: Integers) -> Decoded | None:
    """Decode the messages ``data[start:end]`` of a channel; None where the encoding is not known."""
    decoder = DECODERS.get(channel.encoding.lower())
    if decoder is None:
        return None
    try:
        return decoder(channel, data, start, end)
    except BadDefinition as error:
        none = np.zeros(len(start), bool)
        text = f"cannot be decoded: {error}"
        return Decoded(
            pd.DataFrame(), none, (Finding("unknown", text, topic=channel.topic, count=len(start)),)
        )


def _cdr(channel: Channel, data: Bytes, start: Integers, end: Integers) -> Decoded:
    from ingest.ros.cdr import array_lengths, decode_cdr

    name = full_name(channel.schema)
    types, garbled = definitions(name, channel.schema_encoding, channel.definition)
    lengths = array_lengths(data, start, end, types, name)
    columns = decode_cdr(data, start, end, types, name, lengths)
    findings = [_broken(channel, int((~columns.good).sum()))] if not columns.good.all() else []
    if garbled:
        findings.append(
            Finding("note", "its definition is garbled; that of ROS 2 is used", topic=channel.topic)
        )
    if columns.left_out:
        text = f"arrays of more than {MOST_ELEMENTS} elements are left out: {', '.join(columns.left_out)}"
        findings.append(Finding("note", text, topic=channel.topic))
    return Decoded(with_yaw(columns.table), columns.good, tuple(findings))


def _broken(channel: Channel, count: int) -> Finding:
    return Finding(
        "damaged", f"{count} messages do not fit their definition", topic=channel.topic, count=count
    )


def full_name(name: str) -> str:
    """``package/msg/Type`` for a type that is written without the middle part."""
    return name if name.count("/") != 1 else name.replace("/", "/msg/")


@functools.lru_cache(maxsize=64)
def definitions(name: str, encoding: str, text: bytes) -> tuple[Definitions, bool]:
    """Definitions of a type and all that it needs, and whether the file's own are garbled.

    Those of ROS 2 itself stand in for what the file lacks.
    """
    from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

    standard: Definitions = get_typestore(Stores.ROS2_HUMBLE).fielddefs
    if not text.strip():
        return standard, False
    try:
        if encoding == "ros2idl":
            return {**standard, **get_types_from_idl(text.decode())}, False
        return {**standard, **get_types_from_msg(text.decode(), name)}, False
    except (TypesysError, ValueError, KeyError, IndexError, AssertionError) as error:
        if name not in standard:
            raise BadDefinition(f"the definition of '{name}' is garbled") from error
        return standard, True


def with_yaw(table: pd.DataFrame) -> pd.DataFrame:
    """Add the yaw of every orientation, as recorded (ROS: counter-clockwise from east), in ``…yaw``.

    The yaw of a quaternion, in the order z-y-x: Fossen (2011), eq. (2.73).
    """
    for path in [c[:-2] for c in table.columns if c.endswith("orientation.w") or c.endswith("quaternion.w")]:
        if all(f"{path}.{a}" in table for a in "xyz"):
            x, y, z, w = (table[f"{path}.{a}"].to_numpy(float) for a in "xyzw")
            with np.errstate(all="ignore"):
                yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
                none = x * x + y * y + z * z + w * w < 0.5
            table[f"{path.rpartition('.')[0]}.yaw".lstrip(".")] = np.where(none, np.nan, yaw)
    return table


def _json(channel: Channel, data: Bytes, start: Integers, end: Integers) -> Decoded:
    from ingest.ros.json_columns import columns_of

    table, good = columns_of(data, start, end)
    findings = (_broken(channel, int((~good).sum())),) if not good.all() else ()
    return Decoded(with_yaw(table), good, findings)


def _protobuf(channel: Channel, data: Bytes, start: Integers, end: Integers) -> Decoded:
    from ingest.ros.proto import columns_of

    table, good = columns_of(channel.schema, channel.definition, data, start, end)
    findings = (_broken(channel, int((~good).sum())),) if not good.all() else ()
    return Decoded(with_yaw(table), good, findings)


DECODERS: Mapping[str, Decoder] = {"cdr": _cdr, "json": _json, "protobuf": _protobuf}
