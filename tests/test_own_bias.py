"""The bias of an estimator that has one is a term of the model: fitted, predicted with, reported, and read back."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import structure_of, trials_of

from identify.by_tuning import rows_of
from identify.effect import Active
from identify.effects import EFFECTS
from identify.estimators import ESTIMATORS
from identify.fit_with import fit_with
from identify.own_bias import with_own_bias
from identify.prepare import prepare
from identify.report_fit import equations, make_fit
from identify.richer_model import richer_model
from identify.simulate.rebuild import rebuild
from identify.structure import null_parameters
from seatrial.comparison import Method, Task, score_method
from validate.analysis import analyse

BIASED = ("lssvm", "eso_lssvm", "wls_svr", "rw_lssvr")


@cache
def trials():
    return trials_of("tanker", ("zigzag", "circle"), 60.0, 3)[1]


@cache
def prepared_as(model):
    return prepare(trials(), model)


def constants(structure):
    return [t.dof for t in structure.terms if t.text == "1"]


def test_estimators_that_fit_a_bias_unasked_are_those_that_say_so():
    rng = np.random.default_rng(0)
    design = rng.standard_normal((60, 2))
    fits = {n: e.fit(design, design @ [1.0, 2.0] + 0.5) for n, e in ESTIMATORS.items()}
    assert {n for n, found in fits.items() if found.bias} == {n for n, e in ESTIMATORS.items() if e.bias}
    assert {n for n, e in ESTIMATORS.items() if e.bias} == set(BIASED)


@pytest.mark.parametrize("estimator", BIASED)
def test_the_bias_is_a_coefficient_of_every_equation(estimator):
    prepared = prepared_as("zhu2019")
    fitted = fit_with(prepared, estimator)
    structure, p = fitted.solution.structure, fitted.solution.p
    rows = rows_of(prepared.structure, null_parameters(prepared.structure), prepared.identify)
    for k, dof in enumerate("uvr"):
        own = [j for j, t in enumerate(prepared.structure.terms) if t.dof == dof]
        found = ESTIMATORS[estimator].fit(rows.design[:, own], rows.target[:, k], groups=rows.groups)
        values = {
            s.term.text: x for s, x in zip(structure.slots, p, strict=True) if s.term and s.term.dof == dof
        }
        assert values["1"] == pytest.approx(found.bias, rel=1e-6)
        assert len(values) == len(own) + 1
    assert constants(prepared.structure) == []


@pytest.mark.parametrize("model", ["zhu2019", "blanke"])
def test_what_a_model_has_of_it_already_is_not_there_twice(model):
    biased = with_own_bias(prepared_as(model), "lssvm")
    assert sorted(constants(biased.structure)) == ["r", "u", "v"]
    assert with_own_bias(biased, "lssvm") is biased
    said = any("the term 1 was added to the model in surge, sway and yaw" in n for n in biased.notes)
    assert said == (model == "zhu2019")


def test_the_term_is_added_where_the_model_has_an_equation():
    assert constants(with_own_bias(prepared_as("nomoto1"), "rw_lssvr").structure) == ["r"]
    assert with_own_bias(prepared_as("nomoto1"), "rw_lssvr").notes[-1].endswith("to the model in yaw.")


@pytest.mark.parametrize("estimator", ["ls", "ridge", "recursive_ls", "weak_form", "output_error", "auto"])
def test_an_estimator_without_one_leaves_the_model_as_it_is(estimator):
    assert with_own_bias(prepared_as("zhu2019"), estimator) is prepared_as("zhu2019")


def test_it_is_reported_with_its_error_and_read_back_as_it_was():
    fitted = fit_with(prepared := prepared_as("zhu2019"), "lssvm")
    fit = make_fit(prepared, fitted, estimator="lssvm", optimiser="auto", seed=0)
    ones = {c.name: c for c in fit.coefficients if c.term == "1"}
    assert {n: c.unit for n, c in ones.items()} == {"X_1": "m/s²", "Y_1": "m/s²", "N_1": "1/s²"}
    assert all(0.0 < c.stderr < math.inf for c in ones.values())
    assert len(fit.covariance) == len(fit.coefficients)
    assert f"{abs(ones['X_1'].value):.4g}" in equations(fitted)[0]
    back = rebuild(fit)
    assert back.structure.terms == fitted.solution.structure.terms
    assert back.p == pytest.approx([c.value for c in fit.coefficients])


@pytest.fixture(scope="module")
def analysed():
    return {e: analyse(trials(), model="zhu2019", estimator=e, loop=False) for e in ("ls", "lssvm")}


def test_a_run_predicts_with_it(analysed):
    """Thrown away, it left a vessel that is driven by nothing: the speed of every free run was wrong."""
    names = [c.name for c in analysed["lssvm"].before.coefficients]
    assert {"X_1", "Y_1", "N_1"} <= set(names)
    assert any("has a bias: the term 1" in n for n in analysed["lssvm"].before.notes)
    plain, biased = (analysed[e].validation_before.channels["u"].rmse for e in ("ls", "lssvm"))
    assert biased < 2.0 * plain


def test_a_comparison_predicts_with_it_too(analysed):
    row = score_method(Task(trials(), Method("zhu2019", "lssvm"), 0))
    assert row["parameters"] == len(analysed["lssvm"].before.coefficients)
    assert row["r2_u"] == pytest.approx(analysed["lssvm"].validation_before.channels["u"].r2, rel=1e-6)


def test_about_which_speed_a_model_is_cannot_be_told_beside_a_constant():
    structure = structure_of("abkowitz", u0_found=True)
    assert structure.u0_is_free
    biased = with_own_bias(replace(prepared_as("zhu2019"), structure=structure), "lssvm").structure
    assert constants(biased) == ["u", "v", "r"]
    assert not biased.u0_is_free


def test_a_model_that_grows_keeps_it():
    prepared = prepare(trials_of("catamaran", ("zigzag",), 20.0, 3, validate=0)[1], "linear")
    damping = next(e for e in EFFECTS if e.name == "quadratic_damping")
    structure = with_own_bias(prepared, "lssvm").structure.with_effect(Active(damping))
    assert richer_model(structure) == "modulus"
