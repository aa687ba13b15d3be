"""What pymavlink, DFReader and pyulog make of a log, beside our tables."""

from __future__ import annotations

import collections
import contextlib
import io
import random
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from mavlink_samples import (
    dataflash_body,
    dataflash_head,
)  # fmt: skip
from pymavlink import DFReader, mavutil
from pyulog import ULog

from ingest.mavlink import READERS

DATA = Path(__file__).parents[2] / "shared" / "data"
real = [pytest.mark.real, pytest.mark.skipif(not DATA.is_dir(), reason=f"needs the measured data in {DATA}")]
BY_NAME = {r.name: r for r in READERS}
TLOG, DATAFLASH, TEXT, ULOG = (BY_NAME[n] for n in ("tlog", "dataflash", "dataflash_text", "ulog"))


def equal(ours: np.ndarray, theirs: list) -> bool:
    """Field by field; a code for "not available" is NaN in ours."""
    if isinstance(theirs[0], str):
        return list(ours) == theirs
    a, b = ours.astype(float), np.asarray(theirs, dtype=float)
    missing = np.isnan(a) & np.isin(b, [127, 255, 32767, 65535, 2**31 - 1, 2**32 - 1])
    return np.array_equal(np.where(missing, b, a), b, equal_nan=True)


def peer_tlog(path: Path) -> dict[str, list[dict]]:
    """Messages of pymavlink by type."""
    link = mavutil.mavlink_connection(str(path))
    out = collections.defaultdict(list)
    while (m := link.recv_match()) is not None:
        if m.get_type() != "BAD_DATA":
            out[m.get_type()].append(m.to_dict() | {"_t": m._timestamp, "_s": m.get_srcSystem()})
    link.close()
    return out


def assert_as_peer(log, peer: dict[str, list[dict]]) -> None:
    assert set(log.tables) == set(peer)
    for name, rows in peer.items():
        table = log.tables[name]
        assert len(table) == len(rows), name
        utc = (log.utc_ns + table.index.to_numpy()) * 1e-9
        assert np.allclose(utc, [r["_t"] for r in rows], rtol=0, atol=2e-6), name
        assert (table["source"] == [r["_s"] for r in rows]).all(), name
        assert_fields(name, table, rows)


def assert_fields(topic: str, table: pd.DataFrame, rows: list[dict]) -> None:
    """Every field of the rows stands in the table; one of an array with its number."""
    for field, value in rows[0].items():
        if field == "mavpackettype" or field.startswith("_"):
            continue
        if isinstance(value, list) or hasattr(value, "tolist"):
            for k in range(len(value)):
                assert equal(table[f"{field}[{k}]"].to_numpy(), [r[field][k] for r in rows]), (topic, field)
        else:
            assert equal(table[field].to_numpy(), [r[field] for r in rows]), (topic, field)


def spots_of(records: list[bytes], count: int, seed: int = 0) -> set[int]:
    return set(random.Random(seed).sample(range(1, len(records) - 1), count))


def peer_dataflash(path: Path) -> dict[str, list[dict]]:
    """Messages of DFReader by topic as Seatrial names them."""
    reader = DFReader.DFReader_binary(str(path))
    out, lowest = collections.defaultdict(list), {}
    while (m := reader.recv_msg()) is not None:
        row = m.to_dict() | {"_t": m._timestamp}
        name = row.pop("mavpackettype")
        if m.fmt.instance_field is not None:
            row["_i"] = row[m.fmt.instance_field]
        out[name].append(row)
    reader.close()
    split = {}
    for name, rows in out.items():
        lowest = min(r.get("_i", 0) for r in rows)
        for r in rows:
            topic = name if r.get("_i", 0) == lowest else f"{name}[{r['_i']}]"
            split.setdefault(topic, []).append(r)
    return split


def assert_as_dfreader(log, peer: dict[str, list[dict]]) -> None:
    assert set(log.tables) == set(peer)
    for topic, rows in peer.items():
        table = log.tables[topic]
        assert len(table) == len(rows), topic
        assert_fields(topic, table, rows)


def dataflash_bytes(**options) -> bytes:
    return b"".join(dataflash_head() + dataflash_body(**options))


def as_text(data: bytes, tmp_path: Path) -> bytes:
    """The way of the planners: name and values, separated by comma and blank."""
    path = tmp_path / "for_text.bin"
    path.write_bytes(data)
    reader = DFReader.DFReader_binary(str(path))
    lines = []
    while (m := reader.recv_msg()) is not None:
        values = [getattr(m, c) for c in m._fieldnames if not hasattr(getattr(m, c), "tolist")]
        if len(values) == len(m._fieldnames):
            lines.append(", ".join([m.get_type(), *map(str, values)]))
    reader.close()
    return ("\n".join(lines) + "\n").encode()


def assert_as_pyulog(log, path: Path) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        peer = ULog(str(path))
    assert {f"{d.name}[{d.multi_id}]" if d.multi_id else d.name for d in peer.data_list} == set(log.tables)
    for d in peer.data_list:
        table = log.tables[f"{d.name}[{d.multi_id}]" if d.multi_id else d.name]
        for field, values in d.data.items():
            if "_padding" not in field:
                assert np.array_equal(table[field], values, equal_nan=values.dtype.kind == "f"), (
                    d.name,
                    field,
                )
