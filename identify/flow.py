"""Thrust and rudder force by the flow behind the hull: what is not a product of factors in the model ``mmg``.

Yasukawa and Yoshimura 2015, eqs. 12-27. Given the velocities, the rudder angle, the revolutions and eight numbers that
describe the flow, ``flow`` gives thrust and the two components of the rudder's normal force, each per mass, and its
derivatives with respect to all of these.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit

from identify.simd import COMPILED
from ingest.errors import UsageError, nearest
from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
PlaceArray = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]

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


@njit(**COMPILED)  # type: ignore[untyped-decorator]
def flow(q: FloatArray, place: PlaceArray, constants: FloatArray, at: int) -> None:
    """Put thrust, F_N sin δ and F_N cos δ, all per mass, and their derivatives in ``q`` from place ``at`` on.

    Each takes ``COLUMNS`` places: its value, then its derivatives by u, v, r, and the channels.

    Parameters
    ----------
    q : (values,)
        Values of the tape: u, v, r at 1, 2, 3.
    place : (10,)
        Where in it the channels of ``CHANNELS`` are.
    constants : (11,)
        As ``constants_of`` gives them.
    """
    length, c1, x_p, thrust, d = constants[0], constants[1], constants[2], constants[3], constants[4]
    k0, k1, k2, eta, rudder = constants[5], constants[6], constants[7], constants[8], constants[9]
    u, v, r = q[1], q[2], q[3]
    sign = constants[10]
    delta, n, w0 = sign * q[place[0]], q[place[1]], q[place[2]]
    epsilon, kappa, l_r = q[place[5]], q[place[6]], q[place[9]]
    speed = max(math.sqrt(u * u + v * v), 1e-3)
    beta, turn = math.atan2(-v, u), r * length / speed
    beta_u, beta_v = v / (speed * speed), -u / (speed * speed)
    turn_u, turn_v, turn_r = -turn * u / (speed * speed), -turn * v / (speed * speed), length / speed
    # the wake in a turn
    inflow = beta - x_p * turn
    side = 1.0 if inflow > 0 else -1.0
    c2 = q[place[3]] if inflow > 0 else q[place[4]]
    decay = math.exp(-c1 * abs(inflow))
    growth = 1.0 + (1.0 - decay) * (c2 - 1.0)
    share = (1.0 - w0) * growth
    by_inflow = (1.0 - w0) * (c2 - 1.0) * c1 * decay * side
    a = u * share
    a_u = share + u * by_inflow * (beta_u - x_p * turn_u)
    a_v, a_r = u * by_inflow * (beta_v - x_p * turn_v), -u * by_inflow * x_p * turn_r
    a_w, a_c = -u * growth, u * (1.0 - w0) * (1.0 - decay)
    # thrust
    by_a = thrust * (k1 * abs(n) / d + 2.0 * k2 * abs(a) / (d * d))
    by_n = thrust * (2.0 * k0 * abs(n) + k1 * math.copysign(1.0, n) * a / d)
    q[at + 0] = thrust * (k0 * n * abs(n) + k1 * abs(n) * a / d + k2 * a * abs(a) / (d * d))
    # the race, and what of it reaches the rudder
    loading = 8.0 / math.pi
    square = a * a + loading * (k0 * n * n * d * d + k1 * n * d * a + k2 * a * a)
    race = math.sqrt(max(square, 1e-8))
    race_a, race_n = 0.0, 0.0
    if square > 1e-8:
        race_a = (a + loading * (0.5 * k1 * n * d + k2 * a)) / race
        race_n = loading * (k0 * n * d * d + 0.5 * k1 * d * a) / race
    behind = a + kappa * (race - a)
    both = max(math.sqrt(eta * behind * behind + (1.0 - eta) * a * a), 1e-6)
    both_a = (eta * behind * (1.0 + kappa * (race_a - 1.0)) + (1.0 - eta) * a) / both
    both_n, both_k = eta * behind * kappa * race_n / both, eta * behind * (race - a) / both
    along = epsilon * both
    inflow_r = beta - l_r * turn
    gamma = q[place[7]] if inflow_r > 0 else q[place[8]]
    across = speed * gamma * inflow_r
    across_u = gamma * (u / speed * inflow_r + speed * (beta_u - l_r * turn_u))
    across_v = gamma * (v / speed * inflow_r + speed * (beta_v - l_r * turn_v))
    across_r = -speed * gamma * l_r * turn_r
    # normal force: U_R² sin(δ - atan(v_R/u_R))
    s, c = math.sin(delta), math.cos(delta)
    total = max(math.sqrt(along * along + across * across), 1e-6)
    lift, drag = along * s - across * c, along * c + across * s
    normal = rudder * total * lift
    by_along = rudder * (along / total * lift + total * s)
    by_across = rudder * (across / total * lift - total * c)
    by_delta = rudder * total * drag
    q[at + COLUMNS + 0], q[at + 2 * COLUMNS + 0] = normal * s, normal * c
    e = epsilon * by_along
    for k in range(3):
        by_state = a_u if k == 0 else (a_v if k == 1 else a_r)
        moved = across_u if k == 0 else (across_v if k == 1 else across_r)
        q[at + 1 + k] = by_a * by_state
        q[at + COLUMNS + 1 + k] = e * both_a * by_state + by_across * moved
    q[at + 4], q[at + COLUMNS + 4] = 0.0, by_delta
    q[at + 5], q[at + COLUMNS + 5] = by_n, e * both_n
    q[at + 6], q[at + COLUMNS + 6] = by_a * a_w, e * both_a * a_w
    for k in range(2):
        mine = a_c if (k == 0) == (inflow > 0) else 0.0
        q[at + 7 + k], q[at + COLUMNS + 7 + k] = by_a * mine, e * both_a * mine
    q[at + 9], q[at + COLUMNS + 9] = 0.0, by_along * both
    q[at + 10], q[at + COLUMNS + 10] = 0.0, e * both_k
    for k in range(2):
        mine = speed * inflow_r if (k == 0) == (inflow_r > 0) else 0.0
        q[at + 11 + k], q[at + COLUMNS + 11 + k] = 0.0, by_across * mine
    q[at + 13], q[at + COLUMNS + 13] = 0.0, -by_across * speed * gamma * turn
    for k in range(1, COLUMNS):
        by = q[at + COLUMNS + k]
        q[at + COLUMNS + k], q[at + 2 * COLUMNS + k] = by * s, by * c
    q[at + COLUMNS + 4] = sign * (q[at + COLUMNS + 4] + normal * c)
    q[at + 2 * COLUMNS + 4] = sign * (q[at + 2 * COLUMNS + 4] - normal * s)


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def flow_along(states: FloatArray, channels: FloatArray, constants: FloatArray) -> FloatArray:
    """Thrust, F_N sin δ and F_N cos δ (n, 3) per mass, along states (n, 6) with channels (n, 10)."""
    q, place, out = (
        np.zeros(4 + PLACES + ROOM),
        np.arange(4, 4 + PLACES).astype(np.uint64),
        np.empty((len(states), 3)),
    )
    for i in range(len(states)):
        q[1], q[2], q[3] = states[i, 3], states[i, 4], states[i, 5]
        for k in range(PLACES):
            q[4 + k] = channels[i, k]
        flow(q, place, constants, 4 + PLACES)
        for k in range(3):
            out[i, k] = q[4 + PLACES + k * COLUMNS]
    return out
