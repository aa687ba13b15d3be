"""How an effect is declared: once, for regression, simulation, report and the search for what is missing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from identify.actuator_dynamics import Before
from identify.term import Term
from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
#: Means (n,) of a command or of an actuator over the steps of a grid, and what those of its square with sign are more
#: than the squares of these.
Acting = tuple[FloatArray, FloatArray]
Values = Mapping[str, float]


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect.

    Attributes
    ----------
    name, unit : str
        As in the report; SI.
    scale : float
        A typical size: the search's first step, and what "small" means.
    bounds : (low, high)
        Physically possible.
    null : float
        Value at which the effect is not there.
    starts : tuple of float
        Where a search begins, where the cost may have several valleys or no slope at ``null``; empty: at ``null``.
    relative : bool
        Scale, starts and a lower bound above zero are in units of the amplitude of the input that the effect acts on.
    believed : mapping of str to float
        How far from ``null`` a ``relative`` one is believed by the input's kind, in units of its largest value.
    known : float
        Standard deviation about ``null`` with which it is known beforehand.
    shape : bool
        Whether it says of what kind an effect is (a period), not how much of it there is: at ``null`` it need not be
        nothing.
    places : int
        At so many places all over its bounds a search is begun off the noise, where the cost has several valleys.
    slight : float
        What is off its null by no more than this is in every log: known to be so in the fit, it is no effect.
    within : callable, optional
        ``within(vessel) -> (low, high)``: bounds that depend on the vessel, in place of ``bounds``.
    """

    name: str
    unit: str
    scale: float
    bounds: tuple[float, float] = (-np.inf, np.inf)
    null: float = 0.0
    starts: tuple[float, ...] = ()
    relative: bool = False
    believed: Mapping[str, float] = field(default_factory=dict)
    known: float = np.inf
    shape: bool = False
    places: int = 0
    slight: float = 0.0
    within: Callable[[Vessel], tuple[float, float]] | None = None


@dataclass(frozen=True)
class Loading:
    """Factors on the coefficients of inertial terms (Coriolis), on all others, and on the hull's once more.

    ``added`` is the factor on what other effects add; as on all others where nothing is said.
    """

    inertial: float = 1.0
    others: float = 1.0
    hull: float = 1.0
    added: float | None = None


@dataclass(frozen=True)
class Setting:
    """What an effect may look at to say where it could act; ``one_receiver``: position and velocity have one clock."""

    vessel: Vessel
    inputs: tuple[Input, ...]
    terms: tuple[Term, ...]
    logs: tuple[str, ...]
    depths: tuple[float | None, ...] = ()
    streams: tuple[str, ...] = ("position", "heading")
    wind_logged: bool = False
    identify_logs: tuple[str, ...] = ()
    one_receiver: bool = False

    def of_kind(self, *kinds: str) -> tuple[str, ...]:
        """Names of the inputs of these kinds."""
        return tuple(i.name for i in self.inputs if i.kind in kinds)

    @property
    def depths_tell(self) -> bool:
        """Whether declared depths say in which logs the water is shallower than in others."""
        return len({d for d in self.depths if d is not None}) > 1

    def lacks(self, dof: str, *texts: str) -> bool:
        """True where the model has none of these terms in the equation of ``dof``."""
        return not any(t.dof == dof and t.text in texts for t in self.terms)


@dataclass(frozen=True)
class Variant:
    """One way in which an effect could be there: on which input, on which ``besides`` alike, with which options."""

    input: str | None = None
    options: Mapping[str, object] = field(default_factory=dict)
    besides: tuple[str, ...] = ()

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs that it is on; none where it is tied to none."""
        return () if self.input is None else (self.input, *self.besides)

    @property
    def each(self) -> tuple[Variant, ...]:
        """The same on each of its inputs by itself."""
        return tuple(Variant(n, self.options) for n in self.inputs) or (self,)

    def acts_on(self, name: str) -> bool:
        """Whether it acts on an input; on all where it is tied to none."""
        return self.input is None or name in self.inputs


@dataclass(frozen=True)
class SensorShift:
    """What a sensor effect does: logged = true + bias, and so on; times in s, offsets as stamp - true time."""

    heading_bias: float = 0.0
    gyro_bias: float = 0.0
    gyro_scale: float = 0.0
    antenna: tuple[float, float] = (0.0, 0.0)
    clock: Mapping[str, float] = field(default_factory=dict)


def everywhere(_: Setting) -> list[Variant]:
    """One variant: the effect is not tied to an input."""
    return [Variant()]


@dataclass(frozen=True)
class Effect:
    """An effect: where it acts, its parameters, and what it does.

    An effect says what it does through one or more of the following, each a pure function of its parameter values;
    what it does not use stays None.

    Attributes
    ----------
    name : str
        As in reports.
    place : str
        ``water``, ``air``, ``hull``, ``actuator``, ``propulsion``, ``sensor``, ``clock`` or ``loading``.
    equation, sentence, check, source : str
        For the report and the documentation: the equation, what it is, what a person should check on the vessel,
        and where it is described.
    parameters : tuple of Parameter
        Non-linear parameters, searched.
    terms : callable
        ``terms(setting, variant) -> {parameter name: Term}``: regressors that it adds, solved for; those of an effect
        on loading are in ``options["logs"]`` alone.
    fixed_terms : callable
        ``fixed_terms(values) -> ((Term, coefficient), …)``: regressors whose coefficients follow from the parameters.
    actuator : callable
        ``actuator(values, (series, surge), dt, options, before) -> (series, surge)``: from logged input to actuator, on
        a fine grid.
    lasting : callable
        ``lasting(values, change) -> s`` for which the actuator still answers to a change of its input by so much.
    begins : callable
        ``begins(options)``: whether nothing says where the actuator is as a log begins: ``before.begin`` must be found.
    on_its_way : bool
        Whether the actuator may be on its way as a log begins: ``before.begin`` off what it was told, in its unit.
    stepwise : callable
        ``stepwise(options)``: whether its first parameter is a size that the input passes or not, and nothing changes
        between two values that the input has.
    bends : callable
        ``bends(options)``: whether it bends what an input does about its zero. Two that do on one input follow any
        curve there, and are no two causes.
    rewire : callable
        ``rewire(options, {input: series}) -> {input: series}``: inputs exchanged or reversed.
    gain : callable
        ``gain(values, campaign time (n,)) -> factor (n,)`` on the thrust of the input (of all, where it has none).
    current, air : callable
        ``current(values) -> (north, east)`` velocity of the water, of the air, m/s.
    sensor : callable
        ``sensor(values, options) -> SensorShift``.
    input_delay : callable
        ``input_delay(values) -> s`` by which the actuator (all, where the variant has no input) follows the log.
    loading : callable
        ``loading(values, options) -> Loading`` in ``options["logs"]``.
    forms : callable
        ``forms(variant) -> [Variant, …]``: other readings of the same cause, not tried by themselves; which of them it
        is the data say once it is taken.
    variants : callable
        ``variants(setting) -> [Variant, …]``; an empty list where the effect makes no sense.
    report : callable
        ``report(values) -> {name: value}`` where the parameters reported differ from those searched; their units are
        in ``reported``.
    by_inverse : tuple of str
        Values reported of which the measurements tell the inverse: a wind's speed shows in how much the vessel's own
        changes its push, and what tells it poorly hardly bounds it from above.
    by_its_square : tuple of str
        Coefficients that go with the square of that inverse: the push is known, and so its product with the square.
    """

    name: str
    place: str
    equation: str
    sentence: str
    check: str
    source: str
    parameters: tuple[Parameter, ...] = ()
    terms: Callable[[Setting, Variant], Mapping[str, Term]] | None = None
    fixed_terms: Callable[[Values], tuple[tuple[Term, float], ...]] | None = None
    actuator: Callable[[Values, Acting, float, Mapping[str, object], Before], Acting] | None = None
    lasting: Callable[[Values, float], float] | None = None
    begins: Callable[[Mapping[str, object]], bool] | None = None
    on_its_way: bool = False
    stepwise: Callable[[Mapping[str, object]], bool] | None = None
    bends: Callable[[Mapping[str, object]], bool] | None = None
    rewire: Callable[[Mapping[str, object], dict[str, FloatArray]], dict[str, FloatArray]] | None = None
    gain: Callable[[Values, FloatArray], FloatArray] | None = None
    current: Callable[[Values], tuple[float, float]] | None = None
    air: Callable[[Values], tuple[float, float]] | None = None
    sensor: Callable[[Values, Mapping[str, object]], SensorShift] | None = None
    input_delay: Callable[[Values], float] | None = None
    loading: Callable[[Values, Mapping[str, object]], Loading] | None = None
    forms: Callable[[Variant], list[Variant]] | None = None
    variants: Callable[[Setting], list[Variant]] = everywhere
    report: Callable[[Values], Mapping[str, float]] | None = None
    reported: Mapping[str, str] = field(default_factory=dict)
    by_inverse: tuple[str, ...] = ()
    by_its_square: tuple[str, ...] = ()


def read_as(*forms: str) -> Callable[[Variant], list[Variant]]:
    """The other readings of a variant: without a form, and in each of these."""

    def others(variant: Variant) -> list[Variant]:
        rest = {k: v for k, v in variant.options.items() if k != "form"}
        readings = [rest, *(rest | {"form": form} for form in forms)]
        return [replace(variant, options=x) for x in readings if x != variant.options]

    return others


@dataclass(frozen=True)
class Active:
    """An effect that is in a structure, in one of its variants; ``begin`` is where it is at a log's begin."""

    effect: Effect
    variant: Variant = field(default_factory=Variant)
    begin: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_slack(self) -> bool:
        """Whether nothing says where the actuator is as a log begins."""
        return self.effect.begins is not None and self.effect.begins(self.variant.options)

    @property
    def nulls(self) -> dict[str, float]:
        """Parameter values at which it is not there."""
        return {p.name: p.null for p in self.effect.parameters}

    @property
    def label(self) -> str:
        """Name that tells it from the other variants of the same effect."""
        options = [_text(k, v) for k, v in self.variant.options.items()]
        parts = [p for p in (" and ".join(self.variant.inputs), *options) if p]
        return self.effect.name + (f" ({', '.join(parts)})" if parts else "")


def _text(key: str, value: object) -> str:
    listed = " and ".join(map(str, value)) if isinstance(value, tuple) else str(value)
    return f"{key} {listed}" if key in ("swapped", "reversed") else listed
