"""Where the search of what swings by itself begins and ends."""

from types import SimpleNamespace as Named

import numpy as np
import pytest

from validate import refits, swinging
from validate.look_alikes import margin_for
from validate.refits import LONGER
from validate.search_ends import fallen, nearest, total
from validate.swinging import FEW, MORE, searched_swinging


def ended(total, held=False, p=0.0):
    return Named(total=total, held=np.array([held]), p=p, first=None)


def test_of_ends_that_are_as_good_one_at_no_bound_is_taken():
    free, bound, better = ended(10.3), ended(10.0, held=True), ended(9.0, held=True)
    assert nearest([bound, free]) is free
    assert nearest([bound, free, better]) is better
    assert total(ended(np.nan)) == np.inf
    assert nearest([ended(np.nan), free]) is free


#: By start: the cost where it begins, after a few steps, and in the end; and whether that is at a bound.
VALLEYS = {
    1.0: (5.0, 4.0, 3.9, False),  # begins nearest, in a shallow valley
    2.0: (50.0, 3.0, 1.0, False),
    3.0: (20.0, 2.0, 1.0, True),
    4.0: (30.0, 2.5, 2.4, False),
}


@pytest.mark.parametrize("starts", [(1.0, 2.0, 3.0, 4.0), (4.0, 3.0, 2.0, 1.0)])
def test_the_valley_that_a_few_steps_show_to_be_lowest_is_taken_wherever_it_begins(monkeypatch, starts):
    steps = []

    def search(p, first, budget):
        steps.append(budget)
        after, held = VALLEYS[p][1 if budget == FEW else 2], VALLEYS[p][3]
        return ended(after, held and budget == MORE, p)

    monkeypatch.setattr(
        swinging, "_begun", lambda _s, _p, p, _rough: Named(p=p, first=None, cost=VALLEYS[p][0])
    )
    assert searched_swinging(search, None, None, starts).p == 2.0
    assert steps.count(FEW) == len(starts) and steps.count(MORE) <= 4


@pytest.mark.parametrize("longer", [1, LONGER])
def test_what_began_roughly_goes_on_until_it_can_be_held_against_a_base_near_the_noise(monkeypatch, longer):
    """A roll in its own valley was dropped, for 28 steps from a rough fit had not come down to the base's cost yet."""
    cost_after = {FEW: 59_500.0, MORE: 57_000.0, LONGER * MORE: 55_500.0}
    monkeypatch.setattr(swinging, "_begun", lambda _s, _p, p, _rough: Named(p=p, first=None))
    found = searched_swinging(
        lambda p, _, budget: ended(cost_after[budget], p=p), None, None, [0.0], longer=longer
    )
    assert (found.total < 56_300.0) is (longer > 1)


@pytest.mark.parametrize("near", [True, False])
def test_only_near_the_noise_what_swings_is_searched_for_longer(monkeypatch, near):
    asked = []
    monkeypatch.setattr(refits, "swings", lambda _: True)
    monkeypatch.setattr(refits, "converges", lambda _: near)
    monkeypatch.setattr(refits, "wanted_swings", lambda *_: [])
    monkeypatch.setattr(refits, "searched_swinging", lambda *_, longer=1: asked.append(longer))
    refits._anew(None, None, Named(unmoved=0.0), Named(problem=Named(stretches=())))
    assert asked == [LONGER if near else 1]


def test_a_rival_may_lack_what_a_parameter_more_makes_of_chance_and_of_all_it_could_have_been():
    assert margin_for(0, 10_000) == 6.0
    assert margin_for(-2, 10_000) == 2.0  # a richer one must be likelier by what chance gives it
    assert margin_for(2, 10_000) == pytest.approx(6.0 + 2.0 * np.log(10_000))
    assert margin_for(1, 3) == 8.0


@pytest.mark.parametrize(
    ("costs", "steps"),
    [
        ((100.0, 90.0, 1.0), 2),  # hardly falls
        ((1000.0, 100.0, 1.0), 2),  # falls, and is far from the base's
        ((100.0, 30.0, 1.0), 2 + 8),
        ((np.nan, 30.0, 1.0), 2 + 8),  # what ran away at first
        ((100.0, np.nan, 1.0), 2),
    ],
)
def test_a_search_that_still_falls_fast_where_the_base_is_goes_on(costs, steps):
    taken, left = [], iter(costs)

    def search(p, first, budget):
        taken.append(budget)
        return ended(next(left))

    found = fallen(search, (0.0, None), 5.0)
    assert sum(taken) == steps
    assert found.total == costs[len(taken) - 1] or np.isnan(found.total)
