"""What the flow behind the hull is told by in the model ``mmg``: its parameters, its constants, and its results.

Yasukawa and Yoshimura 2015, eqs. 12-27. Given the velocities, the rudder angle, the revolutions and eight numbers that
describe the flow, ``identify.flow_behind`` gives thrust and the two components of the rudder's normal force, each per
mass, and its derivatives with respect to all of these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ingest.errors import UsageError, nearest
from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Density of the water where the rudder's and the propeller's scale needs one, kg/m³.
WATER = 1000.0
#: What the flow gives, as factors.
RESULTS = ("T_P", "F_Nsinδ", "F_Ncosδ")
#: The channels that it looks at before its own parameters.
INPUTS = ("δ", "n")


@dataclass(frozen=True)
class FlowParameter:
    """A number that describes the flow.

    ``key`` (table, key) is where the campaign may give it; ``usual`` is a value where it does not, ``sd`` how well
    either is known beforehand; ``bounds`` are physically possible.
    """

    name: str
    key: tuple[str, str]
    usual: float
    sd: float
    bounds: tuple[float, float]
    meaning: str


#: In the order of the compiled code. The usual values are those of single-screw ships, near to the tanker KVLCC2's.
PARAMETERS = (
    FlowParameter("w_P0", ("propeller", "wake"), 0.35, 0.05, (0.0, 0.8), "wake fraction on a straight course"),
    FlowParameter("C_2plus", ("propeller", "C2_plus"), 1.6, 0.2, (0.5, 3.0), "wake in a turn, inflow from port"),
    FlowParameter("C_2minus", ("propeller", "C2_minus"), 1.1, 0.2, (0.5, 3.0), "the same from starboard"),
    FlowParameter("epsilon", ("rudder", "epsilon"), 1.09, 0.15, (0.3, 2.0), "(1 − w_R)/(1 − w_P)"),
    FlowParameter("kappa", ("rudder", "kappa"), 0.5, 0.1, (0.0, 1.0), "share of the race's acceleration at the rudder"),
    FlowParameter("gamma_Rplus", ("rudder", "gamma_plus"), 0.6, 0.15, (0.0, 1.5), "flow straightening, β_R > 0"),
    FlowParameter("gamma_Rminus", ("rudder", "gamma_minus"), 0.4, 0.15, (0.0, 1.5), "flow straightening, β_R < 0"),
    FlowParameter("l_R", ("rudder", "l_R"), -0.71, 0.15, (-1.5, 0.0), "effective position of the rudder, ship lengths"),
)  # fmt: skip

#: Places of the constants of a vessel.
CONSTANTS = ("length", "C1", "x_P", "thrust", "diameter", "k0", "k1", "k2", "eta", "rudder", "sign")

_REQUIRED = {
    "propeller": ("diameter", "k0", "k1", "k2"),
    "rudder": ("area", "height"),
}


#: Keys that may be given beside those.
_OPTIONAL = {
    "propeller": ("x_P", "C1", *(p.key[1] for p in PARAMETERS if p.key[0] == "propeller")),
    "rudder": ("lift_slope", "eta", "sign", *(p.key[1] for p in PARAMETERS if p.key[0] == "rudder")),
}


def channel_of(name: str) -> str:
    """Name of the channel that carries one of the parameters."""
    return "=" + name


#: Channels that the flow looks at, in the order of the compiled code.
CHANNELS = (*INPUTS, *(channel_of(p.name) for p in PARAMETERS))
#: Their number; places that each result takes; and all of them.
PLACES = len(CHANNELS)
COLUMNS = 1 + 3 + PLACES
ROOM = len(RESULTS) * COLUMNS


def missing_particulars(vessel: Vessel, inputs: tuple[Input, ...]) -> list[str]:
    """What a campaign does not say and the model ``mmg`` needs."""
    kinds = {i.kind for i in inputs}
    found = [f"[inputs.…] of kind {k}" for k in ("rudder", "propeller") if k not in kinds]
    found += [f"[vessel] {k}" for k in ("draught", "mass") if getattr(vessel, k) is None]
    given = {"propeller": vessel.propeller, "rudder": vessel.rudder}
    found += [f"[vessel.{t}] {k}" for t, keys in _REQUIRED.items() for k in keys if k not in given[t]]
    return found


def constants_of(vessel: Vessel, inputs: tuple[Input, ...]) -> FloatArray:
    """Constants of the flow, in the order of ``CONSTANTS``.

    Raises
    ------
    UsageError
        Where particulars are missing: all of them are named.
    """
    missing = missing_particulars(vessel, inputs)
    if missing or vessel.mass is None:
        raise UsageError(
            f"the model 'mmg' needs particulars that the campaign does not give: {', '.join(missing)}. "
            "K_T = k0 + k1 J + k2 J²; diameter and height in m, area of the rudder in m²."
        )
    for table, given in (("propeller", vessel.propeller), ("rudder", vessel.rudder)):
        known = (*_REQUIRED[table], *_OPTIONAL[table])
        for key in given:
            if key not in known:
                near = nearest(key, known) or known
                raise UsageError(f"[vessel.{table}] {key} is not known; there are {', '.join(near)}.")
    screw, rudder = vessel.propeller, vessel.rudder
    diameter, area, height = screw["diameter"], rudder["area"], rudder["height"]
    count = {k: sum(i.kind == k for i in inputs) for k in ("propeller", "rudder")}
    aspect = height**2 / area
    lift = rudder.get("lift_slope", 6.13 * aspect / (aspect + 2.25))
    return np.array([
        vessel.length, screw.get("C1", 2.0), screw.get("x_P", -0.48),
        count["propeller"] * WATER * diameter**4 / vessel.mass, diameter, screw["k0"], screw["k1"], screw["k2"],
        min(rudder.get("eta", diameter / height), 1.0), count["rudder"] * 0.5 * WATER * area * lift / vessel.mass,
        rudder.get("sign", 1.0),
    ])  # fmt: skip


def known_beforehand(vessel: Vessel) -> dict[str, float]:
    """The parameters' values as the campaign gives them, or usual ones."""
    given: dict[str, Mapping[str, float]] = {"propeller": vessel.propeller, "rudder": vessel.rudder}
    return {p.name: float(given[p.key[0]].get(p.key[1], p.usual)) for p in PARAMETERS}
