"""Far from the noise, what pushes by coefficients alone leads where the accelerations clearly want it."""

from __future__ import annotations

import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.fitted import FAR
from identify.prepare import prepare
from validate.candidates import candidates, screen
from validate.finalists import _pushing, finalists

PUSH = Effect("port_starboard_asymmetry", {"sway": 0.02, "yaw": -0.05})
LATE = Effect("actuator_delay", {"delay": 0.6}, "left")
TURNED = Effect("heading_bias", {"bias": 0.3})


@pytest.mark.parametrize(
    ("effects", "pushes"),
    [((PUSH,), "port_starboard_asymmetry"), ((PUSH, LATE), "port_starboard_asymmetry"), ((TURNED,), None)],
    ids=["push", "push-and-delay", "compass"],
)
def test_a_push_that_the_accelerations_want_leads_and_none_that_they_do_not(effects, pushes):
    ship, trials = trials_of("catamaran", ("random", "zigzag", "random"), 40.0, 5, effects, validate=0)
    ready = prepare(trials, ship.model)
    fitted = fit_from_scratch(ready.structure, ready.identify, length=10.0)
    assert fitted.chi2_per_dof > FAR
    screened = screen(fitted, candidates(ready.structure))
    found = _pushing(fitted, screened)
    assert (found and found.active.label) == pushes
    leads = {s.active.label for s in finalists(fitted, screened, thorough=True) if s.leads}
    assert ("port_starboard_asymmetry" in leads) == (pushes is not None)
    assert not any(
        s.active.effect.name in ("propeller_walk", "cross_terms") for s in screened if s.active.label in leads
    )
    if LATE in effects:
        assert "actuator_delay (left)" in leads, "what acts between a log and the motion is put out by none"
