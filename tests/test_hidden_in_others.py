"""Orders that other logs enter now at once and now an entry later."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identification_samples import trials_of

from fixtures.effects import Effect
from fixtures.sensors import Suite
from identify.acting import lead_slot
from identify.base_fit import fit_from_scratch
from identify.fitted import NEAR, AtNoise
from identify.prepare import prepare
from validate.hidden_in_others import as_they_hide
from validate.other_logs import with_other_logs
from validate.structure_left import structured_share
from validate.verdict import _left_unseen

LOGS = ("zigzag", "random", "zigzag10", "zigzag", "random")
SUITE = Suite(input_rate=10.0, helm_rate=10.0)


def prepared_with(*effects):
    _, trials = trials_of("usv", LOGS, 60.0, 5, effects, suite=SUITE, validate=2)
    return prepare(trials, "modulus")


@pytest.fixture(scope="module")
def fitted():
    ready = prepared_with()
    return fit_from_scratch(ready.structure, ready.identify)


def entered_when_it_happens(stretch, lead):
    """The stretch with every change of its inputs entered at any time before the next entry after it is made."""
    rng, moved = np.random.default_rng(5), {}
    for name, m in stretch.inputs.items():
        changed = 1 + np.flatnonzero(np.diff(m.value) != 0.0)
        t = m.t.copy()
        t[changed] += rng.uniform(0.0, 0.95, len(changed)) * m.sample_time - lead
        assert (np.diff(t) > 0.0).all()
        moved[name] = replace(m, t=t)
    return replace(stretch, inputs=moved)


def test_what_other_logs_alone_hide_between_samples_is_nothing_that_is_missing(fitted):
    lead = fitted.solution.p[lead_slot(fitted.solution.structure)]
    moved = [entered_when_it_happens(s, lead) for s in prepared_with().validate]
    other = with_other_logs(fitted, moved)
    assert other.chi2_per_dof > NEAR
    assert max(structured_share(other, fitted.problem.stretches).values()) > 0.03
    ready = SimpleNamespace(identify=fitted.problem.stretches, validate=moved)
    assert max(_left_unseen(ready, fitted).values()) < 0.01


def test_what_other_logs_show_of_a_load_or_of_noise_is_no_matter_of_their_inputs(fitted):
    """A load that is in them alone is as it was, and so are logs at the noise."""
    loaded = prepared_with(Effect("mass_change", {"ratio": 1.6}, options={"logs": (3, 4)})).validate
    other = with_other_logs(fitted, loaded)
    assert as_they_hide(other, AtNoise()) is other
    plain = with_other_logs(fitted, prepared_with().validate)
    assert as_they_hide(plain, AtNoise()) is plain
