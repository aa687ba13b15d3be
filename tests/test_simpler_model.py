"""``auto`` takes no rich model for what a single effect does to a simple one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace as Named

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.choose_model import Choice, Considered, considered
from seatrial import pipeline
from seatrial.pipeline import ChosenModel, chosen_model
from seatrial.progress import Stopwatch, silent
from validate.diagnosis import Verdict
from validate.simpler_model import _rivals, simpler_with_an_effect

MANOEUVRES = ("zigzag", "random")


def rich_choice(effects=(), rich="taylor3"):
    """The choice of a tanker's model as if the rich one had predicted best."""
    _, trials = trials_of("tanker", MANOEUVRES, 90.0, 5, effects, validate=0)
    choice = considered(trials)
    table = [replace(c, error=0.5 * choice.table[0].error) if c.name == rich else c for c in choice.table]
    return replace(choice, name=rich, table=tuple(sorted(table, key=lambda c: c.error)))


@cache
def biased_choice():
    """The same where the compass is off."""
    return rich_choice((Effect("heading_bias", {"bias": 0.05}),))


@cache
def found_simpler():
    """What is taken in its place."""
    return simpler_with_an_effect(biased_choice())


def test_a_simple_model_with_one_effect_is_taken_before_a_rich_one_that_makes_up_for_it():
    simpler = found_simpler()
    assert simpler is not None
    assert (simpler.name, simpler.effect) == ("blanke", "heading_bias")
    assert "'blanke' says as much as 'taylor3' with fewer coefficients" in simpler.in_words("taylor3")


def test_where_no_effect_is_there_the_choice_stands():
    assert simpler_with_an_effect(rich_choice()) is None


def test_only_simpler_models_that_predict_nearly_as_well_are_asked():
    table = [Considered("taylor3", 42, 0.1), Considered("modulus", 15, 0.2), Considered("abkowitz", 43, 0.2),
             Considered("blanke", 18, 0.21), Considered("linear", 12, 0.22),
             Considered("zhu2019", 12, np.inf)]  # fmt: skip
    chi2 = {"taylor3": 1.5, "modulus": 1.9, "abkowitz": 1.5, "blanke": 4.0, "linear": 5.0, "zhu2019": 2.0}
    fits = {name: Named(chi2_per_dof=x) for name, x in chi2.items()}
    assert _rivals(Choice("taylor3", tuple(table), fits)) == ["modulus", "blanke", "linear", "zhu2019"]
    fits["zhu2019"] = Named(chi2_per_dof=2.5)  # predicts nothing, and is not near either
    assert _rivals(Choice("taylor3", tuple(table), fits)) == ["modulus", "blanke", "linear"]
    assert _rivals(Choice("linear", tuple(table), fits)) == []
    assert _rivals(Choice("taylor3", tuple(table), {})) == []


@pytest.mark.parametrize("loop", [True, False])
def test_what_is_taken_in_place_of_the_choice_is_said(monkeypatch, loop):
    monkeypatch.setattr("identify.choose_model.considered", lambda _: biased_choice())
    monkeypatch.setattr("validate.simpler_model.simpler_with_an_effect", lambda _: found_simpler())
    _, trials = trials_of("tanker", ("zigzag",), 30.0, 5, validate=0)
    chosen = chosen_model(trials, "auto", loop=loop)
    assert chosen.name == ("blanke" if loop else "taylor3")
    assert len(chosen.said) == 1 + loop
    assert chosen.needs == ("heading_bias" if loop else "")
    assert (chosen.other().name if chosen.other else None) == ("taylor3" if loop else None)


def test_where_no_model_comes_near_one_that_does_with_an_effect_is_taken_and_whole_logs_are_not_asked(
    monkeypatch,
):
    monkeypatch.setattr(
        "identify.choose_model.by_whole_logs", lambda *_: pytest.fail("whole logs were asked")
    )
    bias = Effect("heading_bias", {"bias": 0.3})
    _, trials = trials_of("usv", (*MANOEUVRES, "circle"), 60.0, 5, (bias,), validate=0)
    choice = considered(trials)
    assert choice.far
    monkeypatch.setattr("identify.choose_model.considered", lambda _: choice)
    chosen = chosen_model(trials, "auto", loop=True)
    assert (chosen.name, chosen.needs) == ("modulus", "heading_bias")
    assert "No model alone comes near the noise" in chosen.said[0]


@pytest.mark.parametrize(
    ("found", "verdict", "stands"),
    [
        ("heading_bias", Verdict.EXPLAINED, True),
        ("heading_bias", Verdict.UNEXPLAINED, True),
        ("current", Verdict.EXPLAINED, True),
        ("current", Verdict.UNEXPLAINED, False),
        ("", Verdict.ADEQUATE, False),
    ],
)
def test_a_simpler_model_stands_with_the_effect_for_which_it_was_taken_or_with_what_explains_all(
    monkeypatch, found, verdict, stands
):
    other = ChosenModel("taylor3", ("a choice",))
    simpler = ChosenModel("blanke", ("a choice", "an effect"), "heading_bias", lambda: other)
    asked = []

    def analyse(trials, model, **_):
        asked.append(model)
        fit = Named(model=model, notes=())
        effects = (Named(fitted=Named(name=found)),) if found else ()
        return Named(
            before=fit, after=fit, validation_before=None, validation_after=None, predictions={},
            diagnosis=Named(effects=effects, verdict=verdict), actuators={}, equations=(), papers=(), carried={},
        )  # fmt: skip

    monkeypatch.setattr("validate.analysis.analyse", analyse)
    monkeypatch.setattr(pipeline, "chosen_model", lambda *_, **__: simpler)
    monkeypatch.setattr(pipeline, "read_logs", lambda *_: [])
    monkeypatch.setattr(pipeline, "_trials", lambda *_, **__: ())
    monkeypatch.setattr(pipeline, "replace", lambda fit, notes: Named(model=fit.model, notes=notes))
    campaign = Named(path="c", model="auto", estimator="auto", optimiser="auto", logs=[])
    results = pipeline._results(campaign, 1, 0, True, 0.1, Stopwatch(silent))
    assert asked == (["blanke"] if stands else ["blanke", "taylor3"])
    assert results.before.notes == (("a choice", "an effect") if stands else ("a choice",))
