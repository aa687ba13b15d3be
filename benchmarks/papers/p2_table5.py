"""Zhu et al. 2022, table 5: parameters of the cargo and of the patrol vessel, errors in %.

    python -m benchmarks.papers.p2_table5 [--seeds 5] [--quick]

The paper's K_R of 0.095 is 5.56 % off, not 5.23. The last lines of each ship compare output error with the Cramér-Rao
bound over three times as many draws of the noise. NaN: the coefficients have no real time constants.
"""

from __future__ import annotations

import numpy as np

from benchmarks.papers.nomoto import CARGO, PATROL, Ship, Voyage, constants_of, voyage
from benchmarks.papers.p2 import NOISE, ORDER, TRAINING, bound, measured, methods, output_error
from benchmarks.papers.report import command_line, row, spread
from identify.estimators.estimate import FloatArray

PRINTED = {
    "cargo": {"RW-LSSVR": (2.689, -0.6667, -2.49, 5.56), "LS-SVR": (4.289, 1.5, -0.68, -3.333)},
    "patrol": {"RW-LSSVR": (0.1006, -4.530, 0.5464, 6.4721), "LS-SVR": (-3.085, -6.574, 4.973, 9.629)},
}


def errors_of(ship: Ship, theta: FloatArray) -> FloatArray:
    """Errors of T1, T2, T3, K in %."""
    true = constants_of(ship.theta)
    return np.asarray(100 * (constants_of(theta) - true) / np.abs(true))


def compared_with_bound(ship: Ship, run: Voyage, draws: int) -> None:
    """Print the bound and how far output error is from it."""
    sd = 100 * bound(ship, run) / np.abs(constants_of(ship.theta))
    found = np.array(
        [errors_of(ship, output_error(ship, measured(run, NOISE, 100 + s), s)) for s in range(draws)]
    )
    row("Cramér-Rao sd", [f"{x:.3g}" for x in sd], 34, 28)
    row("RMSE / Cramér-Rao", [f"{x:.2f}" for x in np.sqrt(np.mean(found**2, axis=0)) / sd], 34, 28)


def main() -> None:
    chosen = command_line(__doc__)
    for ship in (CARGO, PATROL):
        row(f"\n{ship.name}: error in %", list(ORDER), 34, 28)
        for name, values in PRINTED[ship.name].items():
            row(f"paper: {name}", [f"{x:.3g}" for x in values], 34, 28)
        for single in (False, True):
            share = 0.05 if chosen.quick else 1.0
            run = voyage(ship, single=single, duration=share * ship.duration).part(0.0, TRAINING)
            for noise in (0.0, NOISE):
                print(f"{'one sine' if single else 'three sines'}, compass noise {np.degrees(noise):.1f} deg")
                for name, method in methods(1 if chosen.quick else 30).items():
                    draws = range(chosen.seeds if noise else 1)
                    found = np.array(
                        [errors_of(ship, method(ship, measured(run, noise, s), s)) for s in draws]
                    )
                    row(name, [spread(column, ".3g") for column in found.T], 34, 28)
            if not single:
                compared_with_bound(ship, run, 2 if chosen.quick else 3 * chosen.seeds)


if __name__ == "__main__":
    main()
