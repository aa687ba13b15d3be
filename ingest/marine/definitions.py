"""The fields of each kind of sentence: from pynmeagps' payload tables, and a few makers' that it lacks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ingest.log import SOURCE

#: Definitions as pynmeagps writes them: field to type (or a group with how often it is repeated).
Payload = Mapping[str, object]

_D, _S, _T, _I = "DE", "ST", "TM", "IN"

#: VectorNav VN-100/200/300 user manual, ASCII output messages; Kongsberg Seatex datagram PSXN.
OWN: Mapping[str, Payload] = {
    "VNYPR": dict.fromkeys(("yaw", "pitch", "roll"), _D),
    "VNQTN": dict.fromkeys(("quat0", "quat1", "quat2", "quat3"), _D),
    "VNQMR": dict.fromkeys(
        ("quat0", "quat1", "quat2", "quat3", "magX", "magY", "magZ", "accelX", "accelY", "accelZ",
         "gyroX", "gyroY", "gyroZ"), _D),
    "VNMAG": dict.fromkeys(("magX", "magY", "magZ"), _D),
    "VNACC": dict.fromkeys(("accelX", "accelY", "accelZ"), _D),
    "VNGYR": dict.fromkeys(("gyroX", "gyroY", "gyroZ"), _D),
    "VNMAR": dict.fromkeys(
        ("magX", "magY", "magZ", "accelX", "accelY", "accelZ", "gyroX", "gyroY", "gyroZ"), _D),
    "VNYMR": dict.fromkeys(
        ("yaw", "pitch", "roll", "magX", "magY", "magZ", "accelX", "accelY", "accelZ", "gyroX", "gyroY",
            "gyroZ"), _D),
    "VNYBA": dict.fromkeys(
        ("yaw", "pitch", "roll", "accelX", "accelY", "accelZ", "gyroX", "gyroY", "gyroZ"), _D),
    "VNYIA": dict.fromkeys(
        ("yaw", "pitch", "roll", "accelX", "accelY", "accelZ", "gyroX", "gyroY", "gyroZ"), _D),
    "VNIMU": dict.fromkeys(
        ("magX", "magY", "magZ", "accelX", "accelY", "accelZ", "gyroX", "gyroY", "gyroZ", "temp",
            "pressure"), _D),
    "VNINS": {
        **dict.fromkeys(("gpsTow", "gpsWeek"), _D), "insStatus": _S,
        **dict.fromkeys(("yaw", "pitch", "roll", "latitude", "longitude", "altitude", "velN", "velE", "velD",
                         "attUncertainty", "posUncertainty", "velUncertainty"), _D),
    },
    "VNGPS": {
        **dict.fromkeys(("gpsTow", "gpsWeek", "gpsFix", "numSats", "latitude", "longitude", "altitude",
                         "velN", "velE", "velD", "accN", "accE", "accD", "speedAcc", "timeAcc"), _D),
    },
    "PSXN20": {"msgId": _S, **dict.fromkeys(("horizontalQuality", "heightQuality", "headingQuality",
        "rollPitchQuality"), _I)},
    "PSXN22": {"msgId": _S, "gyroCalibration": _D, "gyroOffset": _D},
    "PSXN23": {"msgId": _S, "roll": _D, "pitch": _D, "heading": _D, "heave": _D},
}  # fmt: skip

#: Makers' addresses whose first field says which message it is.
WITH_SUBTYPE = ("PASHR", "PTNL", "PSXN", "PUBX", "PSSN")
#: Talkers of satellite receivers: one receiver changes between them as satellites come and go.
GNSS_TALKERS = frozenset({"GN", "GP", "GL", "GA", "GB", "BD", "GQ", "GI", "QZ"})
#: Fields that tell apart the sentences of one formatter: shafts or devices, relative and true wind, transducers.
INSTANCE = (SOURCE, "reference", "tdrtype_01", "tdrid_01")


@dataclass(frozen=True)
class Sentence:
    """One kind of sentence.

    Attributes
    ----------
    topic : str
        Formatter without its talker (``GGA``),
        or the whole address of a maker's sentence (``PASHR``, ``VNYMR``).
    talker : str
        ``GN``, ``HE``, …; ``P`` for a maker's own.
    payload : mapping
        Field to type, empty where nothing is known of it.
    """

    topic: str
    talker: str
    payload: Payload


def sentence_of(address: str, subtype: str) -> Sentence:
    """Return the kind of sentence with an address (``GPGGA``, ``PASHR``) and the text of its first field."""
    from pynmeagps.nmeatypes_get import NMEA_PAYLOADS_GET
    from pynmeagps.nmeatypes_get_prop import NMEA_PAYLOADS_GET_PROP

    if address.startswith("P"):
        sub = subtype if address in WITH_SUBTYPE else ""
        topic = address + sub
        payload = OWN.get(topic) or NMEA_PAYLOADS_GET_PROP.get(topic[1:].upper(), {})
        return Sentence(topic, "P", payload)
    if address.startswith("VN"):
        return Sentence(address, "VN", OWN.get(address, {}))
    return Sentence(address[2:], address[:2], NMEA_PAYLOADS_GET.get(address[2:], {}))


def expand(payload: Payload, fields: int) -> list[tuple[str, str]]:
    """Name and type of each field of a sentence that has so many; repeated groups get ``_01``, ``_02``, ….

    Fields beyond the definition are left out; a sentence without a definition has ``field_01``, ….
    """
    if not payload:
        return [(f"field_{i + 1:02d}", "??") for i in range(fields)]
    return [pair for pair, _ in zip(_flat(payload, fields), range(fields), strict=False)]


def _flat(payload: Payload, fields: int) -> Iterator[tuple[str, str]]:
    before = 0
    for name, kind in payload.items():
        if isinstance(kind, str):
            before += 1
            yield name, kind
        elif isinstance(kind, tuple):
            often, group = kind
            repeats = often if isinstance(often, int) else (fields - before) // max(1, len(group))
            before += repeats * len(group)
            for i in range(repeats):
                yield from ((f"{member}_{i + 1:02d}", str(what)) for member, what in group.items())
