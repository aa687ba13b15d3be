"""The models, each declared once by its terms; regression, simulation and report read the same declaration."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from identify.forces import channel_names
from identify.mmg import inertial_terms
from identify.term import Term, factors_of
from preprocess.vessel import Input, Vessel


@dataclass(frozen=True)
class Model:
    """A manoeuvring model: the regressors of each acceleration, per unit inertia.

    Attributes
    ----------
    surge, sway, yaw, extra : tuple of str
        Terms as written by the field; ``extra`` pairs (dof, term) for states of its own, ``fixed``
        gives (dof, term, coefficient) for those that are not free.
    source : str
        Paper and equation.
    discrete : bool
        The model is its own explicit Euler step.
    flow : bool
        Thrust and rudder force come from the flow behind the hull, with parameters of its own (``identify.flow``).
    predicts : tuple of str
        States that it can predict.
    cannot : str
        A sentence on what no data can tell of it, said with every fit.
    """

    name: str
    surge: tuple[str, ...]
    sway: tuple[str, ...]
    yaw: tuple[str, ...]
    source: str
    extra: tuple[tuple[str, str], ...] = ()
    fixed: tuple[tuple[str, str, float], ...] = ()
    discrete: bool = False
    flow: bool = False
    predicts: tuple[str, ...] = ("x", "y", "psi", "u", "v", "r")
    cannot: str = ""


def _split(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(","))


_ZHU = _split("v, r, |v|r, δ")
_BLANKE = _split("ur, uv, |v|v, |v|r, δ, 1")
_CS2 = _split("ur, uv, v, |v|v, |r|v, r, |v|r, |r|r, |u|uδ, |u|u|δ|δ")
_CS2_SURGE = _split("u, |u|u, u³, vr, r², |n|n, |n|u")

#: Third-order expansion in v, r and the rudder's angle, rudder terms also with the speed, and a constant.
_TAYLOR = _split("ur, uv, v, r, δ, uδ, v³/U, v²r/U, vr²/U, r³/U, δ³, vδ², rδ², v²δ, r²δ, vrδ, 1")

#: What an expansion and its form in moduli have, together: where two describe the same, the prior shares it out.
_RICH = _split("ur, uv, v, r, δ, uδ, |v|v, |v|r, |r|v, |r|r, v³/U, v²r/U, vr²/U, r³/U, δ³, vδ², rδ², v²δ, r²δ, vrδ, "
               "|v|δ, |r|δ, |δ|v, |δ|r, 1")  # fmt: skip

#: The expansion of Xie et al. (2020) with U held at its value before the manoeuvre.
_AT_CONSTANT_SPEED = _split("1, Δu, Δu², v, r, δ, v³, δ³, v²r, v²δ, vδ², δΔu, vΔu, rΔu, δΔu²")

_MMG = _split("vU, rU, v³/U, v²r/U, vr²/U, r³/U, F_Ncosδ")

MODELS: tuple[Model, ...] = (
    Model("nomoto1", (), (), _split("r, δ"), "Nomoto et al. 1957", predicts=("psi", "r")),
    Model("nomoto2", (), (), _split("r, δ"), "Zhu et al. 2022, eq. 1", extra=(("e1", "r"), ("e1", "δ")),
          fixed=(("r", "e1", 1.0),), predicts=("psi", "r")),
    Model("nomoto_nonlinear", (), (), _split("r, r³, δ, 1"), "Norrbin 1963; Fossen 2011, eq. 7.51",
          predicts=("psi", "r")),
    Model("zhu2019", _split("u, |u|u, u³, |n|n"), _ZHU, _ZHU, "Zhu et al. 2019, eq. 2"),
    Model("blanke", _split("|u|u, vr, r², |n|n, δ², 1"), _BLANKE, _BLANKE, "Moreno-Salinas et al. 2013, eq. 7"),
    Model("abkowitz", _split("Δu, ΔuU, Δu², Δu³/U, v², r², δ²U², δ²ΔuU, vr, vδU, rδU"),
          _split("v, U², ΔuU, Δu², vU, rU, δU², v³/U, δ³U², v²r/U, v²δ, vδ²U, δΔuU, vΔu, rΔu, δΔu²"),
          _split("r, U², ΔuU, Δu², vU, rU, δU², v³/U, δ³U², v²r/U, v²δ, vδ²U, δΔuU, vΔu, rΔu, δΔu²"),
          "Xie et al. 2020, eqs. 5-6"),
    Model("abkowitz_perturbation", _split("Δu, Δu², Δu³, v², r², δ², δ²Δu, vr, vδ, rδ"),
          _AT_CONSTANT_SPEED, _AT_CONSTANT_SPEED, "Abkowitz 1964; Xie et al. 2020, eqs. 5-6 with constant U",
          cannot="with a constant U, of Δu and ΔuU (surge), v and vU (sway), r and rU (yaw) the sum alone can be "
          "identified, and it holds near that speed only."),
    Model("cybership2", _CS2_SURGE, _CS2, _CS2, "Zhao and Li 2021, eqs. 1-9; Skjetne et al. 2004"),
    Model("zhao2021", _CS2_SURGE, _CS2, _CS2, "Zhao and Li 2021, eqs. 13-15", discrete=True),
    Model("modulus", _split("u, u|u|, vr, r², T"), _split("v, v|v|, r, ur, F_y"), _split("r, r|r|, v, uv, N_F"),
          "Fossen 2011, sec. 7.3"),
    Model("linear", _split("u, vr, r², T"), _split("v, r, ur, F_y"), _split("r, v, uv, N_F"), "Fossen 2011, sec. 7.3"),
    Model("taylor3", _split("|u|u, v², vr, r², |n|n, δ², vδ, rδ"), _TAYLOR, _TAYLOR,
          "Abkowitz 1964; Strom-Tejsen 1965"),
    Model("taylor_modulus", _split("u, |u|u, v², vr, r², v⁴/U², |n|n, δ², vδ, rδ"), _RICH, _RICH,
          "Abkowitz 1964; Fedyaevsky and Sobolev 1963"),
    Model("mmg", _split("U², v², vr, r², v⁴/U², T_P, F_Nsinδ"), _MMG, _MMG, "Yasukawa and Yoshimura 2015, eqs. 4-27",
          flow=True),
)  # fmt: skip

MODEL_BY_NAME = {m.name: m for m in MODELS}

#: Terms that come from inertia (Coriolis), not from forces.
_INERTIAL = {("u", "vr"), ("u", "r²"), ("v", "ur")}


def model_for(name: str, vessel: Vessel, inputs: tuple[Input, ...]) -> Model:
    """The model of this name for this vessel: with what its particulars fix.

    Raises
    ------
    UsageError
        Where the model needs particulars that the vessel does not have.
    """
    model = MODEL_BY_NAME[name]
    return replace(model, fixed=inertial_terms(vessel, inputs)) if model.flow else model


def terms_for(
    model: Model, vessel: Vessel, inputs: tuple[Input, ...]
) -> tuple[tuple[Term, ...], tuple[str, ...]]:
    """Terms of a model for this vessel's inputs, and sentences about those that had to be left out."""
    names = channel_names(inputs)
    terms: list[Term] = []
    notes: list[str] = []
    for dof, texts in (("u", model.surge), ("v", model.sway), ("r", model.yaw)):
        for text in texts:
            made = list(_expand(dof, text, names))
            terms += made
            if not made:
                notes.append(f"{dof}: the term {text} is left out: no input of this vessel makes it.")
    terms += [Term(dof, text) for dof, text in model.extra]
    return tuple(terms), tuple(notes)


def _expand(dof: str, text: str, names: tuple[str, ...]) -> Iterable[Term]:
    """One term of the declaration; thrust, side force and moment once for each kind of input that gives them."""
    axis = {"T": "T", "F_y": "F", "N_F": "N"}.get(text)
    if axis is not None:
        for name in names:
            if name.startswith(axis + ":"):
                rudder = name.endswith(":rudder")
                yield Term(dof, f"U²{name}" if rudder else name, "rudder" if rudder else "thrust", not rudder)
        return
    channels = [f for f in factors_of(text) if f in ("δ", "|δ|", "|n|n", "|n|")]
    if all(c in names for c in channels):
        yield Term(dof, text, _role(dof, text, channels), text in ("|n|n", "T_P"))


def _role(dof: str, text: str, channels: list[str]) -> str:
    if (dof, text) in _INERTIAL:
        return "inertial"
    if text == "1":
        return "bias"
    if text == "T_P":
        return "thrust"
    if text.startswith("F_N"):
        return "rudder"
    return "rudder" if any("δ" in c for c in channels) else ("thrust" if channels else "hull")
