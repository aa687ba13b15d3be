"""The legend of the equations: every symbol that stands in them, with the levers and units of this vessel."""

from dataclasses import replace

import numpy as np
import pytest

from identify.fit import Estimated, FittedEffect
from identify.forces import channel_names, shares, thrust, together
from preprocess.vessel import Input
from validate.report.effect_terms import beside, equations_and_terms
from validate.report.legend import legend
from validate.report.page import report_page
from validate.report.parameters import labels

RUDDER = Input("rudder", "rudder", position=(-1.9, 0.0))
SCREW = Input("propeller", "propeller", position=(-1.8, 0.0))
LEFT = Input("left", "thruster", position=(-0.35, -0.30))
RIGHT = Input("right", "thruster", position=(-0.35, 0.30))


def with_terms(example, inputs, *terms):
    coefficients = tuple(Estimated("r", "x", 1.0, 0.1, "1", term=t) for t in terms)
    return replace(example.after, inputs=inputs, coefficients=coefficients)


@pytest.mark.parametrize(
    ("inputs", "term", "symbol", "says"),
    [
        ((RUDDER, SCREW), "U²N:rudder", "N:rudder", "moment: −1.90 m × rudder; rudder in rad"),
        ((RUDDER, SCREW), "U²F:rudder", "F:rudder", "side force: rudder; rudder in rad"),
        ((RUDDER, SCREW), "T:propeller", "T:propeller", "thrust: propeller·|propeller|; propeller in rev/s"),
        ((LEFT, RIGHT), "N:thruster", "N:thruster",
         "moment: 0.300 m × left·|left| − 0.300 m × right·|right|; thruster from −1 to 1"),
        ((replace(LEFT, law="linear", unit="N"),), "T:thruster", "T:thruster", "thrust: left; thruster in N"),
        ((replace(SCREW, position=(-1.0, 0.2)), Input("pod", "azimuth", drives="propeller")), "N:propeller",
         "N:propeller", "moment: (−1.00 sin α − 0.200 cos α) m × propeller·|propeller|, α being pod; "
         "propeller in rev/s"),
        ((RUDDER, replace(RUDDER, name="other")), "δ", "δ", "mean of rudder and other, rad, its sign the log's own"),
        ((SCREW,), "Δu³/U", "U", "√(u² + v²), m/s"),
    ],
)  # fmt: skip
def test_a_symbol_is_told_with_its_levers_and_units(example, inputs, term, symbol, says):
    assert dict(legend(with_terms(example, inputs, term)))[symbol] == says


def test_the_levers_are_those_by_which_inputs_act():
    inputs, series = (LEFT, RIGHT), {"left": np.array([0.5]), "right": np.array([-0.2])}
    series |= {f"thrust {i.name}": thrust(i, series[i.name]) for i in inputs}
    names = channel_names(inputs)
    moment = 0.0
    for unit in together(inputs):
        places, rows = shares(names, inputs, unit, series)
        moment += rows[places.index(names.index("N:thruster"))]
    assert moment == pytest.approx(0.300 * 0.5 * 0.5 - 0.300 * -0.2 * 0.2)


def test_the_page_tells_its_symbols(example, example_page):
    assert "<dt>δ</dt><dd>rudder, rad" in example_page
    page = report_page(replace(example, after=with_terms(example, (RUDDER, SCREW), "U²N:rudder")))
    assert "<dt>N:rudder</dt><dd>moment: −1.90 m × rudder" in page


def with_effect(fit, name, *names, input=None, options=None):
    parameters = tuple(Estimated("", n, 0.5, 0.1, "s") for n in names)
    fit = replace(fit, coefficients=(Estimated("u", "X_u", -1.0, 0.1, "1/s", term="u"),))
    count = 1 + len(names)
    effects = (FittedEffect(name, input, parameters, options or {}),)
    return replace(fit, effects=effects, covariance=0.01 * np.eye(count))


@pytest.mark.parametrize(
    ("name", "names", "symbols", "rows"),
    [
        ("turning_resistance", ("vr", "dd"), {"δ"}, [("u", "vr"), ("u", "δ²")]),
        ("thrust_loss_with_speed", ("coefficient",), {"n"}, [("u", "−|n|u")]),
        ("roll_coupling", ("frequency", "damping", "sway", "yaw"), {"e1, e2"}, [("", "")] * 4),
        ("wind", ("cx", "cy", "cn", "speed", "direction"), {"Vwx, Vwy"},
         [("u", "Vwx"), ("v", "Vwy"), ("r", "Vwy"), ("", ""), ("", "")]),
        ("actuator_lag", ("time_constant",), set(), [("", "")]),
    ],
)  # fmt: skip
def test_terms_that_an_effect_adds_have_their_equation_and_symbols(example, name, names, symbols, rows):
    fit = with_effect(replace(example.after, inputs=(RUDDER, SCREW)), name, *names)
    assert symbols == dict(legend(fit)).keys() - {"u, v, r"}
    assert equations_and_terms(fit) == [("u", "u"), *rows]


def test_a_force_of_the_rudder_with_the_speed_is_told_from_one_without(example):
    own = (
        Estimated("v", "Y", 1.0, 0.1, "1", term="F:rudder"),
        Estimated("r", "N", 1.0, 0.1, "1", term="N:rudder"),
    )
    fit = with_effect(replace(example.after, inputs=(RUDDER, SCREW)), "rudder_flow", "sway", "yaw")
    fit = replace(fit, coefficients=own)
    assert equations_and_terms(fit)[2:] == [("v", "δU²"), ("r", "δU²")]


def test_the_page_names_the_effects_in_the_model_and_says_how_an_actuator_acts(example):
    fit = with_effect(
        replace(example.after, inputs=(RUDDER, SCREW)), "actuator_lag", "time_constant", input="rudder"
    )
    page = report_page(replace(example, after=fit))
    assert "The model: blanke with actuator lag of rudder</h2>" in page
    assert "<li>an actuator lag of rudder (time constant 0.50 ± 0.10 s): T ȧ + a = input</li>" in page
    assert "actuator lag: time constant" in page
    turning = with_effect(fit, "turning_resistance", "dd")
    assert list(beside(turning)) == []
    assert '<td class="nowrap">u̇: δ²</td>' in report_page(replace(example, after=turning))


def test_one_effect_on_two_inputs_is_told_apart(example):
    both = tuple(
        FittedEffect("actuator_lag", n, (Estimated("", "time_constant", 0.5, 0.1, "s"),)) for n in ("a", "b")
    )
    names = labels(replace(example.after, effects=both))[-2:]
    assert names == ["actuator lag of a: time constant", "actuator lag of b: time constant"]
