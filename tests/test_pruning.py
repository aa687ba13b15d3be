"""What was taken early and says nothing more once the others are in is dropped."""

from __future__ import annotations

from identification_samples import trials_of

from fixtures.effects import Effect
from identify.base_fit import fit_from_scratch
from identify.prepare import prepare
from identify.structure import null_parameters
from validate.candidates import candidates
from validate.judgement import parameters_of
from validate.pace import Pace
from validate.pruning import pruned


def test_a_clock_of_the_inputs_that_stood_for_a_late_rudder_is_dropped_beside_it():
    """The inputs' own lead comes free as it goes, so that the fit without it has as many parameters."""
    late = Effect("actuator_delay", {"delay": 0.6}, "rudder")
    ship, trials = trials_of("usv", ("random", "zigzag", "random"), 60.0, 5, (late,), validate=0)
    ready = prepare(trials, ship.model)
    by_label = {a.label: a for a in candidates(ready.structure)}
    structure = ready.structure.with_effect(by_label["clock_offset (inputs)"])
    structure = structure.with_effect(by_label["actuator_delay (rudder)"])
    assert len(structure.slots) == len(structure.without(0).slots)
    assert parameters_of(structure, 0) == parameters_of(structure, 1) == 1
    p = null_parameters(structure)
    p[[k for k, s in enumerate(structure.slots) if s.name == "delay"]] = 0.6
    fitted = fit_from_scratch(structure, ready.identify, p)
    left = pruned(fitted, Pace()).solution
    assert [a.label for a in left.structure.actives] == ["actuator_delay (rudder)"]
