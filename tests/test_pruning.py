"""What was taken early and says nothing more once the others are in is dropped."""

from __future__ import annotations

from dataclasses import replace

import pytest
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


def with_loads(truth, *begins):
    """What is left of changes of the load that a fit began with, (ratio, logs) each; and the names of its logs."""
    true = tuple(Effect("mass_change", {"ratio": ratio}, None, {"logs": logs}) for ratio, logs in truth)
    ship, trials = trials_of("usv", ("zigzag", "random", "zigzag", "random"), 60.0, 5, true, validate=0)
    ready = prepare(trials, ship.model)
    names = [s.name for s in ready.identify]
    one = next(a for a in candidates(ready.structure) if a.effect.name == "mass_change")
    structure = ready.structure
    for _, logs in begins:
        options = {**one.variant.options, "logs": tuple(names[k] for k in logs)}
        structure = structure.with_effect(replace(one, variant=replace(one.variant, options=options)))
    p = null_parameters(structure)
    p[[k for k, s in enumerate(structure.slots) if s.name == "ratio"]] = [ratio for ratio, _ in begins]
    return pruned(fit_from_scratch(structure, ready.identify, p), Pace()).solution, names


def test_two_changes_of_the_load_that_are_one_become_one():
    """Lighter in the first log, and heavier in that and in two others: it is those two that were heavier."""
    left, names = with_loads([(1.5, (1, 3))], (1.0 / 1.5, (0,)), (1.5, (0, 1, 3)))
    [active] = left.structure.actives
    assert active.variant.options["logs"] == (names[1], names[3])
    assert left.structure.values(left.p, 0)["ratio"] == pytest.approx(1.5, rel=0.02)


def test_two_changes_of_the_load_that_are_two_stay_two():
    left, _ = with_loads([(0.7, (0,)), (1.5, (3,))], (0.7, (0,)), (1.5, (3,)))
    ratios = [left.structure.values(left.p, k)["ratio"] for k in range(2)]
    assert ratios == pytest.approx([0.7, 1.5], rel=0.03)
