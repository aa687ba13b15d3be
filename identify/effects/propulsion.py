"""Effects of propellers and thrusters."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from identify.effect import Effect, Parameter, Setting, Variant
from identify.term import Term

THRUSTERS = ("propeller", "thruster", "tunnel")


def _one_of(setting: Setting, least: int, most: float) -> list[Variant]:
    """Each thruster of the kinds of which there are so many.

    Of two the weaker is named, since that is what is amiss, be it that the other is stronger; of more the others say.
    """
    kinds = (setting.of_kind(kind) for kind in THRUSTERS)
    return [Variant(n) for names in kinds if least <= len(names) <= most for n in names]


THRUST_ASYMMETRY = Effect(
    "thrust_asymmetry", "propulsion",
    "thrust of the input × ratio",
    "One thruster gives less than its sisters: a fouled or damaged propeller, a weak motor, another pitch.",
    "Propellers (weed, chips, hand), motor current at the same command, bollard pull of each alone.",
    "Fossen 2011, sec. 9.3",
    parameters=(Parameter("ratio", "1", 0.1, (0.0, 1.0), null=1.0, starts=(0.85, 0.5, 0.2)),),
    gain=lambda p, t: np.full(t.shape, p["ratio"]),
    variants=lambda s: _one_of(s, 2, 2),
)  # fmt: skip

#: Among three or more of a kind.
THRUST_AMONG_MANY = replace(
    THRUST_ASYMMETRY,
    sentence="One of several thrusters gives less than the others, or more: a fouled or damaged propeller, a weak "
    "motor, another pitch.",
    parameters=(Parameter("ratio", "1", 0.1, (0.0, 5.0), null=1.0, starts=(0.85, 0.5, 0.2, 1.25)),),
    variants=lambda s: _one_of(s, 3, math.inf),
)


def _walk(_: Setting, variant: Variant) -> dict[str, Term]:
    turned = f"P:{variant.input}" if variant.input else "|n|n"
    return {"sway": Term("v", turned, "thrust"), "yaw": Term("r", turned, "thrust")}


def _walking(setting: Setting) -> list[Variant]:
    """Each propeller or thruster, and where there are several all of them alike, which turn the same way round."""
    names = setting.of_kind("propeller", "thruster")
    return [*([Variant()] if len(names) > 1 else []), *map(Variant, names)]


PROPELLER_WALK = Effect(
    "propeller_walk", "propulsion",
    "v̇ += Y n|n|, ṙ += N n|n|; of one propeller or thruster, or of the sum over all",
    "A propeller pushes the stern sideways, the more the harder it turns.",
    "Straight runs at several rates of revolution with the rudder at zero; going astern.",
    "Yasukawa and Yoshimura 2015, sec. 2.4; Carlton 2012, ch. 11",
    terms=_walk,
    variants=_walking,
)  # fmt: skip

THRUST_FADE = Effect(
    "thrust_fade", "propulsion",
    "thrust × (1 − rate · campaign time), which begins with the first log",
    "Thrust falls in the course of the day: the battery's voltage sags, the motors warm up.",
    "Battery voltage against time; repeat the first run at the end of the day.",
    "measured on electric vessels without speed control",
    parameters=(Parameter("rate", "1/s", 1e-4, (-0.01, 0.01)),),
    gain=lambda p, t: np.maximum(1.0 - p["rate"] * t, 0.05),
    variants=lambda s: [Variant()] if s.of_kind(*THRUSTERS) else [],
)  # fmt: skip


def _loss(_: Setting, __: Variant) -> dict[str, Term]:
    return {"coefficient": Term("u", "−|n|u", "thrust")}


THRUST_LOSS_WITH_SPEED = Effect(
    "thrust_loss_with_speed", "propulsion",
    "u̇ −= c |n| u; |n| summed over propellers and thrusters",
    "A propeller gives less thrust the faster the water comes to it.",
    "Runs at one speed with two loads (towing, wind), or acceleration from rest at full power.",
    "Fossen 2011, eq. 9.7; Yasukawa and Yoshimura 2015, eq. 22",
    terms=_loss,
    variants=lambda s: [Variant()] if s.of_kind("propeller", "thruster") and s.lacks("u", "|n|u") else [],
)  # fmt: skip
