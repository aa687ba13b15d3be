"""One call for every estimator and optimiser."""

from __future__ import annotations

from identify.by_optimiser import fit_by_optimiser
from identify.by_tuning import fit_by_tuning
from identify.estimators import ESTIMATORS
from identify.fitted import Fitted
from identify.free_running import is_lost
from identify.prediction_fit import fit_declared, fit_far_from_noise
from identify.prepare import Prepared
from identify.whole_windows import over_whole_logs

#: Estimators that an optimiser can do something for.
TUNABLE = ("output_error", *(n for n, e in ESTIMATORS.items() if e.hyper))


def takes_optimiser(estimator: str) -> bool:
    """Whether an optimiser other than ``auto`` changes anything."""
    return estimator in TUNABLE


def optimiser_told(estimator: str, optimiser: str) -> str:
    """The name of the optimiser that was at work; ``auto`` where the one that was asked for changes nothing.

    That is Gauss-Newton with output error, and none with a regression.
    """
    return optimiser if takes_optimiser(estimator) else "auto"


def fit_with(prepared: Prepared, estimator: str = "auto", optimiser: str = "auto", seed: int = 0) -> Fitted:
    """Fit the declared structure.

    Parameters
    ----------
    prepared : Prepared
    estimator : str
        ``auto`` and ``output_error`` are windowed output error; the others regress the smoothed states. The bias of
        one that has it is in the fit's structure, as the term 1.
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
    return fit_by_tuning(prepared, estimator, optimiser, seed)


def fit_as_a_run_ends(
    prepared: Prepared, estimator: str = "auto", optimiser: str = "auto", seed: int = 0
) -> Fitted:
    """Fit as ``seatrial run`` ends where it finds no effect: the default goes on over whole logs.

    Near the noise the windows' fit is gone on with; far from it, and where it is lost over the logs that it is of,
    whole logs are fitted free-running where the model can follow them. Parameters are those of ``fit_with``.
    """
    fitted = fit_with(prepared, estimator, optimiser, seed)
    if estimator not in ("auto", "output_error") or optimiser != "auto":
        return fitted
    if fitted.is_far or is_lost(fitted):
        return fit_far_from_noise(prepared.structure, prepared.identify)
    return over_whole_logs(fitted)
