"""Every optimiser through the same checks, then each against what it promises."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from identify.optimisers import OPTIMISERS, StopReason, generation, minimise, resume
from identify.optimisers.bee_colony import ABC

CENTRE = 0.3


def sphere(x):
    return np.sum((x - CENTRE) ** 2, axis=1)


def rosenbrock(x):
    return np.sum(100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2, axis=1)


def rastrigin(x):
    z = x - CENTRE
    return np.sum(10 + z**2 - 10 * np.cos(2 * np.pi * z), axis=1)


def ackley(x):
    z = x - CENTRE
    mean_cosine = np.mean(np.cos(2 * np.pi * z), axis=1)
    return 20 + np.e - 20 * np.exp(-0.2 * np.sqrt(np.mean(z**2, axis=1))) - np.exp(mean_cosine)


BOX = [[-5.0, 5.0]] * 3
every = pytest.mark.parametrize("name", OPTIMISERS)


def median(name, objective, bounds, budget, seeds=3, **options):
    runs = [minimise(OPTIMISERS[name], objective, bounds, budget, s, **options) for s in range(seeds)]
    return float(np.median([run.value for run in runs]))


@every
@pytest.mark.parametrize(
    ("objective", "most"),
    [(sphere, 1e-4), (rosenbrock, 1.0), (ackley, 0.05)],
    ids=["sphere", "rosenbrock", "ackley"],
)
def test_finds_the_minimum_of_standard_functions(name, objective, most):
    """A random search of the same budget ends above 1e-1, 3 and 1.5."""
    assert median(name, objective, BOX, 3000) < most


@pytest.mark.parametrize("name", ["abc", "aco_r", "pso", "ldwpso", "cmaes", "de"])
def test_global_methods_beat_local_minima(name):
    options = {"restarts": 5} if name == "cmaes" else {}
    assert median(name, rastrigin, [[-5.0, 5.0]] * 2, 4000, **options) < 0.5


@pytest.mark.parametrize(("name", "most"), [("cmaes", 1e-8), ("multistart", 1e-8), ("de", 1.0), ("abc", 1.0)])
def test_follows_a_curved_valley_in_ten_variables(name, most):
    assert median(name, rosenbrock, [[-5.0, 5.0]] * 10, 20_000, seeds=1 if name == "cmaes" else 3) < most


@every
def test_same_seed_same_search_other_seed_other_search(name):
    runs = [minimise(OPTIMISERS[name], rosenbrock, [[-5.0, 5.1]] * 4, 300, s) for s in (7, 7, 8)]
    assert np.array_equal(runs[0].history, runs[1].history)
    assert np.array_equal(runs[0].x, runs[1].x)
    assert not np.array_equal(runs[0].x, runs[2].x)


@every
@pytest.mark.parametrize("generations", [1, 2, 5])
def test_resumes_from_a_saved_state_as_if_never_stopped(name, generations):
    optimiser, budget = OPTIMISERS[name], 400
    whole = minimise(optimiser, ackley, BOX, budget, 3)
    state = optimiser.start(BOX, 3, budget=budget)
    for _ in range(generations):
        state = generation(optimiser, ackley, state, budget - state.evaluations)
    saved = pickle.dumps(state)
    rest = resume(optimiser, ackley, pickle.loads(saved), budget)
    assert rest.value == whole.value
    assert np.array_equal(rest.x, whole.x)
    assert np.array_equal(rest.history, whole.history[generations:])
    assert pickle.dumps(state) == saved  # going on left the state as it was


@every
def test_state_may_be_saved_between_ask_and_tell(name):
    optimiser = OPTIMISERS[name]
    state, first = optimiser.ask(optimiser.start(BOX, 3, budget=200))
    copy = pickle.loads(pickle.dumps(state))
    one, two = (optimiser.tell(s, first, sphere(first)) for s in (state, copy))
    assert np.array_equal(optimiser.ask(one)[1], optimiser.ask(two)[1])


@every
def test_state_is_frozen(name):
    state = OPTIMISERS[name].start(BOX, 0)
    with pytest.raises(FrozenInstanceError):
        setattr(state, fields(state)[0].name, None)


@every
def test_asking_twice_from_one_state_gives_the_same(name):
    optimiser = OPTIMISERS[name]
    state = generation(optimiser, sphere, optimiser.start(BOX, 1), 1000)
    assert np.array_equal(optimiser.ask(state)[1], optimiser.ask(state)[1])


@every
@given(
    low=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=4),
    width=st.floats(0, 1e6),
    seed=st.integers(0, 2**32),
)
@example(low=[0.0], width=1.7167119746515256e-156, seed=0)  # the square of a slope is nothing
@settings(max_examples=8, deadline=None)
def test_candidates_stay_inside_the_bounds(name, low, width, seed):
    bounds = np.array([[x, x + width] for x in low])

    def inside(x):
        assert np.all(x >= bounds[:, 0])
        assert np.all(x <= bounds[:, 1])
        return -np.sum(x, axis=1)  # the minimum is on the bounds

    minimise(OPTIMISERS[name], inside, bounds, 150, seed)


@every
def test_minimum_on_a_corner_is_reached(name):
    found = minimise(OPTIMISERS[name], lambda x: np.sum(x, axis=1), [[1.0, 2.0]] * 2, 1500, 0)
    assert np.allclose(found.x, 1.0, atol=2e-3)


@every
def test_values_that_are_not_finite_are_avoided(name):
    def broken(x):
        values = sphere(x)
        values[x[:, 0] < 0] = np.nan
        values[x[:, 1] < -3] = np.inf
        values[x[:, 2] > 4] = -np.inf
        return values

    found = minimise(OPTIMISERS[name], broken, BOX, 2000, 1)
    assert np.isfinite(found.value)
    assert found.value < 0.05


@every
def test_nothing_finite_is_said(name):
    found = minimise(OPTIMISERS[name], lambda x: np.full(len(x), np.nan), BOX, 120, 0)
    assert found.stopped is StopReason.NOTHING_FINITE
    assert found.evaluations <= 120


@every
@pytest.mark.parametrize("budget", [1, 7, 143])
def test_budget_is_never_exceeded(name, budget):
    calls = []
    found = minimise(OPTIMISERS[name], lambda x: calls.append(len(x)) or rosenbrock(x), BOX, budget, 0)
    assert sum(calls) == found.evaluations <= budget
    assert found.stopped is StopReason.BUDGET


@every
def test_history_never_gets_worse_and_ends_at_the_best(name):
    best = []
    found = minimise(OPTIMISERS[name], lambda x: best.extend(ackley(x)) or ackley(x), BOX, 600, 2)
    assert np.all(np.diff(found.history[:, 1]) <= 0)
    assert found.history[-1, 1] == found.value == min(best)
    assert ackley(found.x[None, :])[0] == found.value


@every
def test_the_unit_of_the_objective_does_not_matter(name):
    """What the printed exp(f) and 1 / (1 + f) fail."""
    plain = minimise(OPTIMISERS[name], ackley, BOX, 500, 4)
    scaled = minimise(OPTIMISERS[name], lambda x: 2.0**-30 * ackley(x), BOX, 500, 4)
    assert np.allclose(plain.x, scaled.x, atol=1e-9)


def test_target_and_patience_stop_the_search():
    found = minimise(OPTIMISERS["pso"], sphere, BOX, 10_000, 0, target=1e-3)
    assert (found.stopped, found.value <= 1e-3) == (StopReason.TARGET, True)
    found = minimise(OPTIMISERS["pso"], lambda x: np.zeros(len(x)), BOX, 10_000, 0, patience=5)
    assert found.stopped is StopReason.STALLED


def test_printed_fitness_of_the_bee_colony_hardly_selects():
    """Zhu et al. 2019, eq. 15: with objectives near zero all sources get the same share; ranks do not."""
    from identify.optimisers.bee_colony import _probabilities

    for selection, ratio in (("fitness", 1.01), ("rank", 20.0)):
        state = ABC.start(BOX, 0, selection=selection)
        state = generation(ABC, lambda x: 1e-4 * sphere(x), state, 1000)
        shares = _probabilities(state)
        assert (shares.max() / shares.min() < 1.02) == (selection == "fitness")
        assert shares.max() / shares.min() < ratio * 1.01


@pytest.mark.parametrize("bounds", [[[1.0, 0.0]], [[0.0, np.inf]], [0.0, 1.0], np.zeros((0, 2))])
def test_bad_bounds_are_refused(bounds):
    with pytest.raises(ValueError, match="bounds"):
        minimise(OPTIMISERS["de"], sphere, bounds, 10)


def test_objective_of_the_wrong_shape_is_refused():
    with pytest.raises(ValueError, match="one value for each"):
        minimise(OPTIMISERS["de"], lambda x: x, BOX, 100)
