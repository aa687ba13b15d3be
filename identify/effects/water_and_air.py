"""Effects of the water and of the air around the hull."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from identify.effect import Effect, Loading, Parameter, Setting, Values, Variant, read_as
from identify.term import Term


def _polar(values: Values, north: str, east: str, *, comes_from: bool) -> dict[str, float]:
    n, e = values[north], values[east]
    angle = math.atan2(-e, -n) if comes_from else math.atan2(e, n)
    return {"speed": math.hypot(n, e), "direction": angle % (2 * math.pi)}


CURRENT = Effect(
    "current", "water",
    "ẋ = u_w cos ψ − v_w sin ψ + V_n, ẏ = u_w sin ψ + v_w cos ψ + V_e; the hull feels u_w, v_w",
    "A steady current carries the vessel; the hull's forces depend on velocities through the water.",
    "Drift with everything off, or one turn of 360° each way: the track's shift over a turn is the current.",
    "Fossen 2011, sec. 8.3; IMO MSC/Circ.1053, 3.4.2.5",
    parameters=(Parameter("north", "m/s", 0.1, (-5, 5)), Parameter("east", "m/s", 0.1, (-5, 5))),
    current=lambda p: (p["north"], p["east"]),
    variants=lambda s: [Variant()] if "position" in s.streams else [],
    report=lambda p: _polar(p, "north", "east", comes_from=False),
    reported={"speed": "m/s", "direction": "rad"},
)  # fmt: skip


#: Most winds that small vessels are tried in are within twice this, m/s: a harder one with less area pushes nearly as
#: hard, and only this sets a limit.
SAILED_IN = 7.0


def _wind_terms(_: Setting, __: Variant) -> dict[str, Term]:
    return {"cx": Term("u", "Vwx", "air"), "cy": Term("v", "Vwy", "air"), "cn": Term("r", "Vwy", "air")}


def _pushed_along(setting: Setting, variant: Variant) -> dict[str, Term]:
    """The same for a wind that nothing measured: it pushes the way that it blows."""
    terms = _wind_terms(setting, variant)
    return {n: replace(t, positive=n != "cn") for n, t in terms.items()}


WIND = Effect(
    "wind", "air",
    "u̇ += c_x V w_x, v̇ += c_y V w_y, ṙ += c_n V w_y; w the air's velocity relative to the vessel, V = |w|",
    "Wind pushes on what stands above the water; w is made from the logged wind.",
    "Compare runs up and down wind; look at the anemometer's alignment; estimate the frontal and lateral areas.",
    "Fossen 2011, sec. 8.1",
    terms=_wind_terms,
    variants=lambda s: [Variant()] if s.wind_logged else [],
)  # fmt: skip

WIND_UNSEEN = Effect(
    "wind", "air",
    "u̇ += c_x V w_x, v̇ += c_y V w_y, ṙ += c_n V w_y; w the air's velocity relative to the vessel, V = |w|",
    "A steady wind that nothing on board measured pushes on what stands above the water.",
    "Log the wind (an anemometer on board or ashore), or repeat on a calm day.",
    "Fossen 2011, sec. 8.1",
    parameters=(
        Parameter("north", "m/s", 2.0, (-30, 30), starts=(5.0, -5.0, 0.0, 0.0), known=SAILED_IN),
        Parameter("east", "m/s", 2.0, (-30, 30), starts=(0.0, 0.0, 5.0, -5.0), known=SAILED_IN),
    ),
    air=lambda p: (p["north"], p["east"]),
    terms=_pushed_along,
    variants=lambda s: [] if s.wind_logged else [Variant()],
    report=lambda p: _polar(p, "north", "east", comes_from=True),
    reported={"speed": "m/s", "direction": "rad"},
    by_inverse=("speed",),
    by_its_square=("cx", "cy", "cn"),
)  # fmt: skip


def _shallow(setting: Setting) -> list[Variant]:
    if setting.depths_tell:
        deepest = max(d for d in setting.depths if d is not None)
        shallow = [
            n for n, d in zip(setting.logs, setting.depths, strict=True) if d is not None and d < deepest
        ]
        return [Variant(options={"logs": tuple(shallow)})]
    known = setting.identify_logs or setting.logs
    return [Variant(options={"logs": (name,)}) for name in known] if len(known) > 1 else []


def _heavier_water(values: Values, options: Mapping[str, object]) -> Loading:
    """Coriolis terms, which are the water's only in part, stay; in the whole form they grow with the hull's."""
    factor = values["factor"]
    return Loading(inertial=factor if options.get("form") == "whole" else 1.0, hull=factor)


def _turning_there(_: Setting, variant: Variant) -> dict[str, Term]:
    """In the coupled form, what turning with headway does besides in the logs named."""
    if variant.options.get("form") != "coupled":
        return {}
    return {"sway_ur": Term("v", "ur", "inertial"), "yaw_ur": Term("r", "ur", "inertial")}


SHALLOW_WATER = Effect(
    "shallow_water", "water",
    "every coefficient of the hull × factor in the logs named, less Coriolis terms or (form whole) with them, or (form "
    "coupled) with v̇ += Y_ur ur, ṙ += N_ur ur there: where sway and yaw share inertia, a part of these grows",
    "In shallow water the hull's resistance and damping grow.",
    "Log the depth; a depth below three draughts matters, below 1.5 draughts it dominates.",
    "Fossen 2011, sec. 6.4; ITTC 7.5-02-06-04",
    parameters=(Parameter("factor", "1", 0.1, (1.0, 10.0), null=1.0),),
    loading=_heavier_water,
    terms=_turning_there,
    forms=read_as("whole", "coupled"),
    variants=_shallow,
)  # fmt: skip
