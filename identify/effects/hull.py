"""Effects of the hull: what a model that is too simple leaves out."""

from __future__ import annotations

from collections.abc import Callable

from identify.effect import Effect, Parameter, Setting, Values, Variant
from identify.slowness import slower
from identify.term import Term, factors_of
from preprocess.vessel import Vessel


def _missing(*wanted: tuple[str, Term, tuple[str, ...]]) -> Callable[[Setting, Variant], dict[str, Term]]:
    """Those of the terms that the model lacks: (parameter, term, texts that are the same regressor)."""

    def terms(setting: Setting, _: Variant) -> dict[str, Term]:
        return {name: term for name, term, same in wanted if setting.lacks(term.dof, term.text, *same)}

    return terms


def _if_any(terms: Callable[[Setting, Variant], dict[str, Term]]) -> Callable[[Setting], list[Variant]]:
    return lambda setting: [Variant()] if terms(setting, Variant()) else []


def _has_surge(setting: Setting) -> bool:
    """Whether the model knows the speed: to one that does not, what grows with it is nothing new."""
    return any(t.dof == "u" for t in setting.terms)


def _if_any_with_speed(
    terms: Callable[[Setting, Variant], dict[str, Term]],
) -> Callable[[Setting], list[Variant]]:
    return lambda setting: _if_any(terms)(setting) if _has_surge(setting) else []


_DAMPING = _missing(
    ("u", Term("u", "u|u|"), ("|u|u",)),
    ("v", Term("v", "v|v|"), ("|v|v",)),
    ("r", Term("r", "r|r|"), ("|r|r",)),
)

QUADRATIC_DAMPING = Effect(
    "quadratic_damping", "hull",
    "u̇ += X u|u|, v̇ += Y v|v|, ṙ += N r|r| (those that the model lacks)",
    "Drag from separated flow grows with the square of the speed.",
    "Runs at two or three speeds and zigzags of two or three amplitudes; pull-outs.",
    "Fossen 2011, sec. 6.4",
    terms=_DAMPING, variants=_if_any(_DAMPING),
)  # fmt: skip


_LINEAR = _missing(
    ("u", Term("u", "u"), ("Δu", "ΔuU")), ("v", Term("v", "v"), ("vU",)), ("r", Term("r", "r"), ("rU",))
)

LINEAR_DAMPING = Effect(
    "linear_damping", "hull",
    "u̇ += X u, v̇ += Y v, ṙ += N r (those that the model lacks)",
    "At low speed friction and the waves that a hull makes damp in proportion to the speed.",
    "Slow runs and pull-outs; zigzags of small amplitude.",
    "Fossen 2011, sec. 6.4",
    terms=_LINEAR, variants=_if_any_with_speed(_LINEAR),
)  # fmt: skip


def _turning(setting: Setting, _: Variant) -> dict[str, Term]:
    rudder = bool(setting.of_kind("rudder"))
    return _missing(
        ("vr", Term("u", "vr", "inertial"), ()),
        ("rr", Term("u", "r²"), ()),
        *((("dd", Term("u", "δ²", "rudder"), ("δ²U²",)),) if rudder else ()),
    )(setting, Variant())


TURNING_RESISTANCE = Effect(
    "turning_resistance", "hull",
    "u̇ += X_vr vr + X_rr r² + X_dd δ² (those that the model lacks)",
    "A vessel loses speed in a turn: Coriolis force of the drift, and the drag of hull and rudder.",
    "Turning circles at several rudder angles with the speed logged.",
    "Moreno-Salinas et al. 2013, eq. 7",
    terms=_turning, variants=_if_any(_turning),
)  # fmt: skip

_ASYMMETRY = _missing(("sway", Term("v", "1", "bias"), ()), ("yaw", Term("r", "1", "bias"), ()))

PORT_STARBOARD_ASYMMETRY = Effect(
    "port_starboard_asymmetry", "hull",
    "v̇ += Y_0, ṙ += N_0 (those that the model lacks)",
    "A constant side force or yawing moment: a bent skeg, an uneven load, a list.",
    "Trim and list, skegs and fouling; the same manoeuvre to both sides.",
    "Moreno-Salinas et al. 2013, sec. 5",
    terms=_ASYMMETRY, variants=_if_any(_ASYMMETRY),
)  # fmt: skip


_CROSS = _missing(
    *(
        (f"{axis}_{name}", Term(dof, text, "inertial" if (dof, text) == ("v", "ur") else "hull"), same)
        for axis, dof in (("sway", "v"), ("yaw", "r"))
        for name, text, same in (
            ("uv", "uv", ("vU",)),
            ("ur", "ur", ("rU",)),
            ("vr", "|v|r", ("v²r/U",)),
            ("rv", "|r|v", ("vr²/U",)),
        )
    )
)

CROSS_TERMS = Effect(
    "cross_terms", "hull",
    "v̇ += Y_uv uv + Y_ur ur + Y_|v|r |v|r + Y_|r|v |r|v, ṙ likewise (those that the model lacks)",
    "Drift and turning act on each other, and grow with the speed: the declared model couples them too simply.",
    "Zigzags and turning circles at two or three speeds; a model with more terms.",
    "Skjetne et al. 2004; Fossen 2011, sec. 6.5",
    terms=_CROSS, variants=_if_any_with_speed(_CROSS),
)  # fmt: skip


def _rudder_flow(setting: Setting, _: Variant) -> dict[str, Term]:
    """The rudder's force with the square of the speed, and without it: those that the model lacks."""
    known = [t for t in setting.terms if t.role == "rudder" and t.dof in ("v", "r")]
    by_speed = [t for t in known if {"u", "|u|", "U"} & set(factors_of(t.text))]
    if not known or (by_speed and len(by_speed) < len(known)):
        return {}
    text = "δ" if by_speed else "δU²"
    return {"sway": Term("v", text, "rudder"), "yaw": Term("r", text, "rudder")}


RUDDER_FLOW = Effect(
    "rudder_flow", "hull",
    "v̇ += Y δU², ṙ += N δU² where the model has the rudder's force without the speed; else with δ alone",
    "A rudder's force grows with the square of the flow past it: the vessel's speed, and the propeller's race.",
    "Zigzags at two or three speeds; the same with the propeller slowed.",
    "Fossen 2011, sec. 9.5; Yasukawa and Yoshimura 2015, eqs. 19-27",
    terms=_rudder_flow, variants=_if_any_with_speed(_rudder_flow),
)  # fmt: skip


#: Natural frequencies to look at first, rad/s: so close that each is within reach of a resonance between two.
_ROLL = (0.22, 0.3, 0.4, 0.54, 0.73, 0.98, 1.33, 1.8, 2.4, 3.3, 4.4, 6.0, 8.1)
#: From so much damping on, √½, nothing is answered more at one frequency than at lower ones: that is no swing, and what
#: wants more of it is something else (waves of another shape than they are known by).
NO_SWING = 0.7


def _roll(p: Values) -> tuple[tuple[Term, float], ...]:
    omega = p["frequency"]
    return (
        (Term("e1", "e2"), 1.0),
        (Term("e2", "e1"), -omega * omega),
        (Term("e2", "e2"), -2.0 * p["damping"] * omega),
        (Term("e2", "ur"), 1.0),
        (Term("v", "e1", "roll"), p["sway"]),
        (Term("r", "e1", "roll"), p["yaw"]),
    )


def _rolls(vessel: Vessel) -> tuple[float, float]:
    """Natural frequencies that a vessel may roll at, rad/s: as much lower as it is slower than a small boat."""
    return 0.2 / slower(vessel.length), 15.0 / slower(vessel.length)


ROLL_COUPLING = Effect(
    "roll_coupling", "hull",
    "φ̈ + 2ζω φ̇ + ω² φ = ur; v̇ += Y_φ φ, ṙ += N_φ φ",
    "The vessel heels in turns, and the heel acts back on sway and yaw.",
    "Log roll; metacentric height; tight turns at speed.",
    "Fossen 2011, sec. 6.6; Blanke and Christensen 1993",
    parameters=(
        Parameter("frequency", "rad/s", 0.5, null=3.0, starts=_ROLL, shape=True, within=_rolls),
        Parameter("damping", "1", 0.1, (0.02, NO_SWING), null=0.1, starts=(0.2,) * len(_ROLL), shape=True),
        Parameter("sway", "1/s²", 0.1, (-50.0, 50.0)),
        Parameter("yaw", "1/(m·s²)", 0.1, (-50.0, 50.0)),
    ),
    fixed_terms=_roll,
    variants=lambda s: [Variant()] if not any(t.dof in ("e1", "e2") for t in s.terms) else [],
)  # fmt: skip
