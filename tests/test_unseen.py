"""Logs that nothing was fitted to have a say in what was found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from identification_samples import trials_of

from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from validate.unseen import speak_against


def test_unseen_logs_speak_against_a_fit_that_runs_away_on_them_and_not_against_the_same_fit():
    ship, trials = trials_of("usv", ("zigzag", "random"), 60.0, 5)
    unseen = [replace(t, role="validate") for t in trials[1:]]
    prepared = prepare([trials[0], *unseen], ship.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify, rounds=0)
    assert not speak_against(prepared, fitted, fitted)
    bent = np.where([s.coefficient >= 0 for s in prepared.structure.slots], 0.3, 1.0) * fitted.solution.p
    astray = replace(fitted, solution=replace(fitted.solution, p=bent))
    assert speak_against(prepared, fitted, astray)
    assert not speak_against(prepared, astray, fitted)
