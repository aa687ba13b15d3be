"""Masses of the model ``mmg``, and its parameters as Yasukawa and Yoshimura 2015 write them.

The model is fitted as accelerations; with masses and added masses known, its coefficients are the hull derivatives
without dimension (divided by ½ρLdU², lengths by L, speeds by U), thrust deduction, and the rudder's interaction with
the hull.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.flow import WATER, constants_of
from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Hull terms of sway and yaw: text, powers of v and r, name.
LATERAL = (("vU", 1, 0, "v"), ("rU", 0, 1, "R"), ("v³/U", 3, 0, "vvv"), ("v²r/U", 2, 1, "vvr"),
           ("vr²/U", 1, 2, "vrr"), ("r³/U", 0, 3, "rrr"))  # fmt: skip


@dataclass(frozen=True)
class Inertia:
    """Masses of a vessel.

    Mass ``m``, added masses ``m_x``, ``m_y``, kg; centre of gravity ``x_g``, m; ``i_z`` of yaw about the origin, its
    added part, kg m².
    """

    m: float
    m_x: float
    m_y: float
    x_g: float
    i_z: float

    @property
    def lateral(self) -> FloatArray:
        """Matrix (2, 2) of sway and yaw."""
        return np.array([[self.m + self.m_y, self.x_g * self.m], [self.x_g * self.m, self.i_z]])


def inertia_of(vessel: Vessel) -> Inertia:
    """Masses as declared; added masses by Clarke, Gedling and Hine 1983 where they are not (surge: 5 % of the mass)."""
    m, draught = vessel.mass or 0.0, vessel.draught or 1.0
    length, beam = vessel.length, vessel.beam
    x_g = vessel.centre_of_gravity[0] if vessel.centre_of_gravity else 0.0
    own = m * (0.25 * length) ** 2 if vessel.yaw_inertia is None else vessel.yaw_inertia
    block = m / (WATER * length * beam * draught)
    slender, unit = np.pi * (draught / length) ** 2, 0.5 * WATER * length**3
    full = block * beam / draught
    usual = (
        0.05 * m,
        unit * slender * (1.0 + 0.16 * full - 5.1 * (beam / length) ** 2),
        unit * length**2 * slender * (1.0 / 12.0 + 0.017 * full - 0.33 * beam / length),
    )
    m_x, m_y, j_z = vessel.added_mass or usual
    return Inertia(m, float(m_x), float(m_y), x_g, float(own + m * x_g**2 + j_z))


def inertial_terms(vessel: Vessel, inputs: tuple[Input, ...]) -> tuple[tuple[str, str, float], ...]:
    """Accelerations by the turning of the axes, which masses alone give: (dof, term, coefficient)."""
    constants_of(vessel, inputs)
    own = inertia_of(vessel)
    sway, yaw = np.linalg.solve(own.lateral, [-(own.m + own.m_x), -own.x_g * own.m])
    return (("v", "ur", float(sway)), ("r", "ur", float(yaw)))


def paper_values(c: Mapping[tuple[str, str], float], vessel: Vessel) -> dict[str, float]:
    """Hull derivatives, thrust deduction and rudder interaction of coefficients by (dof, term)."""
    own, length = inertia_of(vessel), vessel.length
    ahead, unit = own.m + own.m_x, 0.5 * WATER * length * (vessel.draught or 1.0)
    out = {
        "R_0'": -c["u", "U²"] * ahead / unit,
        "X_vv'": c["u", "v²"] * ahead / unit,
        "X_vr'": (c["u", "vr"] * ahead - own.m - own.m_y) / (unit * length),
        "X_rr'": (c["u", "r²"] * ahead - own.x_g * own.m) / (unit * length**2),
        "X_vvvv'": c["u", "v⁴/U²"] * ahead / unit,
    }
    for row, letter in enumerate("YN"):
        for text, _, j, name in LATERAL:
            force = own.lateral[row] @ [c["v", text], c["r", text]]
            out[f"{letter}_{name}'"] = force / (unit * length ** (j + row))
    side, moment = own.lateral @ [c["v", "F_Ncosδ"], c["r", "F_Ncosδ"]] / own.m
    a_h = -side - 1.0
    out |= {
        "t_P": 1.0 - c["u", "T_P"] * ahead / own.m,
        "t_R": 1.0 + c["u", "F_Nsinδ"] * ahead / own.m,
        "a_H": a_h,
        "x_H'": (-moment / length + 0.5) / a_h if abs(a_h) > 1e-6 else float("nan"),
    }
    return {n: float(v) for n, v in out.items()}
