"""UBX: values against pyubx2."""

import io

import numpy as np
import pytest
from marine_samples import SECOND, pvt, real, same
from pyubx2 import GET, UBXMessage, UBXReader

from ingest.marine.stream import decode_stream


def test_ubx_values_as_pyubx2_has_them():
    raw = b"".join(pvt(43200 + i / 10, velE=-i) for i in range(20))
    raw += UBXMessage("NAV", "NAV-RELPOSNED", GET, version=1, iTOW=1, relPosN=-12, _HPrelPosN=-0.25,
        relPosHeading=123.45678,
                      accHeading=0.25, relPosHeadingValid=1).serialize()  # fmt: skip
    raw += UBXMessage(
        "NAV", "NAV-HPPOSLLH", GET, iTOW=2, lon=10.1234567, _HPlon=1.2e-08, lat=-60.0, hAcc=1.4
    ).serialize()
    raw += UBXMessage("NAV", "NAV-VELNED", GET, iTOW=3, velN=-150, heading=12.5, sAcc=4).serialize()
    raw += UBXMessage("ESF", "ESF-INS", GET, zAngRateValid=1, iTOW=4, zAngRate=-12.345).serialize()
    assert_like_pyubx2(raw)


def assert_like_pyubx2(raw: bytes) -> int:
    stream = decode_stream(raw)
    row: dict[str, int] = {}
    for _, message in UBXReader(io.BytesIO(raw), protfilter=2):
        if message is None or message.identity not in stream.tables:
            continue
        at = row.get(message.identity, 0)
        row[message.identity] = at + 1
        ours = stream.tables[message.identity].iloc[at]
        for name, theirs in vars(message).items():
            if name in ours.index and not name.startswith("_") and name != "iTOW":
                assert same(ours[name], theirs), f"{message.identity}.{name}"
    assert row == {k: len(v) for k, v in stream.tables.items() if k in row}
    return sum(row.values())


def test_gyroscope_in_esf_meas():
    raw = bytes.fromhex("e803000000080000") + (5 << 24 | (1 << 24) - 4096).to_bytes(4, "little")
    body = bytes((0x10, 0x02)) + len(raw).to_bytes(2, "little") + raw
    a = b = 0
    for byte in body:
        a = (a + byte) & 255
        b = (b + a) & 255
    frame = b"\xb5\x62" + body + bytes((a, b))
    table = decode_stream(pvt(1.0) + frame * 4 + pvt(2.0)).tables["ESF-MEAS"]
    assert table["gyroZ"].tolist() == [-1.0] * 4
    np.testing.assert_array_equal(np.diff(table.index), SECOND // 4)


@pytest.mark.real
def test_real_ubx_as_pyubx2_reads_it():
    assert assert_like_pyubx2(real("ubx_nmea_mixed.log").read_bytes()) > 100
