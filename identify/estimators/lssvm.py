"""Least-squares support vector machines: primal where the kernel is linear, the dual for all kernels.

With the linear kernel an LSSVM is ridge regression: ½|w|² + ½C Σ e² has its minimum where
|Xw + b - y|² + |w|²/C has it. The primal costs O(l d²), the dual O(l³); the dual stays as the oracle and for
the other kernels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from .estimate import Common, Estimate, FloatArray, KernelMachine, KernelName, Settings
from .judge import Outcome, estimate, residuals
from .kernels import gram, machine_predict
from .linear import DIRECT
from .problem import Problem, compress, problem
from .solve import Solution, dependences, penalised

LARGEST_DUAL = 20_000


@dataclass(frozen=True)
class Machine:
    """Hyper-parameters of an LSSVM.

    Attributes
    ----------
    C : float
        Weight of the squared errors against |w|².
    C_b : float, optional
        Weight of the squared bias (P0 = Xie et al. 2020, eq. 25); 0 leaves it free.
    scaled : bool
        Whether |w|² is that of columns of unit root mean square, so that units do not matter; the papers' is
        not.
    """

    C: float = 1e6
    C_b: float = 0.0
    scaled: bool = True
    form: Literal["primal", "dual"] = "primal"
    kernel: KernelName = "linear"
    parameters: Mapping[str, float] = field(default_factory=dict)


def fit_lssvm(
    design: ArrayLike,
    target: ArrayLike,
    *,
    groups: ArrayLike | None = None,
    C: float = 1e6,
    bias: bool = True,
    scaled: bool = True,
    form: Literal["auto", "primal", "dual"] = "auto",
    kernel: KernelName = "linear",
    kernel_parameters: Mapping[str, float] | None = None,
    **common: Unpack[Common],
) -> Estimate:
    """Least-squares support vector regression (Suykens and Vandewalle 1999).

    Parameters
    ----------
    C : float
        Regularisation: ½|w|² + ½C Σ e².
    bias : bool
        Whether f(x) = w·x + b has its b, which is then part of the model.
    form : {"auto", "primal", "dual"}
        "auto": primal for the linear kernel, dual for the others.
    kernel, kernel_parameters
        See `kernels.gram`; a non-linear kernel gives a machine for `predict`, and no coefficients.
    """
    chosen: Literal["primal", "dual"] = (
        ("primal" if kernel == "linear" else "dual") if form == "auto" else form
    )
    machine = Machine(C, 0.0, scaled, chosen, kernel, dict(kernel_parameters or {}))
    return fit_machine(problem(design, target, groups, bias=bias), machine, Settings(**common))


def fit_eso_lssvm(
    design: ArrayLike,
    target: ArrayLike,
    *,
    groups: ArrayLike | None = None,
    C: float = 1e6,
    C_b: float = 1.0,
    scaled: bool = True,
    form: Literal["primal", "dual"] = "primal",
    **common: Unpack[Common],
) -> Estimate:
    """LSSVM with a penalised bias (Xie et al. 2020, eq. 25-28, with ξ² where eq. 25 prints ξ).

    The target is the observer's acceleration; the caller filters the regressors with the same observer, or
    the two sides lag each other.

    Parameters
    ----------
    C_b : float
        ½C_b b² is added to ½|w|² + ½C Σ ξ²: 0 leaves the bias free, a large value takes it away.
    """
    machine = Machine(C, C_b, scaled, form)
    return fit_machine(problem(design, target, groups, bias=True), machine, Settings(**common))


def fit_machine(data: Problem, machine: Machine, settings: Settings) -> Estimate:
    """Fit any LSSVM to checked data."""
    if machine.C <= 0 or machine.C_b < 0:
        raise ValueError(f"expected C > 0 and C_b >= 0, found {machine.C} and {machine.C_b}")
    if machine.kernel != "linear":
        return _non_linear(data, machine, settings)
    solution, factor = solve_machine(data, machine)
    _, dropped = dependences(factor, settings.tolerance)
    residual = residuals(data, solution.beta)
    hyper = {"C": machine.C, "C_b": machine.C_b}
    outcome = Outcome(solution, residual, dropped, DIRECT, merged=False, hyper=hyper)
    return estimate(data, outcome, settings)


def solve_machine(
    data: Problem, machine: Machine, weights: FloatArray | None = None
) -> tuple[Solution, FloatArray]:
    """Solution for the linear kernel, and the compressed design."""
    small = compress(data, weights)
    solution = penalised(small, penalties(data, machine))
    if machine.form == "dual":
        trained = solve_dual(data, machine, weights)
        w = trained.support.T @ trained.alpha * (data.scale / trained.scale)
        solution = replace(solution, beta=np.append(w, trained.bias) if data.bias else w)
    return solution, small.factor


def penalties(data: Problem, machine: Machine) -> FloatArray:
    """Penalty of each scaled coefficient, (p,)."""
    penalty = np.full(data.design.shape[1], 1 / machine.C)
    if not machine.scaled:
        penalty /= data.scale**2
    return np.append(penalty, machine.C_b / machine.C) if data.bias else penalty


def solve_dual(data: Problem, machine: Machine, weights: FloatArray | None = None) -> KernelMachine:
    """Solve the dual system (Xie et al. 2020, eq. 11 and 28; Zhu et al. 2019, eq. 21) densely, in O(l³).

    Raises
    ------
    ValueError
        Beyond 20,000 rows: the matrix would not fit.
    """
    rows = len(data.target)
    if rows > LARGEST_DUAL:
        raise ValueError(f"the dual needs a dense {rows} x {rows} matrix; use the primal or fewer rows")
    scale = data.scale if machine.scaled else np.ones_like(data.scale)
    support = data.design / scale
    weight = np.ones(rows) if weights is None else weights
    system = np.zeros((rows + 1, rows + 1))
    system[1:, 1:] = gram(machine.kernel, machine.parameters, support, support)
    system[1:, 1:].flat[:: rows + 1] += 1 / (machine.C * weight)
    system[0, 1:] = system[1:, 0] = float(data.bias)
    system[0, 0] = -machine.C_b if data.bias else 1.0
    solved = np.linalg.solve(system, np.concatenate([[0.0], data.target]))
    return KernelMachine(
        machine.kernel, machine.parameters, support, solved[1:], float(solved[0]) if data.bias else 0.0, scale
    )


def _non_linear(data: Problem, machine: Machine, settings: Settings) -> Estimate:
    if machine.form == "primal":
        raise ValueError(f"the {machine.kernel} kernel has no primal of finite size; use the dual")
    trained = solve_dual(data, machine)
    residual = data.target - machine_predict(trained, data.design)
    d = data.design.shape[1]
    return Estimate(
        theta=np.full(d, np.nan),
        covariance=np.full((d, d), np.nan),
        bias=trained.bias,
        sigma=float(np.std(residual)),
        weights=None,
        identifiable=np.zeros(d, dtype=bool),
        reasons=(f"a {machine.kernel} kernel has no coefficient per term",) * d,
        stopped=DIRECT,
        hyper={"C": machine.C, **machine.parameters},
        machine=trained,
    )
