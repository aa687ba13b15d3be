"""The same data through several models, estimators and optimisers."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from identify.choose_model import CONSIDERED, RICH, missing_inputs
from identify.fit_with import fit_as_a_run_ends, optimiser_told
from identify.models import MODEL_BY_NAME
from identify.predict import free_run
from identify.prepare import Prepared, prepare
from ingest.errors import DataError, SeatrialError, UsageError
from preprocess.trial import Trial
from preprocess.trials import make_trials
from seatrial.blas import one_blas_thread
from seatrial.campaign import check_number
from seatrial.parallel import map_tasks
from seatrial.pipeline import read_logs, runs_of
from seatrial.progress import Progress, silent
from validate.scores import held_after_running_away, predictions, validation

if TYPE_CHECKING:
    import pandas as pd

    from identify.stretch import Stretch
    from seatrial.campaign import Campaign

#: What is compared where nothing is said: the default beside what the papers use.
ESTIMATORS = ("output_error", "weak_form", "ls", "rw_lssvr")
OPTIMISERS = ("auto",)
CHANNELS = ("u", "v", "r")
#: Models of many coefficients are compared where more logs than this are identified on.
SEVERAL = 2
COLUMNS = (
    "model", "estimator", "optimiser", "error", "r2_u", "r2_v", "r2_r", "fitness", "position_rmse", "heading_rmse",
    "error_identify", "parameters", "seconds", "note",
)  # fmt: skip


@dataclass(frozen=True)
class Method:
    """One way to a model."""

    model: str
    estimator: str = "output_error"
    optimiser: str = "auto"

    @property
    def label(self) -> str:
        """``blanke, output_error + aco_r``."""
        search = "" if self.optimiser == "auto" else f" + {self.optimiser}"
        return f"{self.model}, {self.estimator}{search}"


@dataclass(frozen=True)
class Task:
    """A method on these trials, as data for another process."""

    trials: tuple[Trial, ...]
    method: Method
    seed: int


def methods(
    models: Sequence[str], estimators: Sequence[str], optimisers: Sequence[str]
) -> tuple[Method, ...]:
    """Every combination that makes a difference: an estimator without hyper-parameters needs no optimiser."""
    named = ["output_error" if e == "auto" else e for e in estimators]
    every = (Method(m, e, optimiser_told(e, o)) for m, e, o in product(models, named, optimisers))
    return tuple(dict.fromkeys(every))


def models_for(trials: Sequence[Trial]) -> tuple[str, ...]:
    """Models whose inputs exist; those of many coefficients where several logs are there to tell them."""
    first = trials[0]
    several = sum(t.role == "identify" for t in trials) > SEVERAL
    every = (*CONSIDERED, *(RICH if several else ()))
    return tuple(m for m in every if not missing_inputs(m, first.vessel, first.inputs_declared))


def left_aside(trials: Sequence[Trial]) -> Iterator[dict[str, object]]:
    """A row without figures for each model that the inputs cannot drive; its note says why."""
    first = trials[0]
    for name in CONSIDERED:
        note = missing_inputs(name, first.vessel, first.inputs_declared)
        if note:
            yield {"model": name, "estimator": "", "optimiser": "", "note": f"not compared: {note}"}


@one_blas_thread()
def compare(
    campaign: Campaign,
    models: Sequence[str] = (),
    estimators: Sequence[str] = ESTIMATORS,
    optimisers: Sequence[str] = OPTIMISERS,
    *,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> pd.DataFrame:
    """Fit every combination to the same data and predict what it has not seen.

    Parameters
    ----------
    campaign : Campaign
    models : sequence of str
        By default all whose inputs exist.
    estimators, optimisers : sequence of str
    seed, workers, scheduler
        As elsewhere.

    Returns
    -------
    DataFrame
        One row per method, best first. ``error`` is the free-running error on the logs that validate (where none
        does, on those identified on): root mean square over u, v, r in units of each channel's standard deviation;
        a channel that a model does not predict counts as its mean. ``seconds`` are processor seconds of the fit.
        ``note`` says what went wrong; what gave no model, or was not tried, comes last, without an error.

    Raises
    ------
    UsageError
        The seed or the number of processes is none.
    DataError
        Where no method gave a model.
    """
    check_number("seed", seed, 0)
    check_number("workers", workers, 1)
    progress("ingest", "", 0.0)
    logs = read_logs(campaign, workers)
    progress("preprocess", "", 0.0)
    sensors = {s.quantity: s for s in campaign.sensors}
    runs = runs_of(campaign, logs)
    trials = make_trials(
        runs, campaign.vessel, campaign.inputs, sensors, lambda _name, _share: None, campaign.smoothing
    )
    every = not models or "auto" in models
    chosen = methods(models_for(trials) if every else models, estimators, optimisers)
    found = list(rows(trials, chosen, seed, workers, scheduler, progress))
    return table_of_methods([*found, *(left_aside(trials) if every else ())])


def rows(
    trials: tuple[Trial, ...],
    chosen: Sequence[Method],
    seed: int,
    workers: int,
    scheduler: str | None,
    progress: Progress,
) -> Iterator[dict[str, object]]:
    """A row per method, in the order of finishing."""
    tasks = [Task(trials, m, seed) for m in chosen]
    for count, done in enumerate(map_tasks(score_method, tasks, workers, scheduler), 1):
        method = chosen[done.index]
        progress("identify", method.label, count / len(tasks))
        if done.failure is None:
            yield done.result()
        else:
            yield _failed(method, done.failure.error())


def _failed(method: Method, error: Exception) -> dict[str, object]:
    if not isinstance(error, SeatrialError | ValueError | ArithmeticError):
        raise error
    return {
        "model": method.model,
        "estimator": method.estimator,
        "optimiser": method.optimiser,
        "note": str(error),
    }


@one_blas_thread()
def score_method(task: Task) -> dict[str, object]:
    """Fit and score one method.

    Raises
    ------
    UsageError
        The model is not there.
    """
    if task.method.model not in MODEL_BY_NAME:
        raise UsageError(f"the model '{task.method.model}' cannot be fitted here.")
    prepared = prepare(task.trials, task.method.model)
    began = time.process_time()
    fitted = fit_as_a_run_ends(prepared, task.method.estimator, task.method.optimiser, task.seed)
    seconds = time.process_time() - began
    structure, p = fitted.solution.structure, fitted.solution.p
    unseen = prepared.validate or prepared.identify
    free = [free_run(structure, p, s) for s in unseen]
    predicted = [held_after_running_away(f) for f in free]
    scores = validation(structure, prepared.validate, predicted if prepared.validate else [])
    own = predictions(structure, p, prepared.identify) if prepared.validate else predicted
    return {
        "model": task.method.model,
        "estimator": task.method.estimator,
        "optimiser": task.method.optimiser,
        "error": _error(structure.model.predicts, unseen, predicted),
        **{f"r2_{c}": scores.channels[c].r2 for c in CHANNELS},
        "fitness": scores.fitness,
        "position_rmse": scores.position_rmse,
        "heading_rmse": scores.heading_rmse,
        "error_identify": _error(structure.model.predicts, prepared.identify, own),
        "parameters": len(structure.simple),
        "seconds": seconds,
        "note": _note(prepared, free),
    }


def _note(prepared: Prepared, free: Sequence[np.ndarray]) -> str:
    """What is to be said of a prediction."""
    away = sum(not np.isfinite(f).all() for f in free)
    notes = (f"runs away in {away} of {len(free)} stretches that are predicted",) if away else ()
    if not prepared.validate:
        notes = (*notes, "no log validates: the error is of the logs identified on")
    return "; ".join(notes)


def _error(predicts: Sequence[str], stretches: Sequence[Stretch], predicted: Sequence[np.ndarray]) -> float:
    measured = np.vstack([s.states[:, 3:6] for s in stretches])
    difference = np.vstack([q[:, 3:6] for q in predicted]) - measured
    share = np.mean(difference**2, axis=0) / np.maximum(np.var(measured, axis=0), 1e-18)
    counted = np.where([c in predicts for c in CHANNELS], share, 1.0)
    return float(np.sqrt(np.mean(counted)))


def table_of_methods(found: Sequence[dict[str, object]]) -> pd.DataFrame:
    """The rows as a table, best first; those that gave no model last.

    Raises
    ------
    DataError
        Where none did.
    """
    import pandas as pd

    table = pd.DataFrame(list(found)).reindex(columns=list(COLUMNS))
    table["error"] = table["error"].astype(float)
    if not np.isfinite(table["error"]).any():
        raise DataError(
            f"no method gave a model: {table['note'].iloc[0] if len(table) else 'nothing to compare'}"
        )
    keys = ["error", "seconds", "model", "estimator", "optimiser"]
    return table.sort_values(keys, na_position="last", kind="stable", ignore_index=True)
