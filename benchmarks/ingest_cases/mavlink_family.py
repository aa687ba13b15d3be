"""tlog against pymavlink, DataFlash against DFReader, ULog against pyulog."""

from __future__ import annotations

import contextlib
import io
import itertools
import math
import struct
from collections.abc import Iterator
from pathlib import Path

from benchmarks.ingest_cases import Case


def ours(path: Path) -> int:
    from ingest import read_log

    return read_log(path).messages


def make_tlog(folder: Path, scale: float) -> Path:
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    path = folder / "bench.tlog"
    with path.open("wb") as file:
        for i in range(int(100_000 * scale)):
            for k, message in enumerate(tlog_messages(dialect, i)):
                stamp = struct.pack(">Q", 1_700_000_000_000_000 + i * 20_000 + k * 1_000)
                file.write(stamp + message.pack(mav, force_mavlink1=i % 7 == 0))
                mav.seq = (mav.seq + 1) % 256
    return path


def tlog_messages(dialect, i: int) -> Iterator:  # noqa: ANN001
    ms = i * 20
    yield dialect.MAVLink_attitude_message(
        ms, 0.01, 0.02, math.sin(i / 100), 0.1, 0.2, 0.3 * math.cos(i / 100)
    )
    yield dialect.MAVLink_gps_raw_int_message(
        ms * 1000, 3, 634_000_000 + i, 103_000_000 + i, 1000, 90, 120, 150, i % 36_000, 12
    )
    yield dialect.MAVLink_global_position_int_message(
        ms, 634_000_000 + i, 103_000_000 + i, 1000, 10, 100, -50, 1, i % 36_000
    )
    yield dialect.MAVLink_servo_output_raw_message(ms, 0, 1500, 1500 + i % 100, 1500, 1500, 0, 0, 0, 0)
    yield dialect.MAVLink_local_position_ned_message(ms, i * 0.01, i * 0.02, 0.0, 1.0, 2.0, 0.0)


def peer_tlog(path: Path) -> int:
    from pymavlink import mavutil

    link = mavutil.mavlink_connection(str(path))
    count = 0
    while (message := link.recv_match()) is not None:
        count += message.get_type() != "BAD_DATA"
    return count


def tlog_records(data: bytes) -> list[bytes]:
    """Stamp and frame each (the log has no signatures)."""
    out, p = [b""], 0
    while p < len(data):
        n = 8 + data[p + 9] + (12 if data[p + 8] == 0xFD else 8)
        out.append(data[p : p + n])
        p += n
    return out


#: Name: type, format, columns, struct.
DATAFLASH = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns", "<BB4s16s64s"),
    "GPS": (
        130, "QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
        "<QBBIHBhiiiffffB",
    ),
    "ATT": (131, "QccccCCCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw", "<QhhhhHHHH"),
    "IMU": (132, "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "<QBffffff"),
    "RCOU": (133, "Qhhhhhhhh", "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8", "<Qhhhhhhhh"),
    "UNIT": (134, "QbZ", "TimeUS,Id,Label", "<Qb64s"),
    "FMTU": (136, "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "<QB16s16s"),
}  # fmt: skip


#: Letters of the units.
UNITS = {"s": "s", "#": "instance", "D": "deglatitude", "U": "deglongitude", "E": "rad/s"}


def dataflash_record(name: str, *values: object) -> bytes:
    return b"\xa3\x95" + bytes([DATAFLASH[name][0]]) + struct.pack(DATAFLASH[name][3], *values)


def dataflash_head() -> Iterator[bytes]:
    for name, (kind, letters, columns, layout) in DATAFLASH.items():
        size = struct.calcsize(layout) + 3
        yield dataflash_record("FMT", kind, size, name.encode(), letters.encode(), columns.encode())
    for letter, label in UNITS.items():
        yield dataflash_record("UNIT", 0, ord(letter), label.encode())
    yield dataflash_record("FMTU", 0, 130, b"s#-----DU------", b"F--------------")
    yield dataflash_record("FMTU", 0, 132, b"s#EEE---", b"F-------")


def dataflash_body(steps: int) -> Iterator[bytes]:
    for i in range(steps):
        us = 1_000_000 + i * 2_500
        for instance in (0, 1):
            yield dataflash_record("IMU", us, instance, 0.1, 0.2, math.sin(i / 500), 0.0, 0.0, -9.8)
        if i % 4 == 0:
            yield dataflash_record("ATT", us, 0, 0, 0, 0, 0, i % 36_000, 0, 0)
            yield dataflash_record("RCOU", us, 1500, 1500, 1500, 1500, 0, 0, 0, 0)
        if i % 80 == 0:
            ms = 345_600_120 + us // 1000
            where = (634_000_000 + i, 103_000_000 + i, 1234)
            yield dataflash_record("GPS", us, 0, 3, ms, 2290, 14, 80, *where, 1.5, 20.0, 0.0, 0.0, 1)


def make_dataflash(folder: Path, scale: float) -> Path:
    path = folder / "bench.bin"
    with path.open("wb") as file:
        file.writelines(itertools.chain(dataflash_head(), dataflash_body(int(340_000 * scale))))
    return path


def peer_dataflash(path: Path) -> int:
    from pymavlink import DFReader

    reader = DFReader.DFReader_binary(str(path))
    count = 0
    while (message := reader.recv_msg()) is not None:
        message.to_dict()
        count += 1
    return count


def dataflash_records(data: bytes) -> list[bytes]:
    lengths = {kind: 3 + struct.calcsize(layout) for kind, _, _, layout in DATAFLASH.values()}
    head = b"".join(dataflash_head())
    out, p = [head], len(head)
    while p < len(data):
        n = lengths[data[p + 2]]
        out.append(data[p : p + n])
        p += n
    return out


ULOG_FORMATS = {
    "sensor_combined": ("uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;", "<Q6f"),
    "vehicle_attitude": (
        "uint64_t timestamp;float[4] q;uint8_t quat_reset_counter;uint8_t[7] _padding0;",
        "<Q4fB",
    ),
    "sensor_gps": (
        "uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;int32_t lon;uint8_t fix_type;",
        "<QQiiB",
    ),
}


def ulog_message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog_head() -> bytes:
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + ulog_message("B", bytes(40))
    out += b"".join(ulog_message("F", f"{name}:{text}".encode()) for name, (text, _) in ULOG_FORMATS.items())
    names = enumerate(ULOG_FORMATS)
    return out + b"".join(ulog_message("A", struct.pack("<BH", 0, i) + n.encode()) for i, n in names)


def ulog_body(steps: int) -> Iterator[bytes]:
    layouts = [struct.Struct("<H" + layout[1:]) for _, layout in ULOG_FORMATS.values()]
    for i in range(steps):
        us = 5_000_000 + i * 4_000
        yield ulog_message("D", layouts[0].pack(0, us, 0.1, 0.2, math.sin(i / 500), 0.0, 0.0, -9.8))
        if i % 2 == 0:
            yield ulog_message("D", layouts[1].pack(1, us, math.cos(i / 900), 0.0, 0.0, math.sin(i / 900), 0))
        if i % 50 == 0:
            utc = 1_700_000_000_000_000 + us
            yield ulog_message("D", layouts[2].pack(2, us, utc, 634_000_000 + i, 103_000_000 + i, 3))


def make_ulog(folder: Path, scale: float) -> Path:
    path = folder / "bench.ulg"
    with path.open("wb") as file:
        file.write(ulog_head())
        file.writelines(ulog_body(int(400_000 * scale)))
    return path


def peer_ulog(path: Path) -> int:
    from pyulog import ULog

    with contextlib.redirect_stdout(io.StringIO()):
        log = ULog(str(path))
    return 6 + 1 + sum(len(d.data["timestamp"]) for d in log.data_list)


def ulog_records(data: bytes) -> list[bytes]:
    head = ulog_head()
    out, p = [head], len(head)
    while p < len(data):
        n = 3 + int.from_bytes(data[p : p + 2], "little")
        out.append(data[p : p + n])
        p += n
    return out


CASES = (
    Case("tlog", "pymavlink recv_match", 30.0, make_tlog, ours, peer_tlog, tlog_records),
    Case(
        "dataflash",
        "DFReader + to_dict",
        60.0,
        make_dataflash,
        ours,
        peer_dataflash,
        dataflash_records,
        False,
    ),
    Case("ulog", "pyulog", 0.9, make_ulog, ours, peer_ulog, ulog_records, False),
)
