"""An effect on some logs is looked for in those that it is in, whatever else is missing."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from validate.candidates import candidates, screen
from validate.judgement import judge
from validate.log_groups import logs_of
from validate.log_sets import MOST_COUNTED, InEach, in_likeliest_sets, ways

CURRENT = Effect("current", {"speed": 0.2, "direction": 0.6})
MANOEUVRES = ("zigzag", "random", "zigzag", "random", "zigzag")


def fitted_of(*effects, manoeuvres=MANOEUVRES):
    _, trials = trials_of("usv", manoeuvres, 50.0, 4, effects, validate=0)
    prepared = prepare(trials, "modulus")
    return fit_from_scratch(prepared.structure, prepared.identify, length=10.0)


@pytest.mark.parametrize(
    ("name", "value", "where"),
    [("shallow_water", {"factor": 1.3}, (0, 2, 3)), ("mass_change", {"ratio": 1.3}, (1, 2, 4))],
)
def test_the_logs_of_an_effect_are_seen_beside_a_current_that_is_missing_too(name, value, where):
    fitted = fitted_of(Effect(name, value, options={"logs": where}), CURRENT)
    actives = candidates(fitted.solution.structure)
    names = sorted({s.name for s in fitted.problem.stretches})
    sets = [a for a in in_likeliest_sets(fitted, actives) if a.effect.name == name]
    assert {names[k] for k in where} in [set(logs_of(a)) for a in sets]
    single = [a for a in actives if a.effect.name == name]
    most = screen(fitted, [*single, *sets])[0]
    assert set(logs_of(most.active)) == {names[k] for k in where}


def test_of_two_logs_every_choice_is_a_candidate_already():
    fitted = fitted_of(manoeuvres=MANOEUVRES[:2])
    actives = candidates(fitted.solution.structure)
    assert in_likeliest_sets(fitted, actives) == []
    assert ways(fitted, actives) == 0


def test_more_choices_are_more_tries():
    few, many = (fitted_of(manoeuvres=MANOEUVRES[:k]) for k in (3, 5))
    assert 0 < ways(few, candidates(few.solution.structure)) < ways(many, candidates(many.solution.structure))


def in_each(k, q, seed, either):
    """Normal equations of a linear problem with columns of its own in every log; in all of them the fit follows."""
    rng = np.random.default_rng(seed)
    columns, wanted = rng.normal(size=(40, k, q)), rng.normal(size=40)
    everywhere, _ = np.linalg.qr(columns.sum(axis=1))
    flat = columns.reshape(40, k * q)
    flat, wanted = (x - everywhere @ (everywhere.T @ x) for x in (flat, wanted))
    every = np.ones(q, dtype=bool)
    matrix = (flat.T @ flat).reshape(k, q, k, q)
    return InEach(
        matrix, (flat.T @ wanted).reshape(k, q), every, every if either else ~every | (np.arange(q) > 0)
    )


@settings(deadline=None, max_examples=40)
@given(st.integers(3, 6), st.integers(1, 3), st.integers(0, 2**32 - 1), st.booleans())
def test_no_choice_of_logs_beats_the_likeliest(k, q, seed, either):
    each = in_each(k, q, seed, either)
    choices = [np.array(c, dtype=bool) for c in product((False, True), repeat=k)]
    best, found = max(choices, key=each.gain), each.likeliest()
    assert each.gain(found) == pytest.approx(each.gain(best), rel=1e-6)
    if either:
        assert not found[0]


@settings(deadline=None, max_examples=10)
@given(st.integers(MOST_COUNTED + 1, 14), st.integers(0, 2**32 - 1))
def test_of_many_logs_no_other_one_makes_the_choice_better(k, seed):
    each = in_each(k, 1, seed, True)
    found = each.likeliest()
    others = [found ^ one for one in np.eye(k, dtype=bool)]
    assert max(map(each.gain, [*others, *np.eye(k, dtype=bool)])) <= each.gain(found) * (1.0 + 1e-6)


def test_choices_of_logs_count_against_what_is_in_some_logs_alone():
    fitted = fitted_of(CURRENT, manoeuvres=MANOEUVRES[:3])
    known = {a.label: a for a in candidates(fitted.solution.structure)}
    load = next(a for a in known.values() if a.effect.name == "mass_change")
    looked_at = screen(fitted, [known["current"], load])
    few, many = (
        {j.label: j.evidence for j in judge(fitted, looked_at, 50, None, choices)[1]} for choices in (0, 500)
    )
    assert many.pop("current") == few.pop("current")
    assert few.keys() == many.keys() != set()
    assert all(many[label] < few[label] - 3.0 for label in few)


def test_information_that_rounding_leaves_below_nothing_promises_nothing():
    """Of a parameter that says what others say as well, in large units: its scale overflowed."""
    each = in_each(3, 2, 5, True)
    matrix, score = each.matrix.copy(), each.score.copy()
    matrix[:, 1], matrix[:, :, :, 1], score[:, 1] = 0.0, 0.0, 1.0
    matrix[0, 1, 0, 1] = -1e9
    spoilt = InEach(matrix, score, each.up, each.down)
    alone = InEach(each.matrix[:, :1, :, :1], each.score[:, :1], each.up[:1], each.down[:1])
    for some in product((False, True), repeat=3):
        chosen = np.array(some)
        assert spoilt.gain(chosen) == pytest.approx(alone.gain(chosen))
    assert spoilt.likeliest().shape == (3,)
