"""What to do next, in sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from identify.effects import EFFECTS
from identify.effects.actuators import ACTUATOR_LAG
from identify.effects.sensors import ANY_LOGGERS
from identify.gusts import GUSTIEST
from identify.stretch import Stretch
from validate.became import left_out_words
from validate.deciding import deciding_manoeuvre
from validate.diagnosis import TakenEffect, Verdict
from validate.judgement import INDISTINCT
from validate.outcome import Outcome
from validate.report.words import joined, percent
from validate.rounds import MOST_EFFECTS

#: Inputs logged less often than every so many s are worth a word.
SLOW = 0.15
#: What is said where no manoeuvre would set two causes apart.
NOTHING_SAILED = "no standard manoeuvre would; look at the vessel."

#: From this share of a standard deviation on structure is there, be it too small to matter.
SEEN = 0.01
_CHECK = {e.name: e.check for e in EFFECTS} | {
    "waves": "Note the sea and the swell on the day; repeat a run in calm water, or on other courses to the waves."
}


def advice_for(
    verdict: Verdict,
    taken: tuple[TakenEffect, ...],
    left: Mapping[str, float],
    outcome: Outcome,
    materiality: float,
    undetermined: Mapping[str, float] = MappingProxyType({}),
) -> str:
    """Sentences: what to check on the vessel, and which manoeuvre would decide."""
    parts = [*checks_of(taken), *_either_of_two(taken, outcome), *_either_time(taken, outcome)]
    said = {t.fitted.name for t in taken}
    for t in taken:
        if t.look_alikes:
            others = joined(t.look_alikes, "or")
            name = t.fitted.name + _of([t.fitted.input] if t.fitted.input else [])
            parts.append(
                f"On these data {name} cannot be told from {others}; to decide: {_decide(t, outcome)}"
            )
            parts += [f"{n}: {_CHECK[n]}" for n in names_of(t.look_alikes) if n in _CHECK and n not in said]
            said |= set(names_of(t.look_alikes))
    if any(t.fitted.name == "wind" for t in taken):
        parts += _gusts(outcome)
    if verdict is Verdict.UNEXPLAINED:
        parts.append(_unexplained(left, outcome, materiality))
    if outcome.refuted:
        parts.append(
            f"Taken back: {_once(outcome.refuted)}: windows of the logs to identify on are fitted better so, unseen "
            "or whole logs predicted no better. Sail the same manoeuvre twice, once for each, to see what differs."
        )
    if outcome.unsure:
        parts.append(
            f"Not taken: {_once(outcome.unsure)}: the fit gains by it, but with what pushes the vessel unlogged its "
            "value may as well be nothing, or it moves the vessel so little that a small fault of the model would do."
        )
    if outcome.slight:
        parts.append(
            f"Stamps are off by no more than any logger's, {1e3 * ANY_LOGGERS:.0f} ms: {joined(outcome.slight)}. The "
            "fit knows of it; it is no effect."
        )
    parts += left_out_words(outcome)
    if outcome.refuted or verdict is Verdict.UNEXPLAINED:
        parts += _slow_inputs(outcome)
    if undetermined:
        parts += _undetermined(undetermined, outcome)
    elif verdict is Verdict.ADEQUATE:
        rest = _immaterial(left, materiality) or "Nothing to add."
        parts.append(f"{rest} Other speeds and amplitudes than those of these logs remain untested.")
    return " ".join(parts)


def _unexplained(left: Mapping[str, float], outcome: Outcome, materiality: float) -> str:
    """What is said of structure that matters."""
    worst, many = max(left, key=lambda c: left[c]), len(outcome.standing) >= MOST_EFFECTS
    nothing = "no one or two effects" if many else "nothing in the library"
    together = (
        "Those named above, as many as ever are taken, make up for it together; it is probably none of them. "
    )
    return (
        f"In {worst}, {percent(left[worst])} of the standard deviation is structure that {nothing} accounts for "
        f"(material above {100 * materiality:.0f} %). {together if many else ''}Look at the residuals in the report: "
        "when, at which heading, speed and input they grow."
    )


def _immaterial(left: Mapping[str, float], materiality: float) -> str:
    """What is said of structure that is there and too small to matter; nothing where there is none."""
    worst = max(left, key=lambda c: left[c])
    if left[worst] < SEEN:
        return ""
    return (
        f"In {worst}, {percent(left[worst])} of the standard deviation is structure that nothing in the library "
        "accounts for: something is missing, and on such logs too small to matter (material above "
        f"{100 * materiality:.0f} %)."
    )


def checks_of(taken: Sequence[TakenEffect]) -> list[str]:
    """What to look at on the vessel: one sentence per effect, its inputs named where there are several."""
    inputs: dict[str, list[str]] = {}
    for t in taken:
        inputs.setdefault(t.fitted.name, []).extend([t.fitted.input] if t.fitted.input else [])
    return [f"{name}{_of(found)}: {_CHECK.get(name, '')}" for name, found in inputs.items()]


def _of(inputs: Sequence[str]) -> str:
    return f" of {joined(inputs)}" if inputs else ""


def _once(labels: Sequence[str]) -> str:
    """Labels in words, each once: a search may have come back to what was taken back."""
    return joined(list(dict.fromkeys(labels)))


def _either_of_two(taken: Sequence[TakenEffect], outcome: Outcome) -> list[str]:
    """Of two of a kind only the ratio is known: the other may as well be the stronger by as much."""
    found = []
    for t in taken:
        if t.fitted.name == "thrust_asymmetry" and (other := _only_other(t.fitted.input, outcome)):
            more = 1.0 / max(t.fitted.parameters[0].value, 1e-3)
            found.append(
                f"Of two only their ratio is known: {other} may as well give {more:.3g} times {t.fitted.input}."
            )
    return found


def _either_time(taken: Sequence[TakenEffect], outcome: Outcome) -> list[str]:
    """Of two systems of first order in a row, a lag and Nomoto's hull, no log says which is which."""
    lags = [
        t.fitted.parameters[0].value
        for t in taken
        if t.fitted.name == ACTUATOR_LAG.name and t.fitted.parameters
    ]
    if not lags or outcome.fitted.solution.structure.model.name != "nomoto1":
        return []
    structure, p = outcome.fitted.solution.structure, outcome.fitted.solution.p
    [damping] = [p[k] for k, s in enumerate(structure.slots) if s.effect < 0 and s.name == "N_r"]
    return [
        "Of two delays of first order in a row no log says which is which: the hull's T may as well be "
        f"the {lag:.3g} s, and the actuator's lag {-1.0 / damping:.3g} s."
        for lag in lags
    ]


def _only_other(name: str | None, outcome: Outcome) -> str:
    """The one other input of the kind of an input; "" where there are several, or none."""
    kinds = {i.name: i.kind for i in outcome.fitted.solution.structure.inputs}
    others = [n for n, kind in kinds.items() if n != name and kind == kinds.get(name or "")]
    return others[0] if len(others) == 1 else ""


def names_of(labels: Sequence[str]) -> list[str]:
    """Effects of labels such as ``clock_offset (inputs)``, each once."""
    return list(dict.fromkeys(label.split(" (")[0] for label in labels))


def _undetermined(shares: Mapping[str, float], outcome: Outcome) -> list[str]:
    """What follows from coefficients that the logs of the fit leave open, for the share that each channel is off by."""
    off = joined([f"{c} by {percent(x)}" for c, x in shares.items()])
    parts = [
        f"On the unseen logs predictions are off ({off} of the standard deviation), and the coefficients' own "
        "uncertainty allows that: the logs to identify on do not determine them for such motion. Identify on a "
        "manoeuvre of that kind as well, or declare a model with fewer terms."
    ]
    if idle := idle_inputs(outcome.fitted.problem.stretches):
        parts.append(f"None of the logs to identify on moves {joined(idle, 'or')}: use it in one of them.")
    return parts


def idle_inputs(stretches: Sequence[Stretch]) -> list[str]:
    """Names of the inputs that keep one value in all of these logs."""
    values = {k: np.concatenate([s.inputs[k].value for s in stretches]) for k in stretches[0].inputs}
    return [k for k, x in values.items() if np.ptp(x) == 0.0]


def _gusts(outcome: Outcome) -> list[str]:
    """How gusty a wind was that nothing measured."""
    unlogged = outcome.fitted.problem.unlogged
    if not unlogged or not unlogged.gusty:
        return []
    intensity = GUSTIEST * math.sqrt(unlogged.gusty)
    return [
        f"The errors are likeliest with gusts of about {percent(intensity)} of the wind's speed, which no model can "
        "follow; the standard errors count them."
    ]


def _slow_inputs(outcome: Outcome) -> list[str]:
    """What to change in the logging where inputs may have changed long before their next sample."""
    slowest = max((m.sample_time for m in outcome.fitted.problem.stretches[0].inputs.values()), default=0.0)
    if slowest < SLOW:
        return []
    return [
        f"The inputs are logged only every {slowest:.2g} s. When they changed in between is not known; on vessels that "
        "answer fast this alone makes errors of this kind. Log them at 10 Hz or more, or on every change."
    ]


def _decide(t: TakenEffect, outcome: Outcome) -> str:
    """The manoeuvre that would tell them apart."""
    rivals = [r for s in outcome.standing if s.active.effect.name == t.fitted.name for r in s.rivals]
    sailed = deciding_manoeuvre(outcome.fitted, rivals) if rivals else None
    return sailed.sentence + "." if sailed and sailed.separation > INDISTINCT else NOTHING_SAILED
