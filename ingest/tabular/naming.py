"""What a column's name says: its unit, and which quantity it may hold."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from ingest.codes import codes
from ingest.detect import Rule, detect
from ingest.log import Source
from ingest.tabular.unstated import GUESSED, GUESSES, SIZE, settled

#: Spellings of units at the end of a name (after ``_``) or in brackets, and the unit that they mean.
UNITS: Mapping[str, str] = {
    "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg", "rad": "rad", "radian": "rad",
    "radians": "rad",
    "deg_s": "deg/s", "deg/s": "deg/s", "degps": "deg/s", "dps": "deg/s", "°/s": "deg/s", "deg/sec": "deg/s",
    "deg_min": "deg/min", "deg/min": "deg/min", "°/min": "deg/min",
    "rad_s": "rad/s", "rad/s": "rad/s", "radps": "rad/s", "rad/sec": "rad/s",
    "m": "m", "metre": "m", "meter": "m", "mm": "mm", "cm": "cm", "km": "km",
    "m_s": "m/s", "m/s": "m/s", "mps": "m/s", "ms-1": "m/s", "m_s2": "m/s²", "m/s2": "m/s²", "m/s^2": "m/s²",
    "m/s²": "m/s²", "mps2": "m/s²", "kn": "kn", "kt": "kn", "kts": "kn", "knots": "kn", "knot": "kn",
    "km_h": "km/h", "km/h": "km/h", "kmh": "km/h", "kph": "km/h",
    "rpm": "rpm", "1/min": "rpm", "u/min": "rpm", "r/min": "rpm", "rev/min": "rpm", "min-1": "rpm", "min^-1": "rpm",
    "rev_s": "rev/s", "rev/s": "rev/s", "rps": "rev/s", "hz": "rev/s",
    "percent": "percent", "pct": "percent", "%": "percent", "n": "N", "newton": "N", "kn_force": "kN",
    "nm": "N m",
    "s": "s", "sec": "s", "seconds": "s", "ms": "ms", "msec": "ms", "us": "us", "usec": "us", "µs": "us",
    "ns": "ns",
    "nsec": "ns", "min": "min", "v": "V", "a": "A", "pwm": "us", "degc": "degC", "°c": "degC", "c": "degC",
    "kg": "kg",
    "g": "g", "hpa": "hPa", "pa": "Pa", "mbar": "hPa",
}  # fmt: skip

#: Suffixes after ``_`` that are also parts of plain names (``wind_v``, ``pos_n``): units in brackets only.
_BRACKETS_ONLY = frozenset({"n", "v", "a", "c", "g", "min", "hz", "km", "s2", "nm", "°"})
_SUFFIXES = sorted((s for s in UNITS if s not in _BRACKETS_ONLY), key=len, reverse=True)
_BRACKETS = re.compile(r"^(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")


#: What the second, third … column of one name has at its end.
NAMESAKE = re.compile(r"(?<=[a-zA-Z\])°%])\.[1-9]\d?$")
_SPEED = re.compile(r"(^|_)(speed|velocity|vel|sog|stw)(_|$)")


def is_unit(text: str) -> bool:
    """Whether a text is a unit (or a dash, which stands for none)."""
    return text.strip().lower() in UNITS or text.strip() in {"-", "1"}


def split_unit(name: str) -> tuple[str, str]:
    """Split a name into its plain form, lower case with underscores, and the unit that it states, or "".

    Examples
    --------
    >>> split_unit("Heading [deg]"), split_unit("r_deg_s"), split_unit("windSpeed_kn"), split_unit("thrust")
    (('heading', 'deg'), ('r', 'deg/s'), ('wind_speed', 'kn'), ('thrust', ''))
    >>> split_unit("boot_ms"), split_unit("vn_ms")
    (('boot', 'ms'), ('vn', 'm/s'))
    >>> split_unit("rudder_deg.1")
    ('rudder', 'deg')
    """
    name = NAMESAKE.sub("", name)
    bracketed = _BRACKETS.match(name)
    if bracketed and bracketed[2].lower() in UNITS:
        return plain(bracketed[1]), UNITS[bracketed[2].lower()]
    flat = plain(name)
    for suffix in _SUFFIXES:
        if flat.endswith("_" + suffix):
            stem = flat[: -len(suffix) - 1]
            return stem, "m/s" if suffix == "ms" and _says_speed(stem) else UNITS[suffix]
    return flat, ""


def _says_speed(stem: str) -> bool:
    """Whether a name without its unit is one of a speed: its ``ms`` are metres per second."""
    speeds = (e for p in _PATTERNS for c, e in p.components if c == "speed" or p.unit == "m/s")
    return bool(_SPEED.search(stem)) or any(re.fullmatch(e, stem) for e in speeds)


def plain(name: str) -> str:
    """Return a name in lower case, words joined by underscores."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name.strip())
    return re.sub(r"[^\w°/%µ²^]+", "_", words).strip("_").lower()


@dataclass(frozen=True)
class _Pattern:
    """Names that say a quantity: one alternative per component, and the unit where the name states none.

    Names that could be anything else count only where a unit is ``stated``.
    """

    quantity: str
    components: tuple[tuple[str, str], ...]
    unit: str
    rank: float
    options: tuple[tuple[str, object], ...] = ()
    stated: bool = False


_RECEIVER = "((gps|gnss|rtk|receiver|antenna|position|pos|vessel|ship|boat)_)*"
_LAT = _RECEIVER + "(lat|latitude)(_dd)?"
_LON = _RECEIVER + "(lon|lng|long|longitude)(_dd)?"
_OF = "((true|gps|gnss|gyro|vessel|ship|boat|est|estimated|filtered|fused)_)*"
_HEADING = _OF + r"(heading|hdg|psi|yaw)(_(true|t|angle|gps|gnss|est|filtered|fused))*|hdt|thdg"
_MAGNETIC = (
    r"(compass|hdm|((compass|magnetic|mag)_)+(heading|hdg|yaw)|(heading|hdg|yaw)_(compass|magnetic|mag|m))"
)
_RATE = (
    _OF
    + r"(yaw_?rate|yaw_?speed|rate_of_turn|turn_rate|turning_rate|psi_?dot|yaw_?dot|heading_rate|hdg_rate)"
    "(_(z|gps|gyro|imu|est|filtered))?|r|wz|omega_z"
)
_GYRO = "gyro_z|gyr_z|gyrz|gz|angular_velocity_z|imu_gyro_z"
_SEEN, _FROM = "(apparent|app|relative|rel)", "wind_(angle|direction|dir)"
_RUDDER = r"(\w+_)?rudder(_\w+)?|delta(_\w+)?"
_PROPELLER = (
    r"n|n\d|rpm|rps|(\w+_)?(propeller|prop|shaft|engine|motor|screw|thruster)(_\w+)?|(\w+_)(rpm|rps)|n_\w+"
)

_SIDE = r"(\w+_)?(port|starboard|stbd|bow|stern|left|right|fore|aft|front|rear)(_\w+)?"

_PATTERNS: tuple[_Pattern, ...] = (
    _Pattern("position", (("latitude", _LAT), ("longitude", _LON)), "deg", 50),
    _Pattern("position", (("north", "north|northing|x_north|pos_n|pos_north|position_north|north_pos|x_n"),
                          ("east", "east|easting|y_east|pos_e|pos_east|position_east|east_pos|y_e")), "m",
                          45),
    _Pattern("position", (("north", "x|x_pos|pos_x|x0|position_x"), ("east", "y|y_pos|pos_y|y0|position_y")),
        "m", 40),
    _Pattern("heading", (("value", _HEADING),), "angle", 50),
    _Pattern("heading", (("value", _MAGNETIC),),
        "angle", 40,
             (("magnetic", True),)),
    _Pattern("yaw_rate", (("value", _RATE),), "rate", 50),
    _Pattern("yaw_rate", (("value", _GYRO),), "rate", 45),
    _Pattern("yaw_rate", (("value", "rot"),), "rate", 40),
    _Pattern("yaw_rate", (("value", "rate|turn|turning|gyro|drehrate"),), "rate", 35, stated=True),
    _Pattern("velocity", (("north",
        "vn|v_n|vel_n|v_north|vel_north|velocity_north|north_velocity|vnorth|speed_north"),
                          ("east",
                              "ve|v_e|vel_e|v_east|vel_east|velocity_east|east_velocity|veast|speed_east")),
             "m/s", 50),
    _Pattern("velocity", (("forward", "u|surge|surge_velocity|surge_speed|u_body|vel_surge"),
                          ("starboard", "v|sway|sway_velocity|sway_speed|v_body|vel_sway")), "m/s", 45),
    _Pattern("velocity", (("speed", "sog|speed_over_ground|ground_speed|gps_speed|gs"),
                          ("course", "(cog|course_over_ground|course|track|ground_course|gps_course)(_true|_t)?")),
                          "angle", 40),
    _Pattern("wind", (("speed", "(true_)?wind_?speed|tws|wind_speed_true"),
                      ("direction",
                          "(true_)?wind_(direction|dir)|wind_(direction|dir)_true|winddir|twd|wind_from")),
             "angle", 45, (("reference", "true"),)),
    _Pattern("wind", (("speed", f"aws|wind_speed|{_SEEN}_wind_speed|wind_speed_{_SEEN}"),
                      ("direction", f"awa|wind_angle|{_SEEN}_{_FROM}|{_FROM}_{_SEEN}")),
             "angle", 40, (("reference", "relative"),)),
    _Pattern("depth", (("value", "depth|water_depth|depth_below_surface"),), "m", 50),
    _Pattern("rudder", (("value", _RUDDER),), "rudder", 50),
    _Pattern("propeller", (("value", _PROPELLER),), "rev", 50),
    _Pattern("propeller", (("value", _SIDE),), "rev", 35, stated=True),
)  # fmt: skip

_FITTING: Mapping[str, frozenset[str]] = {
    "angle": frozenset({"deg", "rad", "percent"}),
    "rudder": frozenset({"deg", "rad", "percent"}),
    "rate": frozenset({"deg/s", "rad/s", "deg/min"}),
    "rev": frozenset({"rpm", "rev/s", "percent", "N", "rad/s"}),
    "m": frozenset({"m", "mm", "cm", "km"}),
    "m/s": frozenset({"m/s", "kn", "km/h"}),
    "deg": frozenset({"deg", "rad", "degE7"}),
}


def sources_of(table: pd.DataFrame, units: Mapping[str, str], topic: str = "") -> tuple[Source, ...]:
    """Return the quantities that a table's column names say it holds, best first.

    Parameters
    ----------
    table : DataFrame
        Numeric columns are looked at.
    units : mapping of str to str
        Units of columns that are stated outside their names.
    """
    names = {c: split_unit(str(c)) for c in table.columns if pd.api.types.is_numeric_dtype(table[c])}
    stated = {c: units.get(str(c)) or unit for c, (_, unit) in names.items()}
    each = [r for p in _PATTERNS for r in _rules(p, names, stated, table, topic)]
    rules = list({(r.quantity, *r.fields.items()): r for r in reversed(each)}.values())[::-1]
    if {"packet_counter", "sample_time_fine"} <= {name for name, _ in names.values()}:
        rules = [_upward(rule) for rule in rules]
    return settled(detect(rules, {topic: table}), table)


def called_latitude_or_longitude(name: str) -> bool:
    """Whether a column is called so."""
    return any(re.fullmatch(p, split_unit(name)[0]) for p in (_LAT, _LON))


def latitude_and_longitude(table: pd.DataFrame, stated: Mapping[str, str]) -> Iterable[tuple[str, str]]:
    """Columns of numbers that are called so, in pairs, where they state no unit."""
    names = {str(c): split_unit(str(c))[0] for c in table.columns if pd.api.types.is_numeric_dtype(table[c])}
    pair = ([c for c in names if re.fullmatch(p, names[c]) and not stated.get(c)] for p in (_LAT, _LON))
    return zip(*pair, strict=False)


def _upward(rule: Rule) -> Rule:
    """Return the rule with its angles turning about an axis that points up: Xsens exports, yaw from east."""
    if rule.quantity not in {"heading", "yaw_rate"}:
        return rule
    unit = "deg" if rule.quantity == "heading" else "rad/s"
    return replace(rule, unit=unit, options={"frame": "enu"})


def _rules(
    pattern: _Pattern,
    names: Mapping[str, tuple[str, str]],
    stated: Mapping[str, str],
    table: pd.DataFrame,
    topic: str,
) -> Iterable[Rule]:
    columns: list[list[str]] = []
    for component, expression in pattern.components:
        fits = _FITTING["m/s" if component == "speed" else pattern.unit]
        alternatives = re.compile(f"(?:{expression})$")
        fitting = (c for c in names if stated[c] in fits or not (stated[c] or pattern.stated))
        columns.append([c for c in fitting if alternatives.match(names[c][0])])
    for chosen in zip(*columns, strict=False):
        yield _rule(pattern, chosen, stated, table, topic)


def _rule(
    pattern: _Pattern, chosen: Sequence[str], stated: Mapping[str, str], table: pd.DataFrame, topic: str
) -> Rule:
    fields = {component: name for (component, _), name in zip(pattern.components, chosen, strict=True)}
    angle = chosen[-1]
    options = dict(pattern.options)
    if "speed" in fields:
        options["speed_unit"] = stated[chosen[0]] or "m/s"
    unit = stated[angle]
    if not unit:
        guess = GUESSES.get(pattern.unit)
        values = table[angle].to_numpy(float, na_value=np.nan)
        unit = guess(values[~codes(values)]) if guess else pattern.unit
        if guess:
            options[GUESSED] = SIZE
    return Rule(pattern.quantity, re.escape(topic), fields, unit, pattern.rank, options)
