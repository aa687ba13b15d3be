"""Standard manoeuvres with an identified model."""

from identify.simulate.manoeuvre import Manoeuvre, simulate
from identify.simulate.measures import Measure
from identify.simulate.order import Order, parse_order
from identify.simulate.rebuild import Rebuilt, rebuild

__all__ = ["Manoeuvre", "Measure", "Order", "Rebuilt", "parse_order", "rebuild", "simulate"]
