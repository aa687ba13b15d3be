"""The analysis of a campaign: identify, validate, and find what the model lacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import pandas as pd

from identify.estimators import ESTIMATORS
from identify.fit import Fit
from identify.fit_with import fit_with, optimiser_told
from identify.fitted import Fitted
from identify.free_running import free_running_misfit, is_lost
from identify.held_inputs import prepare_best
from identify.in_common import in_common
from identify.models import MODEL_BY_NAME
from identify.own_bias import with_own_bias
from identify.prediction_fit import fit_far_from_noise
from identify.prepare import Prepared
from identify.references import OUTPUT_ERROR, SMOOTHER, in_full
from identify.report_fit import equations, make_fit
from identify.richer_model import richer_model
from identify.whole_windows import sharpest, steadied
from preprocess.cores import side_by_side
from preprocess.trial import Trial
from validate.borne_out import borne_out, rewired
from validate.carried import carried_tables
from validate.diagnosis import MATERIALITY, Diagnosis, Validation
from validate.grown import grown
from validate.loop import search
from validate.outcome import Outcome
from validate.pace import Pace
from validate.rounds import NEARER
from validate.scores import predictions, validation
from validate.search_in_waves import in_known_waves, searched
from validate.sure import surely
from validate.swell import needs_waves, seen_waves, without_waves
from validate.tables import actuator_tables, prediction_tables
from validate.unseen_begins import begun_in
from validate.verdict import diagnose

Progress = Callable[[str, str, float], None]


def silent(stage: str, text: str, fraction: float) -> None:
    """Report nothing."""


@dataclass(frozen=True)
class Analysis:
    """What an analysis found; the fields are those of ``validate.diagnosis.Results``."""

    before: Fit
    after: Fit
    validation_before: Validation
    validation_after: Validation
    diagnosis: Diagnosis | None
    predictions: Mapping[str, pd.DataFrame]
    actuators: Mapping[str, pd.DataFrame]
    equations: tuple[str, ...]
    papers: tuple[str, ...]
    carried: Mapping[str, pd.DataFrame]


def analyse(
    trials: Sequence[Trial],
    *,
    model: str = "auto",
    estimator: str = "auto",
    optimiser: str = "auto",
    seed: int = 0,
    loop: bool = True,
    materiality: float = MATERIALITY,
    grows: bool = False,
    progress: Progress = silent,
) -> Analysis:
    """Identify the declared model on the identify trials, find what it lacks, and validate on the others.

    A model that was chosen, not declared, ``grows``: where it is another by name with the terms that it is found to
    lack, that one is taken for the declared.

    Raises
    ------
    NotIdentifiable
        Where there is nothing to identify on.
    """
    prepared, declared, outcome = _identify(trials, model, estimator, optimiser, seed, loop, progress)
    richer = richer_model(outcome.fitted.solution.structure) if grows and outcome else None
    if richer:
        prepared, declared, outcome = _identify(
            trials, richer, estimator, optimiser, seed, loop, progress, outcome
        )
    if outcome:
        outcome = replace(outcome, fitted=steadied(begun_in(outcome.fitted, prepared.validate)))
    windowed = _windowed(estimator, optimiser)
    declared = _nearest_bare(declared, outcome) if windowed else declared
    progress("validate", "", 0.0)
    far, alone = windowed and declared.is_far, not (outcome and outcome.standing)
    if far or (windowed and alone and is_lost(declared)):
        progress("validate", "whole logs", 0.05)
        declared = fit_far_from_noise(prepared.structure, prepared.identify, declared)
    after = _after(prepared, declared, outcome, far)
    progress("validate", "unseen logs", 0.7)
    if outcome and outcome.standing:
        outcome, after = borne_out(prepared, declared, outcome, after)
    if outcome and after is outcome.fitted:
        outcome = surely(outcome)
        declared = _nearest_bare(declared, outcome) if windowed else declared
        after = _after(prepared, declared, outcome, far)
    near = _nearest(after, outcome)
    waves = seen_waves(near) if loop else None
    waves = waves if waves and needs_waves(near) else None
    if waves is None:
        declared, after, outcome = _without_waves(declared, after, outcome)
    in_windows = _nearest_in_windows(declared, outcome) if windowed and after is declared else after
    if windowed:
        declared, after, outcome = _finished(declared, after, outcome)
    stretches = [*prepared.identify, *prepared.validate]
    runs = [predictions(f.solution.structure, f.solution.p, stretches) for f in (declared, after)]
    scored = [validation(prepared.structure, stretches, r) for r in runs]
    made = [
        _told(prepared, f, _estimator(estimator), optimiser, seed)
        for f in ([declared] if after is declared else [declared, after])
    ]
    progress("validate", "what is left", 0.8)
    diagnosis = diagnose(prepared, outcome, in_windows, waves, materiality, after) if outcome else None
    predicts = prepared.structure.model.predicts
    tables = prediction_tables(trials, stretches, predicts, runs[0], runs[1])
    progress("validate", "", 1.0)
    return Analysis(
        made[0], made[-1], scored[0], scored[1], diagnosis, tables,
        actuator_tables(after.solution.structure, after.solution.p, stretches, tables),
        equations(after), _papers(prepared, after, _estimator(estimator)),
        carried_tables(after.solution.structure, after.solution.p, stretches, tables),
    )  # fmt: skip


def _after(prepared: Prepared, declared: Fitted, outcome: Outcome | None, far: bool) -> Fitted:
    """The fit with what was found; with the wiring alone put right, where it alone stands, far from the noise."""
    if outcome is None or not outcome.standing:
        return declared
    if far and outcome.fitted.is_far and all(s.active.effect.rewire for s in outcome.standing):
        return rewired(prepared, outcome)
    return outcome.fitted


def _nearest_bare(declared: Fitted, outcome: Outcome | None) -> Fitted:
    """The declared model's fit; or one that a search held candidates against, or was left with, if clearly nearer.

    A search may find the declared model's better valley from where a candidate led. Nearer in windows is not enough of
    a fit that predicts its own logs worse over their whole length.
    """
    found = _nearest_in_windows(declared, outcome)
    strays = [f.remembered(free_running_misfit) for f in (declared, found)]
    return found if strays[1] <= strays[0] else declared


def _nearest_in_windows(declared: Fitted, outcome: Outcome | None) -> Fitted:
    """The declared model's fit, or the nearest of a search's own that are clearly nearer in windows as long.

    Few short logs leave a rich model's values open, by which its free runs go anywhere: that is no structure that it
    lacks, as long as there are values that windows agree with.
    """
    if outcome is None or outcome.wiring:
        return declared
    bare = [f for f in (*(t.base for t in outcome.turns), outcome.fitted) if _clearly_nearer(f, declared)]
    return min(bare, key=lambda f: f.chi2_per_dof, default=declared)


def _clearly_nearer(found: Fitted, declared: Fitted) -> bool:
    """Whether a fit of the declared model is clearly nearer the noise, in windows as long."""
    alike = found.solution.structure.actives == declared.solution.structure.actives
    long = found.problem.length >= declared.problem.length
    return alike and long and found.chi2_per_dof < NEARER * declared.chi2_per_dof


def _nearest(after: Fitted, outcome: Outcome | None) -> Fitted:
    """The last fit, or that of the search, if it has the same effects and is nearer the noise."""
    if outcome is None or outcome.fitted.solution.structure.actives != after.solution.structure.actives:
        return after
    return min(after, outcome.fitted, key=lambda f: f.chi2_per_dof)


def _identify(
    trials: Sequence[Trial],
    model: str,
    estimator: str,
    optimiser: str,
    seed: int,
    loop: bool,
    progress: Progress,
    found: Outcome | None = None,
) -> tuple[Prepared, Fitted, Outcome | None]:
    """The declared model's fit, and what it lacks; ``found`` is what a simpler one was found to lack."""
    progress("identify", "", 0.0)
    progress("identify", "how the inputs act", 0.02)
    prepared = with_own_bias(prepare_best(trials, _model(trials, model)), estimator)
    progress("identify", "the declared model", 0.4)
    declared = fit_with(prepared, estimator, optimiser, seed)
    progress("identify", "", 1.0)
    if not loop:
        return prepared, declared, None
    progress("diagnose", "", 0.0)
    pace = Pace(partial(progress, "diagnose"))
    outcome = grown(prepared, found, pace) if found else None
    if not _windowed(estimator, optimiser):
        outcome = outcome or search(prepared, None, pace)
    elif outcome:
        prepared, declared = in_known_waves(prepared, declared)
    else:
        prepared, declared, outcome = searched(prepared, declared, pace)
    progress("diagnose", "", 1.0)
    return prepared, declared, outcome


def _without_waves(
    declared: Fitted, after: Fitted, outcome: Outcome | None
) -> tuple[Fitted, Fitted, Outcome | None]:
    """The fits without waves that they know of: what nobody is told of may explain nothing."""
    bare: dict[int, Fitted] = {}

    def told(fitted: Fitted) -> Fitted:
        if id(fitted) not in bare:
            bare[id(fitted)] = without_waves(fitted)
        return bare[id(fitted)]

    return told(declared), told(after), outcome and replace(outcome, fitted=told(outcome.fitted))


def _finished(
    declared: Fitted, after: Fitted, outcome: Outcome | None
) -> tuple[Fitted, Fitted, Outcome | None]:
    """The fits gone on with over whole logs where they are at the noise: what is reported is as sharp as the data."""
    fits = [declared] if after is declared else [declared, after]
    whole, *others = side_by_side(sharpest, fits, shared=in_common(*fits))
    found = others[0] if others else whole
    if outcome is None or after is not outcome.fitted:
        return whole, found, outcome
    return whole, found, replace(outcome, fitted=found)


def _windowed(estimator: str, optimiser: str) -> bool:
    """Whether the declared model was fitted as the loop fits."""
    return _estimator(estimator) == "output_error" and optimiser == "auto"


def _model(trials: Sequence[Trial], name: str) -> str:
    """The declared model, or the simplest that the data support."""
    if name != "auto":
        return name
    from identify.choose_model import choose_model

    return choose_model(trials)[0]


def _estimator(name: str) -> str:
    return "output_error" if name == "auto" else name


def _told(prepared: Prepared, fitted: Fitted, estimator: str, optimiser: str, seed: int) -> Fit:
    """The data shape of a fit, with how it was made and the speeds that it is of."""
    optimiser = optimiser_told(estimator, optimiser)
    fit = make_fit(prepared, fitted, estimator=estimator, optimiser=optimiser, seed=seed)
    return replace(fit, speeds=prepared.speeds)


def _papers(prepared: Prepared, fitted: Fitted, estimator: str) -> tuple[str, ...]:
    """What the model, what it lacks, the estimator and the smoother rest on."""
    structure = fitted.solution.structure
    method = ESTIMATORS[estimator].source if estimator in ESTIMATORS else OUTPUT_ERROR
    smoother = [] if any(s.observed for s in prepared.identify) else [SMOOTHER]
    model = MODEL_BY_NAME[structure.model.name].source
    return in_full([model, *(a.effect.source for a in structure.actives), method, *smoother])
