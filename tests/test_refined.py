"""A fit that goes on to longer windows begins them where its own parameters leave them nearest to the measurements."""

from dataclasses import replace

import numpy as np
from identification_samples import trials_of

from fixtures.sensors import Sensor, Suite
from identify.base_fit import fit_from_scratch
from identify.first_states import first_states
from identify.noise import calibrated
from identify.prepare import prepare
from identify.windows import moments
from validate import refined as module
from validate.refined import refined


def test_longer_windows_begin_at_their_best(monkeypatch):
    """The smoothed motion alone is a poor begin of a long window: from far off a search may end in another valley."""
    _, trials = trials_of("usv", ("zigzag", "random"), 60.0, 4, validate=0)
    prepared = prepare(trials, "modulus")
    short = fit_from_scratch(prepared.structure, prepared.identify, length=10.0)
    costs, known = [], module.solve

    def seen(problem, structure, p, first, *rest, **options):
        costs.append([moments(problem, structure, p, x).cost for x in (first, first_states(problem))])
        return known(problem, structure, p, first, *rest, **options)

    monkeypatch.setattr(module, "solve", seen)
    longer = refined(short, 30.0)
    settled, smoothed = costs[0]
    assert settled < 0.9 * smoothed
    assert longer.problem.length == 30.0
    assert longer.chi2_per_dof < 1.1
    assert np.abs(longer.solution.p - short.solution.p).max() < 0.2


def test_longer_windows_show_what_inputs_hide_though_short_ones_did_not():
    """The fit over short windows is told that nothing is hidden; over long ones its errors say how much there is."""
    suite = replace(Suite(input_rate=4.0, helm_rate=10.0), heading=Sensor(10.0, 0.001))
    _, trials = trials_of("usv", ("zigzag", "random"), 60.0, 4, validate=0, suite=suite)
    prepared = prepare(trials, "modulus")
    short = fit_from_scratch(prepared.structure, prepared.identify, length=10.0)
    problem = calibrated(replace(short.problem, unlogged=None), short.solution)
    longer = refined(replace(short, problem=problem), 30.0)
    assert longer.problem.unlogged is not None
    assert longer.chi2_per_dof < 1.2
