"""A gain counts for less where the windows say that errors are no white noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.sensors import Suite
from identify.base_fit import fit_from_scratch
from identify.fitted import FAR, Fitted
from identify.prepare import prepare
from validate.candidates import candidates, screen
from validate.judgement import FALSE_ALARM, least_gain, significance
from validate.refits import refit
from validate.score_scatter import Scatter, _mean_ratio, moderated, scatter


@pytest.mark.parametrize("times", [1.0, 4.0])
def test_scores_that_scatter_more_than_their_information_are_told(times):
    """The ratio of variances along the parameters that are asked for, whatever the others' scale."""
    random = np.random.default_rng(3)
    root = random.normal(size=(5, 5)) * np.array([1.0, 1e3, 1e-3, 10.0, 1.0])[:, None]
    information = 200 * root @ root.T
    scores = random.normal(size=(200, 5)) @ root.T
    along = np.zeros((5, 5))
    along[1:3, 1:3] = np.eye(2)
    plain = _mean_ratio(information, scores, [1, 2])
    assert plain == pytest.approx(1.0, abs=0.25)
    assert _mean_ratio(information, scores * np.sqrt(times), [1, 2]) == pytest.approx(times * plain)


def _with_heading_bias(seed: int, wander: float) -> Fitted:
    suite = replace(Suite(), position=replace(Suite().position, wander=wander, wander_time=20.0))
    _, trials = trials_of("catamaran", ("zigzag", "random", "zigzag"), 60.0, seed, suite=suite, validate=0)
    prepared = prepare(trials, "modulus")
    fitted = fit_from_scratch(prepared.structure, prepared.identify, length=10.0)
    bias = next(a for a in candidates(fitted.solution.structure) if a.label == "heading_bias")
    return refit(fitted, screen(fitted, [bias])[0])


def test_a_receiver_that_wanders_makes_gains_worth_less():
    white, wandering = (
        np.mean([scatter(_with_heading_bias(s, w), 0).ratio for s in range(3)]) for w in (0.0, 0.15)
    )
    assert white < 1.3
    assert wandering > 1.5


def test_far_from_the_noise_scatter_says_nothing():
    fitted = _with_heading_bias(0, 0.15)
    off = replace(
        fitted.solution, moments=_larger(fitted, 10.0 * FAR), cost=10.0 * FAR * fitted.solution.cost
    )
    assert scatter(replace(fitted, solution=off), 0) == Scatter()


@pytest.mark.parametrize("windows", [5, 12, 40])
@pytest.mark.parametrize("k", [1, 4])
def test_chance_gives_a_gain_as_often_as_is_said_however_few_the_windows(windows, k):
    """Scores that scatter by twice their information: a gain by chance is significant as rarely as is claimed.

    By several parameters more rarely: their scores tell more of the scatter than is counted on.
    """
    random = np.random.default_rng(10 * windows + k)
    draws = 4000
    scores = random.normal(size=(draws, windows, k)) * np.sqrt(2.0 / windows)
    gains = np.sum(scores.sum(axis=1) ** 2, axis=1)
    ratios = np.array([_mean_ratio(np.eye(k), each, list(range(k))) for each in scores])
    p_values = [significance(g, k, 1, moderated(r, windows)) for g, r in zip(gains, ratios, strict=True)]
    share = np.mean(np.array(p_values) < 0.01)
    assert share < 0.025
    assert share > 0.001 or k > 1
    certain = [significance(g / max(1.0, r), k, 1, Scatter()) for g, r in zip(gains, ratios, strict=True)]
    assert share < np.mean(np.array(certain) < 0.01)


def test_what_is_significant_has_more_than_the_least_gain():
    for degrees in (5.0, 30.0, np.inf):
        least = least_gain(2, 30, degrees)
        at = significance(3.0 * least, 2, 30, Scatter(3.0, degrees))
        assert at == pytest.approx(FALSE_ALARM, rel=0.01)


def _larger(fitted: Fitted, times: float):
    moments = fitted.solution.moments
    return replace(moments, matrices=moments.matrices * times, raw=tuple(times * e for e in moments.raw))
