"""Zhu et al. 2022, table 6: prediction of ψ''' on the 40 % of the run that nothing was identified on.

    python -m benchmarks.papers.p2_table6 [--seeds 5] [--quick]

As in the paper ψ''' is predicted from ψ'', ψ', δ', δ, here from the true ones against the true one; beside it, which
the paper does not give, the heading (rad) of the free run from the rudder alone.
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.nomoto import CARGO, PATROL, STEP, Ship, Voyage, linear, voyage
from benchmarks.papers.p2 import NOISE, TRAINING, measured, methods
from benchmarks.papers.report import command_line, row, spread
from identify.estimators.estimate import FloatArray

PRINTED = {
    "cargo": {"RW-LSSVR": (9.9232e-11, 0.9978), "LS-SVR": (17.454e-11, 0.9961)},
    "patrol": {"RW-LSSVR": (544.53e-11, 0.9974), "LS-SVR": (789.04e-11, 0.9963)},
}


def scores(theta: FloatArray, run: Voyage) -> FloatArray:
    """RMSE and R² of ψ''', RMSE of the heading."""
    missed = np.column_stack([run.acceleration, run.rate, run.delta_rate, run.delta]) @ theta - run.jerk
    rmse = float(np.sqrt(np.mean(missed**2)))
    return np.array([rmse, 1 - rmse**2 / float(np.var(run.jerk)), heading_error(theta, run)])


def heading_error(theta: FloatArray, run: Voyage) -> float:
    """RMSE of the heading from the true state at the begin and the rudder."""
    a = np.array([[0, 1, 0], [0, 0, 1], [0, theta[1], theta[0]]])
    b = np.array([[0.0, 0.0], [0.0, 0.0], [theta[3], theta[2]]])
    first = np.array([run.psi[0], run.rate[0], run.acceleration[0]])
    with np.errstate(over="ignore", invalid="ignore"):
        psi = linear(a, b, np.column_stack([run.delta, run.delta_rate]), STEP, first)[:, 0]
        return float(np.nan_to_num(np.sqrt(np.mean((psi - run.psi) ** 2)), nan=np.inf, posinf=np.inf))


def table(ship: Ship, share: float, seeds: int, iterations: int) -> None:
    """Print the rows of one ship."""
    run = voyage(ship, duration=share * ship.duration)
    training, rest = run.part(0.0, TRAINING), run.part(TRAINING, 1.0)
    row(f"\n{ship.name}", ["RMSE of ψ'''", "R² of ψ'''", "RMSE of ψ"], 34, 28)
    for name, values in PRINTED[ship.name].items():
        row(f"paper: {name}", [f"{x:.4g}" for x in values], 34, 28)
    for noise in (0.0, NOISE):
        print(f"three sines, compass noise {np.degrees(noise):.1f} deg")
        for name, method in methods(iterations).items():
            draws = range(seeds if noise else 1)
            found = np.array([scores(method(ship, measured(training, noise, s), s), rest) for s in draws])
            row(name, [spread(column, ".3g") for column in found.T], 34, 28)


def main() -> None:
    chosen = command_line(__doc__)
    for ship in (CARGO, PATROL):
        table(ship, 0.05 if chosen.quick else 1.0, chosen.seeds, 1 if chosen.quick else 30)


if __name__ == "__main__":
    main()
