"""Which sentences and messages hold which quantity, and the units of their fields."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ingest.detect import Rule, detect
from ingest.log import Source

if TYPE_CHECKING:
    import pandas as pd

#: Usual errors, m, of GGA's qualities: plain, differential, precise, RTK fixed, RTK float, simulated, by SBAS.
USUAL_ERRORS: Mapping[int, float] = {1: 2.5, 2: 1.0, 3: 1.0, 4: 0.02, 5: 0.3, 8: 2.5, 9: 1.0}
_FIX = {"quality": "quality", "quality_in": tuple(USUAL_ERRORS), "satellites": "numSV", "hdop": "HDOP",
        "fixes": USUAL_ERRORS, "accuracy": "accuracy"}  # fmt: skip
_GOOD = {"quality": "good", "quality_min": 1}
_TIME = {"time": "time", "time_unit": "s"}
_LATLON = {"latitude": "lat", "longitude": "lon"}
_UBX_FIX = {"quality": "fixType", "quality_in": (2, 3, 4), "satellites": "numSV"}
_MM = {"accuracy": "hAcc", "accuracy_scale": 1e-3}

#: Ranks: 60 and more for fixes and headings of the better kinds, 50 plain, 30 derived, 20 poor.
RULES: tuple[Rule, ...] = (
    Rule("position", "GGA", _LATLON, "deg", 55, {**_FIX, **_TIME}),
    Rule("position", "GNS", _LATLON, "deg", 53,
         {"satellites": "numSV", "hdop": "HDOP", "accuracy": "accuracy", **_GOOD, **_TIME}),
    Rule("position", "RMC", _LATLON, "deg", 50, {**_GOOD, **_TIME, "accuracy": "accuracy"}),
    Rule("position", "GLL", _LATLON, "deg", 45, {**_GOOD, **_TIME}),
    Rule("position", "PTNLGGK", _LATLON, "deg", 55, {"quality": "gpsQual", "quality_min": 1}),
    Rule("position", "PUBX00", _LATLON, "deg", 50, {"hdop": "HDOP"}),
    Rule("position", "PASHRPOS", _LATLON, "deg", 50, {"hdop": "HDOP"}),
    Rule("position", "VNINS", {"latitude": "latitude", "longitude": "longitude"}, "deg", 50,
         {"accuracy": "posUncertainty"}),
    Rule("position", "VNGPS", {"latitude": "latitude", "longitude": "longitude"}, "deg", 50,
         {"quality": "gpsFix", "quality_min": 2}),
    Rule("position", "NAV2?-HPPOSLLH", _LATLON, "deg", 60, {"quality": "invalidLlh", "quality_max": 0,
        **_MM}),
    Rule("position", "(NAV2?|HNR)-PVT", _LATLON, "deg", 56, {**_UBX_FIX, **_MM}),
    Rule("position", "NAV2?-POSLLH", _LATLON, "deg", 50, _MM),
    Rule("heading", "PTNLAVR", {"value": "yaw"}, "deg", 60, {"quality": "gpsQual", "quality_min": 1}),
    Rule("heading", "PASHR", {"value": "trueHdg"}, "deg", 58, {"accuracy": "hdgAcc",
        "accuracy_scale": 0.0174532925199433}),
    Rule("heading", "PASHRHPR", {"value": "trueHdg"}, "deg", 56),
    Rule("heading", "PSXN23", {"value": "heading"}, "deg", 58),
    Rule("heading", "THS", {"value": "headt"}, "deg", 56, _GOOD),
    Rule("heading", "HDT", {"value": "headingT"}, "deg", 55),
    Rule("heading", "VNINS", {"value": "yaw"}, "deg", 50),
    Rule("heading", "NAV2?-RELPOSNED", {"value": "relPosHeading"}, "deg", 58,
         {"quality": "relPosHeadingValid", "quality_min": 1, "accuracy": "accHeading",
          "accuracy_scale": 0.0174532925199433}),
    Rule("heading", "NAV2?-ATT", {"value": "heading"}, "deg", 50),
    Rule("heading", "VHW", {"value": "hdgT"}, "deg", 40),
    Rule("heading", "HDG", {"value": "headingT"}, "deg", 38),
    Rule("heading", "HDG", {"value": "headingM"}, "deg", 35, {"magnetic": True}),
    Rule("heading", "HDM", {"value": "headingM"}, "deg", 30, {"magnetic": True}),
    Rule("heading", "VN(YMR|YPR|YBA|YIA)", {"value": "yaw"}, "deg", 40, {"magnetic": True}),
    Rule("yaw_rate", "ROT", {"value": "rot"}, "deg/min", 50, _GOOD),
    Rule("yaw_rate", "VN(YMR|YBA|IMU|GYR|QMR|MAR)", {"value": "gyroZ"}, "rad/s", 50),
    Rule("yaw_rate", "ESF-INS", {"value": "zAngRate"}, "deg/s", 48, {"quality": "zAngRateValid",
        "quality_min": 1}),
    Rule("yaw_rate", "ESF-MEAS", {"value": "gyroZ"}, "deg/s", 45),
    Rule("velocity", "(NAV2?)-PVT", {"north": "velN", "east": "velE"}, "mm/s", 58,
         {**_UBX_FIX, "accuracy": "sAcc", "accuracy_scale": 1e-3}),
    Rule("velocity", "NAV2?-VELNED", {"north": "velN", "east": "velE"}, "cm/s", 55,
         {"accuracy": "sAcc", "accuracy_scale": 1e-2}),
    Rule("velocity", "VNINS|VNGPS", {"north": "velN", "east": "velE"}, "m/s", 55),
    Rule("velocity", "VTG", {"speed": "sogn", "course": "cogt"}, "deg", 50, {"speed_unit": "kn", **_GOOD}),
    Rule("velocity", "RMC", {"speed": "spd", "course": "cog"}, "deg", 48, {"speed_unit": "kn", **_GOOD,
        **_TIME}),
    Rule("velocity", "VBW", {"forward": "longgroundspd", "starboard": "transgroundspd"}, "kn", 45),
    Rule("wind", "MWD", {"speed": "speedM", "direction": "dirT"}, "deg", 55,
         {"speed_unit": "m/s", "reference": "true"}),
    Rule("depth", "DBT", {"value": "depthm"}, "m", 50),
    Rule("depth", "DPT", {"value": "depth"}, "m", 52),
    Rule("rudder", "RSA", {"value": "stbdangle"}, "deg", 50, {"quality": "stbdgood", "quality_min": 1}),
    Rule("rudder", "RSA", {"value": "portangle"}, "deg", 49, {"quality": "portgood", "quality_min": 1}),
    Rule("propeller", "RPM", {"value": "rpm"}, "rpm", 50, _GOOD),
)  # fmt: skip

_ANGLES = frozenset({
    "cogt", "cogm", "cog", "headingT", "headt", "headingM", "deviation", "variation", "mv", "hdgT", "hdgM",
    "angle",
    "dirT", "dirM", "stbdangle", "portangle", "stbdrudderorder", "portrudderorder", "trueHdg", "roll",
    "pitch", "yaw",
    "tilt", "heading", "relPosHeading", "accHeading", "headMot", "headVeh", "headAcc", "lat", "lon",
    "latitude",
    "longitude", "magDec", "magAcc", "cAcc",
})  # fmt: skip
_NMEA_UNITS: Mapping[str, str] = {
    "sogn": "kn", "spd": "kn", "spdN": "kn", "speedN": "kn", "longgroundspd": "kn", "transgroundspd": "kn",
    "longwaterspd": "kn", "transwaterspd": "kn", "sogk": "km/h", "spdK": "km/h", "speedM": "m/s",
    "rot": "deg/min",
    "rpm": "rpm", "pitch": "deg", "alt": "m", "sep": "m", "depthm": "m", "depth": "m", "offset": "m",
    "time": "s",
    "utctime": "s", "diffAge": "s", "stdLat": "m", "stdLong": "m", "stdAlt": "m", "accuracy": "m", "heave": "m",
}  # fmt: skip
_VN_UNITS: Mapping[str, str] = {
    **{f"gyro{a}": "rad/s" for a in "XYZ"}, **{f"accel{a}": "m/s/s" for a in "XYZ"},
    **{f"mag{a}": "gauss" for a in "XYZ"}, "velN": "m/s", "velE": "m/s", "velD": "m/s", "altitude": "m",
    "temp": "degC", "gpsTow": "s", "attUncertainty": "deg", "posUncertainty": "m", "velUncertainty": "m/s",
}  # fmt: skip
_UBX_UNITS: Mapping[str, str] = {
    "iTOW": "ms", "nano": "ns", "tAcc": "ns", "height": "mm", "hMSL": "mm", "hAcc": "mm", "vAcc": "mm",
    "velN": "mm/s", "velE": "mm/s", "velD": "mm/s", "gSpeed": "mm/s", "sAcc": "mm/s", "timeTag": "ms",
    "xAngRate": "deg/s", "yAngRate": "deg/s", "zAngRate": "deg/s", "xAccel": "m/s/s", "yAccel": "m/s/s",
    "zAccel": "m/s/s", "gyroX": "deg/s", "gyroY": "deg/s", "gyroZ": "deg/s", "accX": "m/s/s", "accY": "m/s/s",
    "accZ": "m/s/s", **{f"relPos{a}": "cm" for a in ("N", "E", "D", "Length")},
    **{f"acc{a}": "mm" for a in ("N", "E", "D", "Length")},
}  # fmt: skip
_VELNED_UNITS = dict.fromkeys(("velN", "velE", "velD", "speed", "gSpeed", "sAcc"), "cm/s")
#: Letters by which MWV says the unit of its speed.
_SPEED_LETTERS = {"N": "kn", "M": "m/s", "K": "km/h", "S": "mph"}
_XDR_UNITS = {"D": "deg", "M": "m", "R": "rpm", "C": "degC", "P": "percent", "B": "bar", "V": "V", "A": "A"}


def units_of(tables: Mapping[str, pd.DataFrame]) -> dict[tuple[str, str], str]:
    """Units of the fields of NMEA sentences and UBX messages."""
    return {
        (topic, str(field)): unit
        for topic, table in tables.items()
        for field in table.columns
        if (unit := _unit(topic, str(field), table))
    }


def _unit(topic: str, field: str, table: pd.DataFrame) -> str:
    if topic == "MWV" and field == "speed":
        return wind_speed_unit(table)
    if topic == "RPM" and field == "pitch":
        return "percent"
    if field in _ANGLES:
        return "deg"
    if topic.endswith("VELNED"):
        return _VELNED_UNITS.get(field, _UBX_UNITS.get(field, ""))
    names = _VN_UNITS if topic.startswith("VN") else _UBX_UNITS if "-" in topic else _NMEA_UNITS
    return names.get(field, "")


def wind_speed_unit(table: pd.DataFrame) -> str:
    """Return unit of the speed in ``MWV``, from the letter that most of its sentences give."""
    if "speedu" not in table or not table["speedu"].notna().any():
        return "kn"
    return _SPEED_LETTERS.get(str(table["speedu"].dropna().mode().iloc[0]), "kn")


def sources_of(tables: Mapping[str, pd.DataFrame]) -> tuple[Source, ...]:
    """Return what the tables of a serial log hold, best first."""
    rules = list(RULES)
    if "MWV" in tables:
        options = {"speed_unit": wind_speed_unit(tables["MWV"]), "reference": "relative"}
        seen = {**options, "quality": "relative_good", "quality_min": 1}
        rules.append(Rule("wind", "MWV", {"speed": "speed", "direction": "angle"}, "deg", 50, seen))
    return detect(rules, tables)
