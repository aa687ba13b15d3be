"""One call for every estimator and optimiser."""

from __future__ import annotations

from identify.base_fit import Fitted, fit_declared
from identify.by_optimiser import fit_by_optimiser
from identify.by_tuning import fit_by_tuning
from identify.estimators import ESTIMATORS
from identify.prepare import Prepared

#: Estimators that an optimiser can do something for.
TUNABLE = ("output_error", *(n for n, e in ESTIMATORS.items() if e.hyper))


def takes_optimiser(estimator: str) -> bool:
    """Whether an optimiser other than ``auto`` changes anything."""
    return estimator in TUNABLE


def fit_with(prepared: Prepared, estimator: str = "auto", optimiser: str = "auto", seed: int = 0) -> Fitted:
    """Fit the declared structure.

    Parameters
    ----------
    prepared : Prepared
    estimator : str
        ``auto`` and ``output_error`` are windowed output error; the others regress the smoothed states.
    optimiser : str
        With output error, ``auto`` is Gauss-Newton and any other searches the coefficients by population; with a
        regression it chooses the hyper-parameters, which ``auto`` leaves to the estimator.
    seed : int
        Same seed, same fit.
    """
    if estimator in ("auto", "output_error"):
        return (
            fit_declared(prepared) if optimiser == "auto" else fit_by_optimiser(prepared, optimiser, seed)[0]
        )
    return fit_by_tuning(prepared, estimator, optimiser, seed)[0]
