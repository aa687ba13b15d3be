"""The prime system's doors, and ships of the same form at another size."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from test_simulate import blanke, fit_of
from typer.testing import CliRunner

from identify.fit import Estimated, FittedEffect
from identify.nondimensional import scale_factors
from identify.simulate import Order
from ingest.errors import UsageError
from preprocess.vessel import Input
from seatrial import prime_coefficients, similar, simulate
from seatrial.cli.app import make_app
from validate.report.model_file import write_model

SCALE = 9.0


def large_of(small):
    return similar(small, SCALE * small.vessel.length)


def test_a_ship_of_the_same_form_turns_in_the_same_lengths():
    small = blanke(spread=0.01)
    turn = Order("circle", math.radians(35), samples=0)
    first, second = simulate(small, turn), simulate(large_of(small), turn)
    assert second.speed == pytest.approx(3.0 * first.speed, rel=1e-3)
    for name in ("advance", "transfer", "tactical_diameter"):
        assert second[name].value == pytest.approx(SCALE * first[name].value, rel=5e-3)
    assert second["time_to_90"].value == pytest.approx(3.0 * first["time_to_90"].value, rel=5e-3)
    assert second["steady_drift"].value == pytest.approx(first["steady_drift"].value, rel=5e-3)


def in_prime(fit, speed):
    """Covariance without dimension."""
    factor = scale_factors([c.unit for c in fit.coefficients], fit.vessel.length, speed)
    return fit.covariance * np.outer(factor, factor)


def test_prime_coefficients_are_those_of_every_size():
    small = blanke(spread=0.01)
    own, other = prime_coefficients(small, 1.2), prime_coefficients(large_of(small), 3.6)
    assert np.allclose([c.value for c in own], [c.value for c in other], rtol=1e-12)
    assert np.allclose([c.stderr for c in own], [c.stderr for c in other], rtol=1e-12)
    assert np.allclose(in_prime(small, 1.2), in_prime(large_of(small), 3.6), rtol=1e-12)
    by_term = {(c.dof, c.term): c.value for c in own}
    length = small.vessel.length
    assert by_term["u", "|u|u"] == pytest.approx(-0.05 * length)
    assert by_term["r", "δ"] == pytest.approx(-0.5 * length**2 / 1.2**2)


def test_there_and_back_is_the_same_ship():
    effect = FittedEffect("current", None, (Estimated("", "speed", 0.3, 0.01, "m/s"),))
    small = fit_of({("u", "|u|u"): -0.05}, "blanke", (), 0.1, (effect,), u0=1.1)
    back = similar(large_of(small), small.vessel.length)
    for name in ("length", "beam", "draught", "mass", "yaw_inertia"):
        own = getattr(small.vessel, name)
        assert getattr(back.vessel, name) == (None if own is None else pytest.approx(own))
    assert large_of(small).vessel.mass == pytest.approx(SCALE**3 * small.vessel.mass)
    assert np.allclose(back.covariance, small.covariance, rtol=1e-12)
    assert back.effects[0].parameters[0].value == pytest.approx(0.3)
    assert large_of(small).effects[0].parameters[0].value == pytest.approx(0.9)
    assert back.u0 == pytest.approx(1.1)


def test_what_cannot_be_scaled_is_named():
    with pytest.raises(UsageError, match="above 0"):
        similar(blanke(), 0.0)
    with pytest.raises(UsageError, match="pod"):
        similar(fit_of({}, "modulus", (Input("pod", "thruster", unit="N"),)), 10.0)
    odd = FittedEffect("actuator_rate_limit", "n", (Estimated("", "rate", 0.3, 0.01, "rev/s²"),))
    with pytest.raises(UsageError, match="actuator_rate_limit"):
        similar(fit_of({}, "modulus", (), 0.0, (odd,)), 10.0)
    with pytest.raises(UsageError, match="--speed"):
        prime_coefficients(blanke())


def test_the_command_prints_derivatives_and_larger_ships(tmp_path):
    model = tmp_path / "model.json"
    write_model(blanke(spread=0.01), model)
    shown = CliRunner().invoke(make_app(), ["simulate", str(model), "--prime", "--speed", "1.2"])
    assert shown.exit_code == 0, shown.output
    assert "speeds in 1.2 m/s" in shown.output
    arguments = ["simulate", str(model), "--length", "320", "--speed", "8"]
    data = json.loads(CliRunner().invoke(make_app(), [*arguments, "--prime", "--json"]).output)
    assert data["length"] == 320.0
    assert len(data["coefficients"]) == len(blanke().coefficients)
    (turn,) = json.loads(
        CliRunner().invoke(make_app(), [*arguments, "circle 35", "--samples", "0", "--json"]).output
    )
    diameter = next(m for m in turn["measures"] if m["name"] == "tactical_diameter")
    assert 320.0 < diameter["value"] < 3200.0
    assert diameter["limit"] == 5 * 320.0
