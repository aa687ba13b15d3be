"""Small logs of the MAVLink family, packed by the field's own packers, and records to damage."""

from __future__ import annotations

import math
import struct

from pymavlink.dialects.v20 import ardupilotmega as dialect

from benchmarks.ingest_cases.mavlink_family import UNITS, ulog_message

START_US = 1_700_000_000_000_000


def messages(i: int):
    ms = i * 20
    yield dialect.MAVLink_attitude_message(
        ms, 0.01, -0.02, math.sin(i / 40), 0.1, 0.2, 0.3 * math.cos(i / 40)
    )
    yield dialect.MAVLink_gps_raw_int_message(
        START_US + ms * 1000, 3, 634_000_000 + i, 103_000_000 - i, -1000, 90, 65535, 150, i * 10 % 36_000, 12,
        h_acc=500, yaw=0,
    )  # fmt: skip
    yield dialect.MAVLink_global_position_int_message(
        ms, 634_000_000 + i, 103_000_000, 0, 10, 100, -50, 1, 65535
    )
    yield dialect.MAVLink_servo_output_raw_message(ms, 0, 1500, 1500 + i % 100, 0, 0, 0, 0, 0, 0)
    if i % 10 == 0:
        yield dialect.MAVLink_statustext_message(6, f"hello {i}".encode())
        yield dialect.MAVLink_wind_message(float(i % 360), 3.5, 0.0)
        yield dialect.MAVLink_battery_status_message(0, 1, 1, 2500, [12_000] * 10, 100, 5, 6, 77)


def tlog_records(
    steps: int = 120, *, signed: bool = False, v1_every: int = 0, system: int = 1
) -> list[bytes]:
    """Stamp and frame each."""
    mav = dialect.MAVLink(None, srcSystem=system, srcComponent=1)
    if signed:
        mav.signing.secret_key = b"k" * 32
        mav.signing.sign_outgoing = True
    out = []
    for i in range(steps):
        for k, message in enumerate(messages(i)):
            frame = message.pack(mav, force_mavlink1=bool(v1_every) and i % v1_every == 0)
            out.append(struct.pack(">Q", START_US + i * 20_000 + k * 1000) + bytes(frame))
            mav.seq = (mav.seq + 1) % 256
    return out


#: Name: type, format, columns, struct.
DATAFLASH = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns", "<BB4s16s64s"),
    "GPS": (130, "QBBIHBcLLff", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Spd,GCrs", "<QBBIHBhiiff"),
    "ATT": (131, "QccC", "TimeUS,Roll,Pitch,Yaw", "<QhhH"),
    "IMU": (132, "QBffe", "TimeUS,I,GyrX,GyrZ,Tenths", "<QBffi"),
    "MSG": (133, "QZ", "TimeUS,Message", "<Q64s"),
    "UNIT": (134, "QbZ", "TimeUS,Id,Label", "<Qb64s"),
    "MULT": (135, "Qbd", "TimeUS,Id,Mult", "<Qbd"),
    "FMTU": (136, "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "<QB16s16s"),
    "ARR": (137, "Qaqg", "TimeUS,Samples,Big,Half", "<Q32hqe"),
}  # fmt: skip


def record(name: str, *values) -> bytes:
    return b"\xa3\x95" + bytes([DATAFLASH[name][0]]) + struct.pack(DATAFLASH[name][3], *values)


def dataflash_head() -> list[bytes]:
    out = []
    for name, (kind, letters, columns, layout) in DATAFLASH.items():
        size = struct.calcsize(layout) + 3
        out.append(record("FMT", kind, size, name.encode(), letters.encode(), columns.encode()))
    for letter, label in UNITS.items():
        out.append(record("UNIT", 0, ord(letter), label.encode()))
    out += [record("MULT", 0, ord("F"), 1e-6), record("MULT", 0, ord("C"), 1e-3)]
    out.append(record("FMTU", 0, 130, b"s#-----DU--", b"F----------"))
    out.append(record("FMTU", 0, 132, b"s#EE-", b"F-0C-"))
    return out


def dataflash_body(steps: int = 150, week: int = 2290, first_ms: int = 345_600_120) -> list[bytes]:
    out = []
    for i in range(steps):
        us = 60_000_000 + i * 20_000
        for instance in (0, 1):
            out.append(record("IMU", us, instance, 0.1, math.sin(i / 50), i))
        out.append(record("ATT", us + 10, -5, 7, i * 20 % 36_000))
        if i % 5 == 0:
            position = (634_000_000 + i, -103_000_000 - i, 1.5, 20.0)
            out.append(record("GPS", us + 20, 0, 3, first_ms + us // 1000, week, 14, 80, *position))
        if i % 50 == 0:
            out.append(record("MSG", us + 30, f"event, number {i}".encode()))
            out.append(record("ARR", us + 40, *range(32), -(2**40) * i, 0.5))
    return out


ULOG_FORMATS = {
    "sensor_gps": "uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;int32_t lon;"
    "uint8_t fix_type;uint8_t[3] _padding0;",
    "vehicle_attitude": "uint64_t timestamp;float[4] q;bool ok;char[2] tag;",
    "vehicle_angular_velocity": "uint64_t timestamp;float[3] xyz;",
    "nested": "uint64_t timestamp;inner[2] part;",
    "inner": "int16_t a;double b;",
}
#: Subscription: name, instance, struct of its data.
ULOG_TOPICS = [
    ("sensor_gps", 0, "<QQiiB"), ("sensor_gps", 1, "<QQiiB"), ("vehicle_attitude", 0, "<Q4f?2s"),
    ("vehicle_angular_velocity", 0, "<Q3f"), ("nested", 0, "<Qhdhd"),
]  # fmt: skip


def ulog_head() -> bytes:
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + ulog_message("B", bytes(40))
    out += ulog_message("I", bytes([14]) + b"char[3] sys_xxPX4")
    out += b"".join(ulog_message("F", f"{name}:{text}".encode()) for name, text in ULOG_FORMATS.items())
    for i, (name, instance, _) in enumerate(ULOG_TOPICS):
        out += ulog_message("A", struct.pack("<BH", instance, i) + name.encode())
    return out


def ulog_data(topic: int, *values) -> bytes:
    return ulog_message("D", struct.pack("<H", topic) + struct.pack(ULOG_TOPICS[topic][2], *values))


def ulog_body(steps: int = 150) -> list[bytes]:
    out = []
    for i in range(steps):
        us = 5_000_000 + i * 10_000
        psi = i / 100
        out.append(ulog_data(2, us, math.cos(psi / 2), 0.0, 0.0, math.sin(psi / 2), True, b"ab"))
        out.append(ulog_data(3, us, 0.0, 0.0, 0.25))
        out.append(ulog_data(4, us, i, i / 3, -i, -i / 3))
        if i % 10 == 0:
            for topic in (0, 1):
                out.append(ulog_data(topic, us, START_US + us, 634_000_000 + i, 103_000_000, 3))
        if i == 70:
            out.append(ulog_message("O", struct.pack("<H", 40)))
            out.append(ulog_message("L", struct.pack("<BQ", 54, us) + b"a note"))
    return out
