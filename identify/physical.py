"""What a model's coefficients stand for, as the literature writes it: with standard errors, from their covariance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from identify.fit import Fit
from identify.mmg import paper_values
from identify.written import plus_minus
from preprocess.vessel import Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
Coefficients = Mapping[tuple[str, str], float]

#: A value whose standard error is more than this share of it is not identified.
LARGEST_ERROR = 0.5


@dataclass(frozen=True)
class Physical:
    """One parameter of a model as the literature writes it: name, value, standard error, unit."""

    name: str
    value: float
    stderr: float
    unit: str

    @property
    def identifiable(self) -> bool:
        """Whether the data give it."""
        return bool(self.stderr <= LARGEST_ERROR * abs(self.value))

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.name} = {plus_minus(self.value, self.stderr)}{unit}"


def _nomoto1(c: Coefficients, _: Vessel) -> dict[str, float]:
    damping = c["r", "r"]
    out = {"T": -1.0 / damping, "K": -c["r", "δ"] / damping}
    if ("r", "r³") in c:
        out["n_3"] = c["r", "r³"] / damping
    return out


def _nomoto2(c: Coefficients, _: Vessel) -> dict[str, float]:
    """T1 and T2 are the roots of T1 T2 s² + (T1 + T2) s + 1; where they are not real, nothing but K and T3 is."""
    product = -1.0 / c["e1", "r"]
    total = -c["r", "r"] * product
    split = total**2 - 4.0 * product
    out = {"K": c["e1", "δ"] * product, "T_3": c["r", "δ"] / c["e1", "δ"]}
    if split < 0.0:
        return out
    root = math.sqrt(split)
    return {"T_1": 0.5 * (total + root), "T_2": 0.5 * (total - root)} | out


_VALUES: dict[str, Callable[[Coefficients, Vessel], dict[str, float]]] = {
    "nomoto1": _nomoto1, "nomoto_nonlinear": _nomoto1, "nomoto2": _nomoto2, "mmg": paper_values,
}  # fmt: skip
_UNITS = {"K": "1/s", "T": "s", "T_1": "s", "T_2": "s", "T_3": "s", "n_3": "s²"}


def physical(fit: Fit) -> tuple[Physical, ...]:
    """Parameters of a fit as the literature writes them; none where it writes the coefficients themselves.

    ``nomoto1``, ``nomoto2``, ``nomoto_nonlinear``: K and the time constants. ``mmg``: hull derivatives without
    dimension, t_P, t_R, a_H and x_H′, in the order of Yasukawa and Yoshimura 2015, table 3.
    """
    if fit.model not in _VALUES:
        return ()
    places = [k for k, c in enumerate(fit.coefficients) if c.dof]
    keys = [(fit.coefficients[k].dof, fit.coefficients[k].term) for k in places]
    x = np.array([fit.coefficients[k].value for k in places])
    covariance = fit.covariance[np.ix_(places, places)]

    def at(values: FloatArray) -> dict[str, float]:
        return _VALUES[fit.model](dict(zip(keys, map(float, values), strict=True)), fit.vessel)

    try:
        here = at(x)
        slopes = np.column_stack([_slope(at, x, j, list(here)) for j in range(len(x))])
    except (KeyError, ZeroDivisionError):  # an estimator left a term out
        return ()
    errors = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0.0))
    return tuple(
        Physical(n, v, float(e), _UNITS.get(n, "1")) for (n, v), e in zip(here.items(), errors, strict=True)
    )


def _slope(
    function: Callable[[FloatArray], Mapping[str, float]], x: FloatArray, j: int, names: list[str]
) -> FloatArray:
    step = np.zeros(len(x))
    step[j] = 1e-6 * max(abs(float(x[j])), 1e-6)
    up, down = function(x + step), function(x - step)
    return np.array([(up[n] - down[n]) / (2.0 * step[j]) for n in names])


def physical_notes(fit: Fit) -> tuple[str, ...]:
    """Sentences for the report."""
    found = physical(fit)
    if not found:
        return ()
    known = [str(p) for p in found if p.identifiable]
    lost = [p.name for p in found if not p.identifiable]
    notes = [f"As the literature writes it: {', '.join(known)}."] if known else []
    if lost:
        notes.append(f"Standard errors above half of the value: {', '.join(lost)}.")
    if fit.model == "mmg":
        vague = [c.name for c in fit.coefficients if not c.dof and not c.identifiable]
        if vague:
            notes.append(
                f"Known from particulars or literature, not from these data: {', '.join(vague)}. The scale of the "
                "rudder's force is shared by epsilon, gamma_R, t_R and a_H: only products of them show."
            )
    return tuple(notes)
