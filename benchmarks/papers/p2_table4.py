"""Zhu et al. 2022, table 4: states seen by the extended state observer and by a Kalman filter.

    python -m benchmarks.papers.p2_table4 [--seeds 5] [--quick]

The observer is that of eq. 8 with the printed gains. The filter (of a linear system, so that "extended" adds nothing)
knows the true parameters and the gear; its covariances are not printed: that of the measurement is the compass's, that
of the process (1e-6)² per sample. The R² 9010 of the paper is 0.9010.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_discrete_are

from benchmarks.papers.library import r_squared
from benchmarks.papers.nomoto import (
    CARGO,
    PATROL,
    STEP,
    Ship,
    Voyage,
    advance,
    observer_as_printed,
    plant,
    recursion,
    voyage,
)
from benchmarks.papers.p2 import NOISE, measured
from benchmarks.papers.report import command_line, row
from identify.estimators.estimate import FloatArray

STATES = ("ψ", "ψ'", "ψ''", "δ")
PRINTED = {
    "cargo": {
        "ESO": ((2.3e-15, 2.3e-11, 3.2e-8, 2.3e-11), (1.0, 0.9999, 0.9732, 1.0)),
        "EKF": ((9.0e-9, 1.0e-7, 6.4e-8, 1.8e-8), (0.9902, 0.9970, 0.9469, 0.8919)),
    },
    "patrol": {
        "ESO": ((2.0e-14, 5.0e-10, 7.3e-8, 5.2e-11), (1.0, 1.0, 0.9651, 1.0)),
        "EKF": ((9.7e-9, 8.4e-7, 7.1e-8, 2.3e-8), (0.9953, 0.9010, 0.9341, 0.8557)),
    },
}
PROCESS = 1e-6


def kalman(ship: Ship, seen: Voyage, noise: float) -> FloatArray:
    """Filtered ψ, ψ', ψ'', δ (l, 4) with the steady gain."""
    a, begin, end = recursion(*plant(ship), STEP)
    c, weight = np.array([[1.0, 0.0, 0.0, 0.0]]), np.array([[max(noise, 1e-6) ** 2]])
    ahead = solve_discrete_are(a.T, c.T, PROCESS**2 * np.eye(4), weight)
    gain = ahead @ c.T / (c @ ahead @ c.T + weight)
    before = advance(
        a - a @ gain @ c, np.hstack([begin, a @ gain]), np.hstack([end, 0.0 * gain]),
        np.column_stack([seen.order, seen.psi]), np.zeros(4),
    )  # fmt: skip
    return np.asarray(before + (seen.psi - before[:, 0])[:, None] * gain.T)


def observer(ship: Ship, seen: Voyage, noise: float) -> FloatArray:
    """Columns ψ, ψ', ψ'', δ of eq. 8."""
    return observer_as_printed(ship, seen.t, seen.psi, seen.order)[:, [0, 1, 3, 2]]


def main() -> None:
    chosen = command_line(__doc__)
    for ship in (CARGO, PATROL):
        run = voyage(ship, duration=0.05 * ship.duration if chosen.quick else None)
        truth = np.column_stack([run.psi, run.rate, run.acceleration, run.delta])
        row(f"\n{ship.name}: RMSE", list(STATES), 30)
        for name, (rmse, r2) in PRINTED[ship.name].items():
            row(f"paper: {name}", [f"{e:.1e} ({r:.4f})" for e, r in zip(rmse, r2, strict=True)], 30)
        for noise in (0.0, NOISE):
            print(f"compass noise {np.degrees(noise):.1f} deg; R² of the median in brackets")
            for name, method in {"ESO": observer, "EKF": kalman}.items():
                draws = range(chosen.seeds if noise else 1)
                seen = [method(ship, measured(run, noise, s), noise) for s in draws]
                errors = np.array([np.sqrt(np.mean((x - truth) ** 2, axis=0)) for x in seen])
                shares = np.median([r_squared(x, truth) for x in seen], axis=0)
                middle = np.median(errors, axis=0)
                cells = [f"{e:.1e} ({s:.4f})" for e, s in zip(middle, shares, strict=True)]
                row(name, cells, 30)


if __name__ == "__main__":
    main()
