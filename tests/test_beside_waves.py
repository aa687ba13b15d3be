"""What waves hide: seen without an effect they were given what it explains, and beside it they are asked again."""

from __future__ import annotations

import math

from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from validate.candidates import candidates, screen
from validate.judgement import DOUBTFUL, judge
from validate.swell import with_waves_known


def test_an_offset_in_waves_is_told_from_a_constant_push():
    waves = Effect("waves", {"frequency": 1.5, "u": 0.1, "v": 0.3, "r": 0.1})
    offset = Effect("actuator_offset", {"offset": math.radians(3)}, "rudder")
    ship, trials = trials_of(
        "usv", ("zigzag", "random", "circle", "random"), 90.0, 5, (waves, offset), validate=0
    )
    ready = prepare(trials, ship.model)
    fitted = with_waves_known(fit_from_scratch(ready.structure, ready.identify))
    assert fitted.problem.swell is not None
    known = ("actuator_offset", "port_starboard_asymmetry")
    looked_at = [a for a in candidates(fitted.solution.structure) if a.effect.name in known]
    _, judged = judge(fitted, screen(fitted, looked_at), len(looked_at))
    assert judged[0].label == "actuator_offset (rudder)"
    assert judged[0].evidence > DOUBTFUL
