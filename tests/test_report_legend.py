"""The legend of the equations: every symbol that stands in them, with the levers and units of this vessel."""

from dataclasses import replace

import numpy as np
import pytest

from identify.fit import Estimated
from identify.forces import channel_names, shares, thrust, together
from preprocess.vessel import Input
from validate.report.legend import legend
from validate.report.page import report_page

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
