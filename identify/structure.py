"""A model with the effects that are in it, as a table for the compiled code and a layout of its parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from identify import flow
from identify.effect import Active, Setting
from identify.forces import channel_names, together
from identify.layout import Layout, layout_of
from identify.models import MODEL_BY_NAME, Model, model_for, terms_for
from identify.slot import CLOCK, U0, Slot
from identify.slots import slots_of
from identify.tape import Tape, tape_of
from identify.term import FACTORS, MOST_FACTORS, Term, factors_of
from ingest.errors import UsageError
from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

_EQUATION = {"u": 0, "v": 1, "r": 2, "e1": 3, "e2": 4}


@dataclass(frozen=True)
class Table:
    """The sum of products that the compiled code evaluates; one coefficient per term."""

    terms: tuple[Term, ...]
    equation: IntArray
    which: IntArray
    product: IntArray
    channels: tuple[str, ...]
    flow: FloatArray = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def tape(self) -> Tape:
        """The same as products and sums in order, as the compiled code takes it."""
        places = [len(FACTORS) + self.channels.index(c) for c in flow.CHANNELS if len(self.flow)]
        return tape_of(
            self.product, self.equation, len(self.channels), np.array(places, dtype=np.uint64), self.flow
        )

    @cached_property
    def answering(self) -> tuple[tuple[int, tuple[str, ...]], ...]:
        """Terms that answer to an input, each with its factors that do."""
        acting = {*self.channels, *flow.RESULTS}
        found = ((k, tuple(f for f in factors_of(t.text) if f in acting)) for k, t in enumerate(self.terms))
        return tuple((k, names) for k, names in found if names)

    @cached_property
    def equation_of(self) -> IntArray:
        """Equation that each coefficient belongs to."""
        return np.array([_EQUATION[t.dof] for t in self.terms], dtype=np.int64)


@dataclass(frozen=True)
class Rewiring:
    """Effects that exchange inputs; the same where their labels are."""

    labels: tuple[str, ...]
    actives: tuple[Active, ...] = field(compare=False)


@dataclass(frozen=True)
class Structure:
    """Model, effects and what they act on.

    ``extents`` are half the range of every input, and its largest value without sign.
    ``input_lead`` is the prior (mean, standard deviation) in s of how far the actuators may be ahead of the logged
    inputs because an input is only logged now and then; None where that is negligible. ``unsure`` is the standard
    deviation in s of the stamps of streams whose times only the order of the records tells, all together. ``u0`` is the
    speed that terms in Δu are about, or where the search for it begins if it is to be ``u0_found``. If it ``slows``, no
    coefficient drives it at high speeds (``identify.braked``).
    """

    model: Model
    vessel: Vessel
    inputs: tuple[Input, ...]
    setting: Setting
    u0: float
    actives: tuple[Active, ...] = ()
    extents: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    input_lead: tuple[float, float] | None = None
    unsure: Mapping[str, float] = field(default_factory=dict)
    u0_found: bool = False
    slows: bool = False

    def with_effect(self, active: Active) -> Structure:
        """The same with one more effect."""
        return replace(self, actives=(*self.actives, active))

    def without(self, index: int) -> Structure:
        """The same without the effect at ``index``."""
        return replace(self, actives=tuple(a for k, a in enumerate(self.actives) if k != index))

    @property
    def has_following_states(self) -> bool:
        """Whether an effect brings states of its own, which follow the motion."""
        return any(a.effect.fixed_terms for a in self.actives)

    @cached_property
    def table(self) -> Table:
        """The sum of products of these terms."""
        factors = [factors_of(t.text) for t in self.terms]
        used = set().union(*factors)
        constants: FloatArray = np.zeros(0)
        if self.model.flow:
            constants, used = flow.constants_of(self.vessel, self.inputs), used | set(flow.INPUTS)
        names = tuple(n for n in channel_names(self.inputs) if n in used)
        names += flow.CHANNELS[len(flow.INPUTS) :] if self.model.flow else ()
        index = {f: k for k, f in enumerate((*FACTORS, *names))}
        product = np.zeros((len(self.terms), MOST_FACTORS), dtype=np.int64)
        for row, mine in zip(product, factors, strict=True):
            places = [index[f] for f in mine if f != "1"]
            row[: len(places)] = places
        equation = np.array([_EQUATION[t.dof] for t in self.terms], dtype=np.int64)
        return Table(self.terms, equation, np.arange(len(self.terms)), product, names, constants)

    @cached_property
    def free_terms(self) -> tuple[tuple[tuple[str, Term], ...], ...]:
        """Per active effect: its free terms with their parameters' names, in the equations that the model has."""
        return tuple(tuple(self._terms_of(a)) for a in self.actives)

    def _terms_of(self, active: Active) -> Iterator[tuple[str, Term]]:
        terms = active.effect.terms(self.setting, active.variant) if active.effect.terms else {}
        return ((n, t) for n, t in terms.items() if t.dof in self.model.predicts)

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """Terms of the model, then of each effect (free ones, then those with given coefficients)."""
        terms = [*self.setting.terms, *(Term(dof, text) for dof, text, _ in self.model.fixed)]
        for active, free in zip(self.actives, self.free_terms, strict=True):
            terms += [t for _, t in free]
            if active.effect.fixed_terms:
                terms += [t for t, _ in active.effect.fixed_terms(active.nulls)]
        return tuple(terms)

    @property
    def lead_is_free(self) -> bool:
        """Whether the lead of the inputs can be told from the effects: a delay of all inputs is the same thing."""
        every = {i.name for i in self.inputs}
        late = [set(a.variant.inputs) or every for a in self.actives if a.effect.input_delay]
        return not set().union(*late) >= every

    def carried(self, p: FloatArray, source: Structure) -> FloatArray:
        """Parameters of this structure from those of another: what has the same effect and name, else nothing."""
        values = {source.key(s): v for s, v in zip(source.slots, p, strict=True)}
        return np.array([
            values.get(self.key(s), 0.0 if s.coefficient >= 0 else s.parameter.null) for s in self.slots
        ])  # fmt: skip

    def key(self, slot: Slot) -> tuple[str, str]:
        """Label of the slot's effect (none for the model's own) and its name."""
        return (self.actives[slot.effect].label if slot.effect >= 0 else "", slot.name)

    @cached_property
    def slots(self) -> tuple[Slot, ...]:
        """Layout of the parameter vector."""
        return slots_of(self)

    @cached_property
    def clock_slots(self) -> dict[str, int]:
        """Where the unknown parts of the streams' stamps stand among the parameters."""
        return {
            s.name.removesuffix(CLOCK): k for k, s in enumerate(self.slots) if s.nuisance and CLOCK in s.name
        }

    @cached_property
    def u0_is_free(self) -> bool:
        """Whether the speed that terms in Δu are about is a parameter of the model: where none is declared.

        Beside a constant none is: another speed is another constant.
        """
        constant = any((t.dof, t.text) == ("u", "1") for t in self.setting.terms)
        return self.u0_found and not constant and any("Δu" in factors_of(t.text) for t in self.setting.terms)

    @cached_property
    def u0_place(self) -> int:
        """Where that speed stands among the parameters; -1 where it is none."""
        mine = [k for k, s in enumerate(self.slots) if s.name == U0 and s.effect < 0 and s.coefficient < 0]
        return mine[0] if mine else -1

    def u0_at(self, p: FloatArray) -> float:
        """The speed that terms in Δu are about, m/s."""
        return self.u0 if self.u0_place < 0 else float(p[self.u0_place])

    def values(self, p: FloatArray, effect: int) -> dict[str, float]:
        """Named parameter values of one active effect."""
        return {name: float(p[k]) for name, k in self.layout.named[effect]}

    @cached_property
    def units(self) -> tuple[tuple[Input, ...], ...]:
        """Inputs whose doings cannot be told apart (``identify.forces.together``)."""
        return together(self.inputs)

    @cached_property
    def rewiring(self) -> Rewiring:
        """What exchanges inputs."""
        actives = tuple(a for a in self.actives if a.effect.rewire)
        return Rewiring(tuple(a.label for a in actives), actives)

    @cached_property
    def acted_on(self) -> frozenset[str]:
        """Inputs that an effect acts on, other than by a delay or by exchanging them."""
        return frozenset(i.name for i in self.inputs if any(_acts(a, i.name) for a in self.actives))

    @cached_property
    def layout(self) -> Layout:
        """Where what stands in its parameters and coefficients."""
        return layout_of(self)

    @cached_property
    def general(self) -> IntArray:
        """Indices of the parameters that are not plain coefficients."""
        return np.array([k for k, s in enumerate(self.slots) if s.coefficient < 0], dtype=np.int64)

    @cached_property
    def simple(self) -> IntArray:
        """Indices of the parameters that are plain coefficients."""
        return np.array([k for k, s in enumerate(self.slots) if s.coefficient >= 0], dtype=np.int64)


def _acts(active: Active, name: str) -> bool:
    """Whether an effect acts on an input, other than by a delay or by exchanging it."""
    moves = active.effect.actuator is not None and name in active.variant.inputs
    return moves or (active.effect.gain is not None and active.variant.acts_on(name))


def null_parameters(structure: Structure) -> FloatArray:
    """Parameters (np,) with every effect at its null and every coefficient zero."""
    return np.array([s.parameter.null if s.coefficient < 0 else 0.0 for s in structure.slots])


def effects_alone(structure: Structure, p: FloatArray) -> FloatArray:
    """The effects' parameters of ``p``, all coefficients zero, the speed that they are about where it is sought first.

    What a model lacked may have driven that speed to another zero of the resistance, from which none leads back.
    """
    out = np.where([s.coefficient < 0 for s in structure.slots], p, 0.0)
    if structure.u0_place >= 0:
        out[structure.u0_place] = structure.u0
    return out


def structure_for(
    model_name: str,
    vessel: Vessel,
    inputs: tuple[Input, ...],
    *,
    logs: tuple[str, ...],
    streams: tuple[str, ...],
    depths: tuple[float | None, ...] = (),
    wind_logged: bool = False,
    identify_logs: tuple[str, ...] = (),
    u0: float = 0.0,
    extents: Mapping[str, tuple[float, float]] | None = None,
    input_lead: tuple[float, float] | None = None,
    unsure: Mapping[str, float] | None = None,
    one_receiver: bool = False,
    u0_found: bool = False,
) -> tuple[Structure, tuple[str, ...]]:
    """The declared model alone, for this vessel and these logs, with notes on terms that were left out."""
    if model_name not in MODEL_BY_NAME:
        raise UsageError(
            f"the model '{model_name}' is not available in this version; there are {', '.join(MODEL_BY_NAME)}."
        )
    model = model_for(model_name, vessel, inputs)
    terms, notes = terms_for(model, vessel, inputs)
    notes = (*notes, f"{model.name}: {model.cannot}") if model.cannot else notes
    setting = Setting(vessel, inputs, terms, logs, depths, streams, wind_logged, identify_logs, one_receiver)
    return Structure(
        model, vessel, inputs, setting, u0, (), extents or {}, input_lead, unsure or {}, u0_found
    ), notes
