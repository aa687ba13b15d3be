"""``capture.toml``, and the command line over it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from ingest.errors import CampaignError, UsageError, nearest
from seatrial.capture.can_device import interface_of
from seatrial.capture.settings import BITRATE, CaptureSettings, PortSettings, Protocol

FILENAME = "capture.toml"
DEFAULT_OUT = "capture-{utc}.mcap"
TOP: dict[str, tuple[type, ...]] = {
    "out": (str,), "rotate_size": (int, float), "rotate_minutes": (int, float), "duration": (int, float),
    "live": (bool,), "decode": (bool,), "port": (list,), "mute": (int, float), "campaign": (str,), "state": (str,),
    "forget_minutes": (int, float),
}  # fmt: skip
OF_PORT: dict[str, tuple[type, ...]] = {
    "device": (str,), "baud": (int,), "protocol": (str,), "name": (str,), "bitrate": (int,),
    "heartbeat": (bool,),
}  # fmt: skip
SAID = {str: "text", int: "a whole number", float: "a number", bool: "true or false", list: "[[port]] tables"}
T = TypeVar("T")


@dataclass(frozen=True)
class Wanted:
    """The command line: rotation in MB and minutes, duration in seconds."""

    config: Path | None = None
    ports: Sequence[str] = ()
    bauds: Sequence[int] = ()
    protocols: Sequence[str] = ()
    out: Path | None = None
    rotate_size: float | None = None
    rotate_minutes: float | None = None
    duration: float | None = None
    live: bool = False
    no_decode: bool = False
    campaign: Path | None = None
    state: Path | None = None
    forget_minutes: float | None = None
    bitrates: Sequence[int] = ()
    heartbeat: bool = False


def settings_from(wanted: Wanted) -> CaptureSettings:
    """The settings of a capture; what the command line says wins over the file.

    Raises
    ------
    UsageError
        No port is named, or a value is impossible; `CampaignError` where it is in the file.
    """
    file = config_file(wanted)
    settings = CaptureSettings((), Path(DEFAULT_OUT)) if file is None else read_settings(file)
    ports = with_heartbeats(command_line_ports(wanted) or settings.ports, wanted.heartbeat)
    if not ports:
        raise UsageError(f"no port: name one with --port and --baud, or write a {FILENAME}.")
    given = {
        "out": wanted.out,
        "rotate_bytes": scaled("--rotate-size", wanted.rotate_size, 1e6),
        "rotate_s": scaled("--rotate-minutes", wanted.rotate_minutes, 60.0),
        "duration_s": scaled("--duration", wanted.duration, 1.0),
        "live": wanted.live or None,
        "decode": False if wanted.no_decode else None,
        "campaign": wanted.campaign,
        "state": wanted.state,
        "forget_s": scaled("--forget-minutes", wanted.forget_minutes, 60.0),
    }
    told: dict[str, Any] = {k: v for k, v in given.items() if v is not None}
    return replace(settings, ports=with_names(ports), **told)


def config_file(wanted: Wanted) -> Path | None:
    """The file that is meant; without a word of one, that of the working folder, if no port is named."""
    if wanted.config is not None:
        path = wanted.config / FILENAME if wanted.config.is_dir() else wanted.config
        if path.is_file():
            return path
        raise UsageError(f"{path}: there is no such file.")
    here = Path(FILENAME)
    return here if not wanted.ports and here.is_file() else None


def scaled(option: str, value: float | None, unit: float) -> float | None:
    """A positive value in base units."""
    if value is not None and not value > 0:
        raise UsageError(f"{option}: expected a positive number, found {value:g}.")
    return None if value is None else value * unit


def command_line_ports(wanted: Wanted) -> tuple[PortSettings, ...]:
    """The ports of the command line."""
    bauds = per_port("--baud", wanted.bauds, len(wanted.ports))
    if bauds is None and all(interface_of(p) for p in wanted.ports):
        bauds = [0] * len(wanted.ports)
    bitrates = per_port("--bitrate", wanted.bitrates, len(wanted.ports)) or [BITRATE] * len(wanted.ports)
    if wanted.ports and bauds is None:
        raise UsageError(
            "--baud: expected the line rate of each port, found none. Usual: 4800, 38400, 115200."
        )
    protocols = per_port("--protocol", wanted.protocols, len(wanted.ports)) or [Protocol.auto.value] * len(
        wanted.ports
    )
    return tuple(
        as_can(PortSettings(d, b, protocol_of("--protocol", p), bitrate=r))
        for d, b, p, r in zip(wanted.ports, bauds or (), protocols, bitrates, strict=True)
    )


def with_heartbeats(ports: tuple[PortSettings, ...], wanted: bool) -> tuple[PortSettings, ...]:
    """Ports of autopilots are sent heartbeats where that is wanted; no other port is ever sent anything."""
    if not wanted:
        return ports
    if not any(p.protocol is Protocol.mavlink for p in ports):
        raise UsageError("--heartbeat: expected a port with --protocol mavlink to send it to, found none.")
    return tuple(replace(p, heartbeat=p.heartbeat or p.protocol is Protocol.mavlink) for p in ports)


def as_can(port: PortSettings) -> PortSettings:
    """A port that is a CAN interface speaks what its frames are written down in."""
    return replace(port, protocol=Protocol.slcan) if interface_of(port.device) else port


def per_port(option: str, values: Sequence[T], count: int) -> Sequence[T] | None:
    """One value per port: as many as there are ports, or one for all."""
    if len(values) > 1 and len(values) != count:
        expected = "1 value for 1 port" if count == 1 else f"1 or {count} values for {count} ports"
        raise UsageError(f"{option}: expected {expected}, found {len(values)}.")
    return [*values] * count if len(values) == 1 else values or None


def protocol_of(where: str, name: str) -> Protocol:
    """The protocol with a name."""
    if name in Protocol.__members__:
        return Protocol[name]
    near = nearest(name, Protocol.__members__)
    hint = f" Did you mean '{near[0]}'?" if near else ""
    raise UsageError(f"{where}: expected one of {', '.join(Protocol.__members__)}, found '{name}'.{hint}")


def with_names(ports: Iterable[PortSettings]) -> tuple[PortSettings, ...]:
    """Ports with names that are fit for a topic, each its own; the same device twice is an error."""
    named: list[PortSettings] = []
    for port in ports:
        if any(port.device == p.device for p in named):
            raise UsageError(f"{port.device}: named twice; one reader would take the bytes of the other.")
        base = re.sub(r"[^\w.-]+", "_", port.name or Path(port.device).name).strip("_") or "port"
        taken, name, number = {p.name for p in named}, base, 2
        while name in taken or name == "capture":
            name, number = f"{base}_{number}", number + 1
        named.append(replace(port, name=name))
    return tuple(named)


def read_settings(path: Path) -> CaptureSettings:
    """Read a ``capture.toml``.

    Raises
    ------
    CampaignError
        A key is not known, or a value is not possible.
    """
    try:
        table = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CampaignError(path, "the file", "TOML", str(error)) from error
    except OSError as error:
        raise CampaignError(path, "the file", "one that can be read", error.strerror or str(error)) from error
    check_keys(path, "", table, TOP)
    out = Path(table.get("out", DEFAULT_OUT))
    limits = {
        "rotate_bytes": positive(path, table, "rotate_size", 1e6),
        "rotate_s": positive(path, table, "rotate_minutes", 60.0),
        "duration_s": positive(path, table, "duration", 1.0),
        "mute_s": positive(path, table, "mute", 1.0),
        "forget_s": positive(path, table, "forget_minutes", 60.0),
    }
    return CaptureSettings(
        tuple(port_of(path, number, t) for number, t in enumerate(table.get("port", []), 1)),
        out if out.is_absolute() else path.parent / out,
        decode=table.get("decode", True),
        live=table.get("live", False),
        campaign=beside(path, table.get("campaign")),
        state=beside(path, table.get("state")),
        **{k: v for k, v in limits.items() if v is not None},
    )


def beside(path: Path, name: str | None) -> Path | None:
    """A path that the file names, relative to the file."""
    return None if name is None else path.parent / name


def positive(path: Path, table: dict[str, Any], key: str, unit: float) -> float | None:
    """A positive number of the file in base units."""
    if key in table and not table[key] > 0:
        raise CampaignError(path, key, "a positive number", str(table[key]))
    return table[key] * unit if key in table else None


def port_of(path: Path, number: int, table: object) -> PortSettings:
    """One ``[[port]]``."""
    where = f"[[port]] {number}: "
    if not isinstance(table, dict):
        raise CampaignError(path, where.rstrip(": "), "a table", repr(table))
    check_keys(path, where, table, OF_PORT)
    for key in ("device", "baud"):
        if key not in table and not (key == "baud" and interface_of(str(table["device"]))):
            raise CampaignError(path, where + key, SAID[OF_PORT[key][0]], "nothing")
    name = table.get("protocol", "auto")
    if name not in Protocol.__members__:
        wrong_value(
            path, where + "protocol", f"one of {', '.join(Protocol.__members__)}", name, Protocol.__members__
        )
    heartbeat = table.get("heartbeat", False)
    if heartbeat and name != Protocol.mavlink:
        raise CampaignError(path, where + "heartbeat", 'a port with protocol = "mavlink"', f'"{name}"')
    baud, bitrate = table.get("baud", 0), table.get("bitrate", BITRATE)
    return as_can(
        PortSettings(table["device"], baud, Protocol[name], table.get("name", ""), bitrate, heartbeat)
    )


def check_keys(path: Path, where: str, table: dict[str, Any], known: dict[str, tuple[type, ...]]) -> None:
    """Every key is known and its value is of the right kind."""
    for key, value in table.items():
        if key not in known:
            wrong_value(
                path, where + key, f"one of {', '.join(known)}", f"the unknown key '{key}'", known, key
            )
        if not isinstance(value, known[key]) or (isinstance(value, bool) and bool not in known[key]):
            raise CampaignError(path, where + key, SAID[known[key][-1]], repr(value))


def wrong_value(
    path: Path, where: str, expected: str, found: str, known: Iterable[str], word: str | None = None
) -> NoReturn:
    """The error for a word that is none of the known ones, with the nearest of them."""
    near = nearest(word or found, known)
    raise CampaignError(path, where, expected, found, near[0] if near else None)
