"""Peers on the runs of ``bench_measured``, in an environment of their own: ``python measured_peers.py RUNS OUT``.

RUNS is an ``.npz`` with, per run k, ``h``, ``states_k`` (n, 3) of u, v, r, ``inputs_k`` (n, m) and ``identify_k``; OUT
gets ``PEER/k`` (n, 3), predicted free-running from the first state, and ``PEER/error`` where a peer did not run.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

Runs = list[tuple[Any, Any, bool]]
#: States beyond this many spreads have run away.
FAR = 30.0


def load(path: str) -> tuple[float, Runs]:
    """Step and runs: states, inputs, whether to identify on it."""
    data = np.load(path)
    count = sum(name.startswith("states_") for name in data)
    runs = [(data[f"states_{k}"], data[f"inputs_{k}"], bool(data[f"identify_{k}"])) for k in range(count)]
    return float(data["h"]), runs


#: Of these thresholds that one is taken that predicts runs left out best.
THRESHOLDS = (0.0, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)


def pysindy_runs(h: float, runs: Runs) -> list[Any]:
    """Sparse polynomial of third degree in u, v, r and the rudder (STLSQ), slopes of smoothed states, Runge-Kutta.

    The threshold is chosen inside the runs to identify on: each is left out in turn and predicted free-running. What
    was found is evaluated here, which is some hundred times as fast as the library's own ``predict``, sample by sample.
    """
    mean, spread = _scales(runs)
    scaled = [((x - mean) / spread, d, used) for x, d, used in runs]
    train = [(x, d) for x, d, used in scaled if used]

    def error(threshold: float) -> float:
        found = []
        for k, (x, d) in enumerate(train):
            rate = _sparse_rate(h, train[:k] + train[k + 1 :], threshold)
            wrong = np.nan_to_num(_runge_kutta(rate, x[0], d, h, len(x)) - x, nan=FAR)
            found.append(min(float(np.sqrt(np.mean((wrong / x.std(axis=0)) ** 2))), 1.0))
        return float(np.mean(np.log(found)))

    rate = _sparse_rate(h, train, min(THRESHOLDS, key=error))
    return [_runge_kutta(rate, x[0], d, h, len(x)) * spread + mean for x, d, _ in scaled]


def _sparse_rate(h: float, train: list[tuple[Any, Any]], threshold: float) -> Callable[[Any, Any], Any]:
    """The slopes of scaled states as pysindy finds them."""
    import pysindy

    library = pysindy.PolynomialLibrary(degree=3)
    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=threshold, alpha=1e-3, normalize_columns=True),
        feature_library=library,
        differentiation_method=pysindy.SmoothedFiniteDifference(),
    )
    model.fit([x for x, _ in train], t=h, u=[d for _, d in train])
    coefficients, powers = np.asarray(model.coefficients()), np.asarray(library.powers_)
    return lambda x, d: coefficients @ np.prod(np.concatenate([x, d]) ** powers, axis=1)


def sysidentpy_runs(h: float, runs: Runs) -> list[Any]:
    """Polynomial NARX of second degree, orthogonal least squares with error reduction ratio, one equation per state."""
    del h
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS

    mean, spread = _scales(runs)
    scaled = [((x - mean) / spread, d, used) for x, d, used in runs]
    predicted = [np.empty_like(x) for x, _, _ in runs]
    for k in range(3):
        model = FROLS(
            order_selection=True,
            n_info_values=15,
            ylag=2,
            xlag=[[1, 2]] * 3,
            basis_function=Polynomial(degree=2),
        )
        train = [(x, d) for x, d, used in scaled if used]
        others = [j for j in range(3) if j != k]
        x = np.vstack([np.column_stack([s[:, others], d]) for s, d in train])
        model.fit(X=x, y=np.concatenate([s[:, k] for s, _ in train])[:, None])
        for out, (s, d, _) in zip(predicted, scaled, strict=True):
            given = np.column_stack([s[:, others], d])
            out[:, k] = model.predict(X=given, y=s[:2, [k]])[:, 0] * spread[k] + mean[k]
    return predicted


#: KVLCC2 at the scale of the runs (Yasukawa and Yoshimura 2015), as the library names and uses it.
PARTICULARS = {
    "L": 7.0, "B": 1.2688, "T": 0.455, "CB": 0.81, "rho": 1000.0, "x_G": 0.2436, "m": 3272.0, "volume": 3.27,
    "I_z": 9908.6,
}  # fmt: skip


def vessel_manoeuvring_models_runs(h: float, runs: Runs) -> list[Any]:
    """Least squares of the accelerations on an Abkowitz model of third order, added masses by its formulas."""
    import pandas as pd
    from vessel_manoeuvring_models.models import vmm_abkowitz_no_thrust as model
    from vessel_manoeuvring_models.models.brix_coefficients import calculate
    from vessel_manoeuvring_models.models.force_from_motion import predict_force
    from vessel_manoeuvring_models.models.regression import ForceRegression

    tables = [(_as_table(pd, h, x, d), used) for x, d, used in runs]
    masses = calculate(pd.DataFrame(PARTICULARS, index=["value"]))["prime"].dropna()
    added = {k: float(v) for k, v in masses.items() if k.endswith("dot")}
    ours = pd.concat([t for t, used in tables if used])
    forces = predict_force(ours, added_masses=added, ship_parameters=PARTICULARS, vmm=model.vmm_abkowitz)
    found = ForceRegression(
        vmm=model.vmm_abkowitz, data=forces, added_masses=added, ship_parameters=PARTICULARS,
        exclude_parameters={"Ythrustdelta": 0.0}, connect_equations_Y_N_rudder=False,
    )  # fmt: skip
    simulator = found.create_model(control_keys=["delta", "thrust"])
    return [_simulated(simulator, t) for t, _ in tables]


def _as_table(pd: Any, h: float, x: Any, d: Any) -> Any:
    """A run as the library takes it: states, their slopes, where it went, rudder; the thrust is not used."""
    slopes = np.gradient(x, h, axis=0)
    psi = np.concatenate([[0.0], np.cumsum(0.5 * h * (x[1:, 2] + x[:-1, 2]))])
    columns = dict(zip(("u", "v", "r", "u1d", "v1d", "r1d"), (*x.T, *slopes.T), strict=True))
    columns |= {"x0": np.zeros(len(x)), "y0": np.zeros(len(x)), "psi": psi, "delta": d[:, 0]}
    return pd.DataFrame(columns | {"thrust": np.zeros(len(x))}, index=h * np.arange(len(x)))


def _simulated(simulator: Any, table: Any) -> Any:
    """Free run (n, 3) of the library's own simulator; NaN from where it gave up, all of it where it raised."""
    out = np.full((len(table), 3), np.nan)
    try:
        found = simulator.simulate(table, method="RK45").result[["u", "v", "r"]].to_numpy(dtype=float)
    except ValueError:
        return out
    out[: len(found)] = found[: len(out)]
    return out


def _scales(runs: Runs) -> tuple[Any, Any]:
    stacked = np.vstack([x for x, _, used in runs if used])
    return stacked.mean(axis=0), stacked.std(axis=0)


def _runge_kutta(rate: Callable[[Any, Any], Any], x: Any, inputs: Any, h: float, count: int) -> Any:
    out = np.full((count, 3), np.nan)
    out[0] = x
    for k in range(count - 1):
        middle = 0.5 * (inputs[k] + inputs[k + 1])
        k1 = rate(x, inputs[k])
        k2 = rate(x + 0.5 * h * k1, middle)
        k3 = rate(x + 0.5 * h * k2, middle)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rate(x + h * k3, inputs[k + 1]))
        if not np.abs(x).max() < FAR:
            break
        out[k + 1] = x
    return out


PEERS: dict[str, Callable[[float, Runs], list[Any]]] = {
    "pysindy": pysindy_runs,
    "sysidentpy (others given)": sysidentpy_runs,
    "vessel-manoeuvring-models": vessel_manoeuvring_models_runs,
}


def main(source: str, target: str) -> None:
    """Run all peers."""
    h, runs = load(source)
    found: dict[str, Any] = {}
    for name, peer in PEERS.items():
        try:
            found |= {f"{name}/{k}": x for k, x in enumerate(peer(h, runs))}
        except (ImportError, NotImplementedError, ValueError, TypeError, AttributeError) as error:
            found[f"{name}/error"] = np.array(f"{type(error).__name__}: {error}"[:160])
    np.savez(target, **found)


if __name__ == "__main__":
    main(*sys.argv[1:3])
