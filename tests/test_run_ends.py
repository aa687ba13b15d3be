"""How a run ends that finds no effect: what its own logs are followed best by is what it gives."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from benchmarks.papers.azimuths import DELFIA, as_run
from benchmarks.papers.library import Sensed, identify, trial_of
from benchmarks.papers.p0 import Case, disturbed, record_of
from identify import fit_with as module
from identify.free_running import FOLLOWS, free_running_misfit
from preprocess.vessel import Vessel


@pytest.mark.parametrize(("far", "lost"), [(False, False), (True, False), (False, True)])
def test_whole_logs_are_fitted_where_windows_are_far_off_or_their_fit_is_lost_over_them(
    monkeypatch, far, lost
):
    for name, stub in {
        "fit_with": lambda *_: SimpleNamespace(is_far=far), "is_lost": lambda _: lost,
        "fit_far_from_noise": lambda *_: "followed", "over_whole_logs": lambda _: "gone on with",
    }.items():  # fmt: skip
        monkeypatch.setattr(module, name, stub)
    prepared = SimpleNamespace(structure=None, identify=())
    assert module.fit_as_a_run_ends(prepared) == ("followed" if far or lost else "gone on with")


@pytest.mark.slow
def test_a_rich_model_that_windows_let_run_off_follows_its_zigzag():
    """Forty-odd coefficients and one minute: windows are near the noise with values by which the ship spins."""
    run = as_run(DELFIA.zigzag(50.0, 60.0))
    truth = Case(run.t, run.states, run.delta, run, DELFIA.speed, DELFIA.length)
    case = disturbed(truth, 0.04, 0)
    sensed = Sensed(Vessel("ship", length=case.length, beam=0.2 * case.length), 0.01, 0.001, 0.001)
    trial = trial_of("zigzag", record_of(case, case.t, case.states, case.delta), sensed)
    assert free_running_misfit(identify([trial], "abkowitz").fitted) < 0.1 * FOLLOWS
