"""The models and their terms: every one parses, has units, and says what the contract says."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from identification_samples import MOTORS, PROPELLER, RUDDER, structure_of, trials_of

from identify.choice_words import choice_in_words
from identify.choose_model import (
    CONSIDERED,
    Considered,
    _begun,
    choose_model,
    missing_inputs,
    simplest,
)
from identify.forces import channel_names, shares, together
from identify.models import MODEL_BY_NAME, MODELS, terms_for
from identify.regression import factor_values
from identify.structure import structure_for
from identify.term import FACTORS, MOST_FACTORS, Term, factors_of, unit_of
from identify.unseen_parts import spans
from preprocess.vessel import Input, Vessel

BOAT = Vessel("boat", 1.2, 0.5)
#: The contract's table: surge, sway, yaw.
CONTRACT = {
    "zhu2019": ("u, |u|u, u³, |n|n", "v, r, |v|r, δ", "v, r, |v|r, δ"),
    "blanke": ("|u|u, vr, r², |n|n, δ², 1", "ur, uv, |v|v, |v|r, δ, 1", "ur, uv, |v|v, |v|r, δ, 1"),
    "abkowitz": (
        "Δu, ΔuU, Δu², Δu³/U, v², r², δ²U², δ²ΔuU, vr, vδU, rδU",
        "v, U², ΔuU, Δu², vU, rU, δU², v³/U, δ³U², v²r/U, v²δ, vδ²U, δΔuU, vΔu, rΔu, δΔu²",
        "r, U², ΔuU, Δu², vU, rU, δU², v³/U, δ³U², v²r/U, v²δ, vδ²U, δΔuU, vΔu, rΔu, δΔu²",
    ),
    "cybership2": (
        "u, |u|u, u³, vr, r², |n|n, |n|u",
        "ur, uv, v, |v|v, |r|v, r, |v|r, |r|r, |u|uδ, |u|u|δ|δ",
        "ur, uv, v, |v|v, |r|v, r, |v|r, |r|r, |u|uδ, |u|u|δ|δ",
    ),
    "modulus": ("u, u|u|, vr, r², T", "v, v|v|, r, ur, F_y", "r, r|r|, v, uv, N_F"),
    "linear": ("u, vr, r², T", "v, r, ur, F_y", "r, v, uv, N_F"),
}
EVERY_TERM = sorted({t for m in MODELS for t in (*m.surge, *m.sway, *m.yaw)} - {"T", "F_y", "N_F"})


@pytest.mark.parametrize("name", CONTRACT)
def test_a_model_has_exactly_the_terms_of_the_contract(name):
    model = MODEL_BY_NAME[name]
    for declared, said in zip((model.surge, model.sway, model.yaw), CONTRACT[name], strict=True):
        assert list(declared) == [t.strip() for t in said.split(",")]


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_every_term_parses_and_has_a_unit_and_every_model_a_source(model):
    assert re.search(r"\d{4}", model.source)
    terms, notes = terms_for(model, BOAT, (RUDDER, PROPELLER))
    assert terms
    assert not notes
    for term in terms:
        assert 1 <= len(factors_of(term.text)) <= MOST_FACTORS
        assert set(factors_of(term.text)) <= {*FACTORS, *channel_names((RUDDER, PROPELLER))}
        assert unit_of(term.text, term.dof)
    assert len({(t.dof, t.text) for t in terms}) == len(terms)
    assert len({t.name for t in terms}) == len(terms)


def test_the_discrete_model_is_its_neighbour_at_a_fixed_step():
    discrete, continuous = MODEL_BY_NAME["zhao2021"], MODEL_BY_NAME["cybership2"]
    assert (discrete.surge, discrete.sway, discrete.yaw) == (
        continuous.surge,
        continuous.sway,
        continuous.yaw,
    )
    assert discrete.discrete
    assert not continuous.discrete


def test_published_counts_of_terms():
    assert [len(x) for x in (_of("abkowitz").surge, _of("abkowitz").sway, _of("abkowitz").yaw)] == [
        11,
        16,
        16,
    ]
    assert sum(len(x) for x in (_of("cybership2").surge, _of("cybership2").sway, _of("cybership2").yaw)) == 27
    assert sum(len(x) for x in (_of("zhu2019").surge, _of("zhu2019").sway, _of("zhu2019").yaw)) == 12


def _of(name):
    return MODEL_BY_NAME[name]


@pytest.mark.parametrize(
    ("term", "dof", "unit"),
    [
        ("u", "u", "1/s"), ("|u|u", "u", "1/m"), ("u³", "u", "s/m²"), ("vr", "u", "1"), ("r²", "u", "m"),
        ("|n|n", "u", "m"), ("1", "u", "m/s²"), ("δ²", "u", "m/s²"), ("uv", "v", "1/m"), ("ur", "v", "1"),
        ("δU²", "v", "1/m"), ("v³/U", "v", "1/m"), ("uv", "r", "1/m²"), ("r", "r", "1/s"), ("|r|r", "r", "1"),
        ("δ", "r", "1/s²"), ("T:thruster", "u", "m/s²"), ("T:propeller", "u", "m"), ("N:thruster", "r", "1/(m·s²)"),
        ("Vwx", "u", "1/m"),
    ],
)  # fmt: skip
def test_units_of_coefficients(term, dof, unit):
    assert unit_of(term, dof) == unit


@pytest.mark.parametrize("bad", ["q", "u+v", "|w|w", "T:", "u⁵"])
def test_what_is_no_term_is_refused(bad):
    with pytest.raises(ValueError, match="nothing known begins"):
        factors_of(bad)


def test_a_term_with_too_many_factors_is_refused():
    with pytest.raises(ValueError, match="at most"):
        factors_of("u³v³r")


@given(st.floats(-3, 3), st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.6, 0.6), st.floats(-10, 10))
def test_a_regressor_is_the_product_that_a_person_reads(u, v, r, delta, n):
    state = np.array([[0.0, 0.0, 0.0, u, v, r]])
    values = {k: x[0] for k, x in factor_values(state, np.zeros((1, 2)), np.zeros(2), 0.7).items()}
    values |= {"δ": delta, "|δ|": abs(delta), "|n|n": abs(n) * n, "|n|": abs(n)}
    speed = np.hypot(u, v)
    expected = {
        "|v|r": abs(v) * r, "u³": u**3, "Δu³/U": (u - 0.7) ** 3 / max(speed, 1e-3),
        "δ²ΔuU": delta**2 * (u - 0.7) * speed,
        "|u|u|δ|δ": abs(u) * u * abs(delta) * delta, "|n|u": abs(n) * u, "v²r/U": v**2 * r / max(speed, 1e-3),
    }  # fmt: skip
    for text, value in expected.items():
        product = np.prod([values[f] for f in factors_of(text)])
        assert product == pytest.approx(value, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("axis", ["surge", "sway", "yaw"])
def test_at_one_speed_the_perturbation_is_all_that_abkowitz_tells(axis):
    rng = np.random.default_rng(3)
    states = np.zeros((400, 6))
    states[:, 3:] = rng.uniform([0.5, -0.5, -0.3], [1.5, 0.5, 0.3], (400, 3))
    values = factor_values(states, np.zeros((400, 2)), np.zeros(2), 1.1) | {"δ": rng.uniform(-0.6, 0.6, 400)}
    values |= {"U": np.full(400, 1.1), "/U": np.full(400, 1 / 1.1)}
    whole, about = (
        np.column_stack([np.prod([values[f] for f in factors_of(t)], axis=0) for t in getattr(_of(m), axis)])
        for m in ("abkowitz", "abkowitz_perturbation")
    )
    rank = about.shape[1]
    assert np.linalg.matrix_rank(about) == np.linalg.matrix_rank(whole) == rank
    assert np.linalg.matrix_rank(np.hstack([whole, about])) == rank
    assert whole.shape[1] == rank + 1


def test_the_perturbation_says_what_it_cannot_tell():
    _, notes = structure_for(
        "abkowitz_perturbation", BOAT, (RUDDER, PROPELLER), logs=("a",), streams=("position",)
    )
    assert any("the sum alone" in n for n in notes)


def test_a_term_without_its_input_is_left_out_and_said():
    terms, notes = terms_for(MODEL_BY_NAME["blanke"], BOAT, (PROPELLER,))
    assert not any("δ" in t.text for t in terms)
    assert any("δ" in n and "left out" in n for n in notes)


def driven(names, inputs, series):
    """What every channel is when the inputs are as in ``series``."""
    out = np.zeros(len(names))
    for unit in together(inputs):
        places, rows = shares(names, inputs, unit, series)
        out[list(places)] += rows[:, 0]
    return out


def test_geometry_gives_thrust_its_sign_and_arm():
    names = channel_names(MOTORS)
    series = {
        "left": np.array([0.5]), "right": np.array([-0.2]), "thrust left": np.array([0.25]),
        "thrust right": np.array([-0.04]),
    }  # fmt: skip
    row = dict(zip(names, driven(names, MOTORS, series), strict=True))
    assert row["T:thruster"] == pytest.approx(0.25 - 0.04)
    assert row["N:thruster"] == pytest.approx(0.3 * 0.25 + 0.3 * 0.04)
    assert row["|n|n"] == pytest.approx(0.21)


def test_an_azimuth_turns_the_thrust_of_its_propeller():
    inputs = (
        Input("n", "propeller", position=(-0.4, 0.1)),
        Input("a", "azimuth", position=(-0.4, 0.1), drives="n"),
    )
    names = channel_names(inputs)
    series = {"n": np.array([3.0]), "a": np.array([np.pi / 2]), "thrust n": np.array([9.0])}
    row = dict(zip(names, driven(names, inputs, series), strict=True))
    assert row["T:propeller"] == pytest.approx(0.0, abs=1e-12)
    assert row["F:propeller"] == pytest.approx(9.0)
    assert row["N:propeller"] == pytest.approx(-0.4 * 9.0)


def test_gains_whose_sign_geometry_gives_cannot_turn():
    slots = structure_of("modulus", MOTORS).slots
    bounded = {s.term.text for s in slots if s.term and s.parameter.bounds[0] == 0.0}
    assert bounded == {"T:thruster", "N:thruster"}


def test_names_are_letters_and_digits():
    assert Term("u", "Δu³/U").name == "X_du3_U"
    assert Term("v", "|v|r").name == "Y_|v|r"
    assert Term("r", "δ²").name == "N_delta2"


def test_auto_takes_the_simplest_of_those_as_good_as_the_best():
    ranked = [
        Considered("cybership2", 27, 0.100),
        Considered("blanke", 18, 0.1015),
        Considered("zhu2019", 12, 0.2),
    ]
    assert simplest(ranked) == "blanke"


def test_auto_considers_only_models_whose_inputs_exist():
    both = (RUDDER, PROPELLER)
    assert not [m for m in CONSIDERED if missing_inputs(m, BOAT, both)]
    assert [m for m in CONSIDERED if not missing_inputs(m, BOAT, MOTORS)] == ["linear", "modulus"]
    middle = (Input("n", "propeller"),)
    assert all(missing_inputs(m, BOAT, middle) for m in CONSIDERED)


@pytest.mark.parametrize(("metres", "seconds"), [(1.0, 10.0), (7.0, 10.0), (112.0, 40.0)])
def test_auto_fits_and_predicts_over_longer_windows_where_a_ship_answers_slowly(metres, seconds):
    _, made = trials_of("usv", ("zigzag", "random"), 240.0, 5, validate=0)
    ships = [replace(t, vessel=replace(t.vessel, length=metres)) for t in made]
    fitted = _begun(ships, "linear").finished
    assert fitted.problem.length == seconds
    longest = max(s.h * n for s, _, n in spans(fitted.problem, [0, 1, 2, 3, 4, 5], metres))
    assert longest == pytest.approx(3.0 * seconds, rel=0.25)


@pytest.mark.parametrize("seconds", [9.0, 25.0])
def test_auto_on_a_single_short_zigzag_chooses_and_says_how(seconds):
    _, made = trials_of("usv", ("zigzag",), seconds, 5)
    (trial,) = (replace(t, role="identify") for t in made)
    name, table = choose_model([trial])
    taken = next(c for c in table if c.name == name)
    assert len(taken.parts) >= 2
    assert taken.error <= 1.02 * table[0].error
    said = choice_in_words(name, table, 1)
    assert f"'{name}' was chosen: left out in turn, parts of the log" in said
    assert "What only another manoeuvre would show could not be asked" in said


def test_what_auto_says_of_a_poor_choice_and_of_whole_logs():
    table = (Considered("taylor_modulus", 60, 1.2), Considered("blanke", 18, 1.21), Considered("linear", 12, 40.0),
             Considered("zhu2019", 0, np.inf, (), "no rudder"))  # fmt: skip
    said = choice_in_words("blanke", table, 6)
    assert "left out in turn, whole logs are predicted with an error of 1.2" in said
    assert "(the others: taylor_modulus 1.2, linear > 10)" in said
    assert "'taylor_modulus' is no more than 2 % better and has more coefficients" in said
    assert "the choice means little" in said
    assert "zhu2019" not in said
