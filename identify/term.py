"""The text of a regressor, and the product of factors that it stands for.

A term is written as the field writes it: ``|v|r``, ``Δu³/U``, ``δ²U²``. Its factors are velocities of the hull
through the water, powers of the speed, states of their own (``e1``, ``e2``), the air's relative velocity, thrust and
rudder force by the flow behind the hull (``T_P``, ``F_Nsinδ``, ``F_Ncosδ``: ``identify.flow``), or channels: time
series made from the inputs (``δ``, ``|n|n``, ``T:thruster``).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

#: Factors that the compiled rollout knows, in the order of its table; channels follow.
FACTORS = (
    "1", "u", "v", "r", "|u|", "|v|", "|r|", "U", "Δu", "/U", "e1", "e2", "Vwx", "Vwy", "T_P", "F_Nsinδ", "F_Ncosδ",
)  # fmt: skip

#: At most this many factors in one product.
MOST_FACTORS = 6

_POWERS = {"²": 2, "³": 3, "⁴": 4}
_TOKEN = re.compile(
    r"T_P|F_N(?:sin|cos)δ|−|\|n\|n|\|n\||\|[uvrδ]\||Δu|/U|F_y|N_F|Vwx|Vwy|e1|e2|[TFNP]:[A-Za-z0-9_\-]+|[uvrUTδ1]"
)

_SI = {"u": "m/s", "v": "m/s", "r": "rad/s", "U": "m/s", "Δu": "m/s"}

#: (power of metre, of second) that each factor carries; angles count as numbers.
_DIMENSIONS: dict[str, tuple[int, int]] = {
    "u": (1, -1), "v": (1, -1), "|u|": (1, -1), "|v|": (1, -1), "U": (1, -1), "Δu": (1, -1), "/U": (-1, 1),
    "r": (0, -1), "|r|": (0, -1), "|n|n": (0, -2), "|n|": (0, -1), "Vwx": (2, -2), "Vwy": (2, -2), "e2": (0, -1),
    "T_P": (1, -2), "F_Nsinδ": (1, -2), "F_Ncosδ": (1, -2),
}  # fmt: skip


@cache
def factors_of(term: str) -> tuple[str, ...]:
    """Factors of a term, powers written out: ``"Δu³/U"`` gives ``("Δu", "Δu", "Δu", "/U")``.

    Raises
    ------
    ValueError
        Where the text holds something that is no factor, or too many of them.
    """
    found: list[str] = []
    place = 0
    while place < len(term):
        match = _TOKEN.match(term, place)
        if match is None:
            raise ValueError(f"term '{term}': nothing known begins at '{term[place:]}'")
        place = match.end()
        power = _POWERS.get(term[place : place + 1], 1)
        place += power > 1
        found += [match.group()] * power
    if len(found) > MOST_FACTORS:
        raise ValueError(f"term '{term}' has {len(found)} factors, at most {MOST_FACTORS} are supported")
    return tuple(found)


def unit_of(term: str, dof: str) -> str:
    """SI unit of the coefficient of ``term`` in the acceleration of ``dof`` (u, v: m/s²; r: rad/s²)."""
    metres, seconds = (0, -2) if dof not in ("u", "v") else (1, -2)
    for factor in factors_of(term):
        m, s = _DIMENSIONS.get(factor) or _of_channel(factor)
        metres, seconds = metres - m, seconds - s
    return _unit_text(metres, seconds)


def _of_channel(name: str) -> tuple[int, int]:
    """Thrust is in (rev/s)² for a propeller and a number for the others; a moment has an arm."""
    arm = int(name.startswith("N:"))
    return arm, -2 if name.startswith("P:") or name.endswith(":propeller") else 0


def _unit_text(metres: int, seconds: int) -> str:
    above = [_power(n, p) for n, p in (("m", metres), ("s", seconds)) if p > 0]
    below = [_power(n, -p) for n, p in (("m", metres), ("s", seconds)) if p < 0]
    text, under = "·".join(above) or "1", "·".join(below)
    return text + (f"/({under})" if len(below) > 1 else f"/{under}" if below else "")


def _power(name: str, power: int) -> str:
    return name + {1: "", 2: "²", 3: "³", 4: "⁴"}.get(power, f"^{power}")


@dataclass(frozen=True)
class Term:
    """One regressor in one equation.

    Attributes
    ----------
    dof : str
        ``u``, ``v``, ``r``, or an extra state ``e1``, ``e2``.
    text : str
        As declared.
    role : str
        ``"hull"``, ``"inertial"`` (Coriolis: does not scale with the forces), ``"thrust"``, ``"rudder"``, ``"air"``,
        ``"bias"``, ``"roll"``: tells effects on loading and on shallow water what to act on.
    positive : bool
        True for a gain whose sign geometry gives.
    """

    dof: str
    text: str
    role: str = "hull"
    positive: bool = False

    @property
    def name(self) -> str:
        """``Y_uv``: X, Y, N for surge, sway and yaw, then the term in letters and digits."""
        letter = {"u": "X", "v": "Y", "r": "N"}.get(self.dof, self.dof.upper())
        return letter + "_" + self.text.translate(_LETTERS)


def brakes(terms: Iterable[Term]) -> frozenset[Term]:
    """Terms that slow a fast motion down: per equation the highest odd power of its own motion, if it is not linear.

    (``u|u|``, ``r³``: no coefficient above zero is a resistance.) The linear term is of either sign: a ship may be
    unstable on its course.
    """
    degree = {t: _own_odd_power(t) for t in terms}
    highest = {t.dof: max(n for o, n in degree.items() if o.dof == t.dof) for t in degree}
    return frozenset(t for t, n in degree.items() if n > 1 and n == highest[t.dof])


def _own_odd_power(term: Term) -> int:
    """The power of a term in its equation's own velocity, with the sign of this; 0 of another term."""
    factors = factors_of(term.text)
    alone = set(factors) <= {term.dof, f"|{term.dof}|"}
    return len(factors) if alone and factors.count(term.dof) % 2 else 0


def products_of(terms: Iterable[Term]) -> set[tuple[str, tuple[str, ...]]]:
    """Every term as its equation and its factors, in whatever order it is written."""
    return {(t.dof, tuple(sorted(factors_of(t.text)))) for t in terms}


#: How symbols are written in names.
_LETTERS = str.maketrans({"²": "2", "³": "3", "⁴": "4", "/": "_", "Δ": "d", "δ": "delta"})
