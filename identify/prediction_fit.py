"""Fit a structure for prediction: at the noise as it is fitted, far from it by what predicts its own logs best."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from identify.averaged import averaged
from identify.base_fit import SHORT, SHORTEST, fit_from_scratch, fit_states, tried, window_length
from identify.fitted import Fitted
from identify.free_running import free_running_misfit
from identify.in_common import in_common
from identify.joined import Joined
from identify.left_out import groups_of
from identify.noise import calibrated
from identify.output_error import prior_for
from identify.prepare import Prepared
from identify.regression import coefficient_scales, start_by_regression
from identify.ridge import with_likeliest_ridge
from identify.rough_fit import RAN_AWAY
from identify.stretch import Stretch
from identify.structure import Structure, null_parameters
from identify.whole_logs import joined_from_simple
from identify.windows import cut
from ingest.errors import NotIdentifiable
from preprocess.cores import side_by_side

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def fit_declared(prepared: Prepared) -> Fitted:
    """Fit the declared model alone."""
    return fit_for_prediction(prepared.structure, prepared.identify)


def fit_for_prediction(structure: Structure, stretches: tuple[Stretch, ...]) -> Fitted:
    """Fit a structure; far from the noise, by the length of windows that predicts the same logs best, free-running.

    A model that lacks much, or has many terms for little data, fits long windows by coefficients that run away over a
    whole log; shorter windows, or the regression alone, may then serve better.
    """
    fitted = fit_from_scratch(structure, stretches)
    if not fitted.is_far:
        return with_likeliest_ridge(fitted)
    ways = [partial(way, structure, stretches) for way in QUICK_WAYS]
    quick = side_by_side(tried, ways, shared=in_common(fitted))
    return min((fitted, *(f for f in quick if f is not None)), key=_astray)


def fit_far_from_noise(
    structure: Structure, stretches: tuple[Stretch, ...], quick: Fitted | None = None
) -> Fitted:
    """Fit a structure that stays far from the noise: over whole logs, where it follows those better so.

    Whole logs are fitted by windows that are joined ever more firmly, under priors tight and loose, and the mean taken
    that predicts logs left out best: coefficients that are only bent to what the model lacks do not get far. ``quick``
    is what ``fit_for_prediction`` gave, where it is there already.
    """
    quick = quick or fit_for_prediction(structure, stretches)
    with suppress(NotIdentifiable):
        joined = _by_joined_windows(structure, stretches, _astray(quick))
        return min(quick, joined, key=_astray)
    return quick


def _by_short_windows(structure: Structure, stretches: tuple[Stretch, ...]) -> Fitted:
    return fit_from_scratch(structure, stretches, null_parameters(structure), length=SHORT, rounds=0)


def _by_middling_windows(structure: Structure, stretches: tuple[Stretch, ...]) -> Fitted:
    return fit_from_scratch(structure, stretches, null_parameters(structure), length=2.0 * SHORT, rounds=0)


def _by_regression_alone(structure: Structure, stretches: tuple[Stretch, ...]) -> Fitted:
    p = start_by_regression(structure, null_parameters(structure), stretches)
    return _at(structure, stretches, p)


def _by_joined_windows(
    structure: Structure, stretches: tuple[Stretch, ...], others: tuple[bool, float]
) -> Fitted:
    """Whole logs fitted by joined windows, where those follow their logs better than others, by how ``_astray`` it is.

    Raises
    ------
    NotIdentifiable
        Where they do not, or the model cannot be run so.
    """

    def better(joined: Joined) -> bool:
        with suppress(NotIdentifiable):
            return _astray(_at(structure, stretches, joined.p)) < others
        return False

    if structure.has_following_states or "u" not in structure.model.predicts:
        raise NotIdentifiable("the model cannot be run over whole logs.")
    if groups_of(stretches):
        mean = averaged(structure, stretches, better)
        if mean is not None:
            return replace(_at(structure, stretches, mean.p), refits=mean.refits, mean=mean)
    elif (alone := joined_from_simple(structure, stretches)) is not None:
        return _at(structure, stretches, alone.p)
    raise NotIdentifiable("whole logs are not followed better free-running.")


#: A way to fit a structure to stretches.
Way = Callable[[Structure, tuple[Stretch, ...]], Fitted]
#: Ways that cost little.
QUICK_WAYS: tuple[Way, ...] = (_by_short_windows, _by_middling_windows, _by_regression_alone)


def _at(structure: Structure, stretches: tuple[Stretch, ...], p: FloatArray) -> Fitted:
    """Long windows at these parameters, or short ones where they run away in those; only first states are fitted."""
    prior = prior_for(structure, coefficient_scales(structure, p, stretches))
    for length in (window_length(structure.vessel.length), SHORT, SHORTEST):
        problem = cut(stretches, length)
        solution = fit_states(problem, structure, p)
        if np.isfinite(solution.cost):
            return Fitted(calibrated(problem, solution), prior, solution)
    raise NotIdentifiable(RAN_AWAY)


def _astray(fitted: Fitted) -> tuple[bool, float]:
    """Whether a fit runs away, then how far free runs over its own logs are off."""
    return fitted.runs_away, free_running_misfit(fitted)
