"""Coefficients that the data cannot tell apart are told as one, and the prediction is the same."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import trials_of

from identify.fit_with import fit_with
from identify.prepare import prepare
from identify.regression import predicted, regressors
from identify.report_fit import equations, make_fit
from identify.same_columns import same_columns
from identify.simulate.rebuild import rebuild

RATE = 10.0


@cache
def at_rates(spread):
    """A prepared campaign of ``blanke`` whose propellers turn at one rate, or within a share of it, and its fit."""
    trials = trials_of("tanker", ("circle", "circle"), 80.0, 3)[1]
    prepared = prepare([with_rate(t, spread) for t in trials], "blanke")
    return prepared, fit_with(prepared, "ls")


def with_rate(trial, spread):
    inputs = dict(trial.inputs)
    for i in (i for i in trial.inputs_declared if i.kind == "propeller"):
        m = inputs[i.name]
        inputs[i.name] = replace(m, value=RATE * (1.0 + spread * np.sin(0.3 * m.t)))
    return replace(trial, inputs=inputs)


def shared_out(fitted, share):
    """The same fit with a share of the thrust in the constant, as a search within a prior ends."""
    names = [s.name for s in fitted.solution.structure.slots]
    thrust, constant = names.index("X_|n|n"), names.index("X_1")
    p = fitted.solution.p.copy()
    p[constant] += share * RATE**2 * p[thrust]
    p[thrust] *= 1.0 - share
    return replace(fitted, solution=replace(fitted.solution, p=p))


def told(prepared, fitted):
    return make_fit(prepared, fitted, estimator="ls", optimiser="auto", seed=0)


@pytest.mark.parametrize("share", [0.0, 0.7, 1.0])
def test_the_thrust_of_one_rate_and_a_constant_are_one_coefficient_and_the_report_says_so(share):
    prepared, fitted = at_rates(0.0)
    fit, plain = told(prepared, shared_out(fitted, share)), told(prepared, fitted)
    by_name = {c.name: c for c in fit.coefficients}
    assert list(by_name) == [s.name for s in prepared.structure.slots if s.effect < 0 and not s.nuisance]
    assert (by_name["X_1"].value, by_name["X_1"].stderr, by_name["X_1"].identifiable) == (0.0, 0.0, False)
    assert by_name["X_1"].reason == "merged into X_|n|n"
    thrust = next(c for c in plain.coefficients if c.name == "X_|n|n")
    assert by_name["X_|n|n"].value == pytest.approx(thrust.value, rel=1e-9)
    assert by_name["X_|n|n"].stderr < abs(thrust.value)
    (said,) = [n for n in fit.notes if "merged" in n]
    assert said.startswith(
        "X_1 is merged into X_|n|n: on these data |n|n = 100, and only the sum of both is known"
    )
    assert "|n|n" in equations(fitted)[0]
    assert not equations(fitted)[0].endswith("+ 0")


def test_what_the_logs_have_of_every_input_is_told_too():
    prepared, fitted = at_rates(0.0)
    fit = told(prepared, fitted)
    (propeller,) = (i.name for i in fit.inputs if i.kind == "propeller")
    assert (fit.typical_inputs[propeller], fit.largest_inputs[propeller]) == (RATE, RATE)


def test_what_is_told_predicts_what_the_fit_does():
    prepared, fitted = at_rates(0.0)
    split = shared_out(fitted, 0.6)
    structure, p = split.solution.structure, split.solution.p
    design = regressors(structure, p, prepared.identify[0])
    own = [k for k, s in enumerate(structure.slots) if not s.nuisance]
    merged = p.copy()
    merged[own] = rebuild(told(prepared, split)).p
    assert not np.allclose(merged, p)
    np.testing.assert_allclose(
        predicted(structure, merged, design), predicted(structure, p, design), atol=1e-12
    )


def test_a_sum_that_no_propeller_drives_is_the_constant():
    prepared, fitted = at_rates(0.0)
    backwards = shared_out(fitted, 1.0)
    constant = [s.name for s in backwards.solution.structure.slots].index("X_1")
    backwards.solution.p[constant] *= -1.0
    fit = told(prepared, backwards)
    by_name = {c.name: c for c in fit.coefficients}
    assert by_name["X_1"].value == backwards.solution.p[constant] < 0.0
    assert (by_name["X_|n|n"].value, by_name["X_|n|n"].reason) == (0.0, "merged into X_1")
    assert any("on these data |n|n = 100" in n for n in fit.notes)


def test_what_differs_a_little_is_not_merged():
    prepared, fitted = at_rates(0.05)
    assert same_columns(fitted) == ()
    assert not [n for n in told(prepared, fitted).notes if "merged" in n]
