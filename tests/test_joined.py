"""Whole logs fitted free-running by joined windows: exact where the model is, and calm where the vessel is unstable."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identification_samples import modulus_truth, trials_of

from identify import prediction_fit
from identify.base_fit import fit_from_scratch
from identify.chain import chain_of, spreads
from identify.fitted import FAR
from identify.free_running import free_running_misfit
from identify.joined import JUMPS, join
from identify.parameter_covariance import covariance_of
from identify.prediction_fit import fit_declared
from identify.prepare import prepare
from identify.whole_logs import joined_from_simple, lean_structure, regression_start
from identify.whole_windows import over_whole_logs


@cache
def sample(model="modulus"):
    vessel, trials = trials_of("catamaran", ("zigzag", "random", "zigzag10"), 60.0, 5)
    return vessel, prepare(trials, model)


def test_a_free_run_over_whole_logs_finds_the_truth():
    vessel, prepared = sample()
    p, prior = regression_start(prepared.structure, prepared.identify)
    found = join(chain_of(prepared.structure, prepared.identify), p, prior)
    assert found is not None
    truth = modulus_truth(vessel)
    slots = prepared.structure.slots
    gain = next(k for k, s in enumerate(slots) if s.term is not None and s.term.text == "T:thruster")
    assert found.p[gain] == pytest.approx(truth["u", "T:thruster"], rel=0.05)
    assert found.cost < 0.05 * sum(s.steps for s in prepared.identify)


def test_a_fit_that_runs_away_over_its_own_logs_is_refused(monkeypatch):
    _, prepared = sample()
    good = fit_from_scratch(prepared.structure, prepared.identify)
    p = good.solution.p.copy()
    p[next(k for k, s in enumerate(prepared.structure.slots) if s.name == "N_r|r|")] = 3.0
    bad = replace(good, solution=replace(good.solution, p=p))
    assert bad.runs_away and not good.runs_away
    assert bad.chi2_per_dof < FAR
    fits = iter([bad, good, good])
    monkeypatch.setattr(prediction_fit, "fit_from_scratch", lambda *_, **__: next(fits))
    assert not prediction_fit.fit_for_prediction(prepared.structure, prepared.identify).runs_away


def test_firmer_joints_leave_smaller_jumps():
    _, prepared = sample()
    p, prior = regression_start(prepared.structure, prepared.identify)
    chain = chain_of(prepared.structure, prepared.identify)
    loose, firm = (join(chain, p, prior, jumps=j) for j in (JUMPS[:1], JUMPS))
    assert loose is not None and firm is not None
    assert firm.cost > loose.cost  # the same errors with less freedom
    assert len(firm.first) == len(chain.pieces)


def test_stretches_can_be_left_out():
    _, prepared = sample()
    chain = chain_of(prepared.structure, prepared.identify)
    rest = chain.without({0})
    assert {w.stretch for w in rest.pieces} == set(range(1, len(prepared.identify)))
    p, prior = regression_start(prepared.structure, prepared.identify)
    assert join(rest, p, prior, jumps=(1e-1,)) is not None


def test_a_quiet_log_does_not_count_for_more_than_it_can_tell():
    _, prepared = sample()
    own = np.array([s.states[:, 3:6].std(axis=0) for s in prepared.identify])
    assert (spreads(prepared.identify) >= own).all()


def test_where_a_model_lacks_much_the_joined_fit_predicts_better_than_windows():
    _, prepared = sample("linear")
    windows = fit_from_scratch(prepared.structure, prepared.identify)
    found = joined_from_simple(prepared.structure, prepared.identify)
    assert found is not None
    joined = type(windows)(
        windows.problem, windows.prior, type(windows.solution)(**{**vars(windows.solution), "p": found.p})
    )
    assert free_running_misfit(joined) < free_running_misfit(windows)


def test_vessels_without_rudder_have_no_lean_model():
    assert lean_structure(sample()[1].structure) is None


def test_whole_logs_tell_more_than_windows_where_the_model_is_exact():
    _, prepared = sample()
    windows = fit_declared(prepared)
    whole = over_whole_logs(windows)
    assert len(whole.problem.windows) == len(prepared.identify)
    assert whole.chi2_per_dof == pytest.approx(1.0, abs=0.1)
    sharper = np.sqrt(np.diag(covariance_of(whole)) / np.diag(covariance_of(windows)))
    assert np.median(sharper) < 0.95


def test_whole_logs_are_left_alone_where_the_model_lacks_something():
    fitted = fit_from_scratch(
        sample("linear")[1].structure, sample("linear")[1].identify, length=8.0, rounds=0
    )
    assert over_whole_logs(fitted) is fitted


def test_slow_errors_widen_the_intervals_but_not_beyond_what_all_streams_would_give():
    windows = fit_declared(sample()[1])
    slow = replace(windows.problem, dispersion=np.array([3.0, 1.0, 1.0, 1.0]))
    every = replace(windows.problem, dispersion=np.full(4, 3.0))
    plain, some, all_ = (
        np.diag(covariance_of(replace(windows, problem=q)))[:-1]
        for q in (replace(windows.problem, dispersion=np.ones(4)), slow, every)
    )
    assert (some >= plain * (1 - 1e-9)).all()
    assert some.max() / plain[some.argmax()] > 1.0
    assert (all_ >= some * (1 - 1e-9)).all()
    assert np.median(all_ / plain) == pytest.approx(9.0, rel=0.1)
