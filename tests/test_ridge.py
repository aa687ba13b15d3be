"""Coefficients that few manoeuvres leave open stay of their natural size; those that the logs determine stay."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import structure_of, trials_of

from benchmarks.papers import cybership
from identify.base_fit import fit_from_scratch
from identify.fitted import FAR, NEAR
from identify.output_error import RIDGE, prior_for
from identify.prepare import prepare
from identify.regression import ABSURD, coefficient_scales, prime_sizes
from identify.ridge import RIDGES, doubt, with_likeliest_ridge
from validate.refits import under


@cache
def sailed(name, manoeuvres):
    ship, trials = trials_of(name, manoeuvres, 90.0, 5, (), validate=1)
    prepared = prepare(trials, ship.model)
    return fit_from_scratch(prepared.structure, prepared.identify)


def scaled(fitted):
    """Coefficients in units of their natural size."""
    s = fitted.solution
    sizes = coefficient_scales(s.structure, s.p, fitted.problem.stretches)
    return np.array(
        [
            s.p[k] / sizes[slot.coefficient]
            for k, slot in enumerate(s.structure.slots)
            if slot.coefficient >= 0
        ]
    )


def test_a_rich_model_on_zigzags_alone_is_kept_from_cancelling_forces():
    """One rudder angle: δ and |δ|δ are one column, and what the one has more the other has less."""
    loose = sailed("cybership", ("zigzag", "zigzag", "zigzag", "circle"))
    tight = with_likeliest_ridge(loose)
    assert loose.prior.ridge == RIDGE
    assert tight.prior.ridge < RIDGE
    assert np.abs(scaled(tight)).max() < np.abs(scaled(loose)).max()
    assert tight.solution.cost < loose.solution.cost + 10.0  # the logs themselves are fitted as well


def test_near_the_noise_but_not_at_it_a_rich_model_is_kept_too():
    """Sensors that are said to be better than they are: what is left of the errors is no noise."""
    loose = sailed("cybership", ("zigzag", "zigzag", "zigzag", "circle"))
    samples = [replace(s.samples, sigma=0.75 * s.samples.sigma) for s in loose.problem.stretches]
    finer = [replace(s, samples=x) for s, x in zip(loose.problem.stretches, samples, strict=True)]
    off = under(replace(loose.problem, stretches=tuple(finer)), loose)
    assert NEAR < off.chi2_per_dof < FAR
    tight = with_likeliest_ridge(off)
    assert tight.prior.ridge < RIDGE
    assert np.abs(scaled(tight)).max() < np.abs(scaled(off)).max()


def test_what_the_logs_determine_stays_where_it_is():
    loose = sailed("catamaran", ("zigzag", "random", "circle", "speed", "random"))
    tight = with_likeliest_ridge(loose)
    information = loose.solution.reduced.information.sum(axis=0)
    sd = np.sqrt(np.diag(np.linalg.inv(information)))
    known = np.array([s.coefficient >= 0 for s in loose.solution.structure.slots])
    moved = np.abs(tight.solution.p - loose.solution.p)[known] / sd[known]
    assert moved.max() < 0.5


def test_a_fit_that_has_the_likeliest_ridge_keeps_it():
    tight = with_likeliest_ridge(sailed("cybership", ("zigzag", "zigzag", "zigzag", "circle")))
    again = with_likeliest_ridge(tight)
    assert again.prior.ridge == tight.prior.ridge
    assert again.solution.total == pytest.approx(tight.solution.total, rel=1e-3)


def test_doubt_is_that_of_the_prior_whatever_the_fit_was_made_with():
    """To second order a fit under one ridge says of another what a fit under that says itself, up to a constant."""
    loose = sailed("catamaran", ("zigzag", "random", "circle", "speed", "random"))
    tight = with_likeliest_ridge(loose)
    s = loose.solution
    sizes = coefficient_scales(s.structure, s.p, loose.problem.stretches)
    sds = [prior_for(s.structure, sizes, r).sd for r in RIDGES]
    one, other = (np.array([doubt(f, sd) for sd in sds]) for f in (loose, tight))
    assert one - one[0] == pytest.approx(other - other[0], abs=3.0)


@pytest.mark.parametrize("share", [1.0, 1e-3])
def test_the_hull_of_a_vessel_that_never_turns_has_no_absurd_coefficients(share):
    """What is divided by hardly any turning would be of any size."""
    ship, trials = trials_of("catamaran", ("zigzag", "speed"), 60.0, 5)
    prepared = prepare(trials, ship.model)
    structure, turning = prepared.structure, np.array([1.0, 1.0, 1.0, 1.0, share, share])
    stretches = [replace(s, states=s.states * turning) for s in prepared.identify]
    sizes = coefficient_scales(structure, np.zeros(len(structure.slots)), stretches)
    prime = prime_sizes(
        structure, float(np.sqrt(np.mean(np.vstack([s.states[:, 3:5] for s in stretches]) ** 2) * 2))
    )
    for term, size, order in zip(structure.table.terms, sizes, prime, strict=True):
        if term.name in ("X_vr", "X_r2"):
            assert size == pytest.approx(order, rel=1e-3) if share < 1.0 else size < ABSURD * order
        if term.name == "X_u":
            assert size < order  # of motion that there is the logs say more than the system


def test_published_coefficients_are_of_the_size_that_every_ridge_leaves_open():
    structure = structure_of("cybership2")
    structure = replace(structure, vessel=cybership.VESSEL)
    sizes = dict(
        zip([(t.dof, t.text) for t in structure.table.terms], prime_sizes(structure, 0.2), strict=True)
    )
    published = {k: v for k, v in cybership.coefficients().items() if np.isfinite(sizes.get(k, np.inf))}
    assert len(published) > 10
    assert all(abs(v) < min(RIDGES) * sizes[k] for k, v in published.items())
