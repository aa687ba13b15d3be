"""Numbers and findings as a person reads them: degrees, two digits of the error, whole sentences."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import replace

from identify.fit import Estimated, Fit, FittedEffect
from identify.written import beyond_decimals, last_digit
from identify.written import number as number
from identify.written import plus_minus as plus_minus
from identify.written import superscript as superscript
from validate.diagnosis import Results, TakenEffect, Verdict
from validate.report.labels import in_words

DEGREES = 180.0 / math.pi
#: What stands on the left of the equation of a channel.
RATES = {"u": "u̇", "v": "v̇", "r": "ṙ"}
#: What an R² lacks of one where three decimals say too little of it, and where it lacks nothing that matters.
NEARLY, NEAREST = 0.01, 1e-7
#: Effects of which there is no "one".
UNCOUNTED = frozenset((
    "waves", "propeller_walk", "thrust_fade", "thrust_loss_with_speed", "quadratic_damping", "turning_resistance",
    "roll_coupling", "shallow_water", "cross_terms", "rudder_flow", "linear_damping",
))  # fmt: skip
#: What an error after ± is.
STATISTICAL = (
    "is the statistical standard error: what sensors, and pushes that nothing logged, leave uncertain if the model "
    "with what it lacks is right. How far the model itself is off is not in it."
)
BADGES = {None: "Not searched", Verdict.ADEQUATE: "Adequate", Verdict.EXPLAINED: "Explained",
          Verdict.AMBIGUOUS: "Ambiguous", Verdict.UNEXPLAINED: "Unexplained"}  # fmt: skip


def interval(value: float, error: float) -> str:
    """The 95 % interval as ``[low, high]``; a dash where no error is known, as of what is merged into another."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return "–"
    low, high = value - 1.96 * error, value + 1.96 * error
    last = last_digit(error)
    if beyond_decimals(last, max(abs(low), abs(high))):
        return f"[{number(low)}, {number(high)}]"
    decimals = max(0, -last)
    return f"[{low:.{decimals}f}, {high:.{decimals}f}]".replace("-", "−")


def share(value: float | None) -> str:
    """An R² with three decimals; near one as many as tell what it lacks of it, far below zero three digits."""
    if value is None or not math.isfinite(value):
        return "–"
    if value <= -10:
        return number(value)
    lacking = 1.0 - value
    decimals = -last_digit(lacking) if NEAREST < lacking < NEARLY else 3
    whole, rest = f"{value:.{decimals}f}".split(".")
    return f"{whole}.{rest.rstrip('0'):0<3}".replace("-", "−")


def percent(share: float | None) -> str:
    """A share as a percentage; above ten times the whole only that."""
    if share is None or not math.isfinite(share):
        return "–"
    return "> 1000 %" if share > 10 else f"{100 * share:.1f} %" if share < 0.0995 else f"{100 * share:.0f} %"


def probability(value: float | None) -> str:
    """A p-value: ``< 0.001`` below that, two digits above."""
    if value is None or not math.isfinite(value):
        return "–"
    return "< 0.001" if value < 0.001 else number(value, 2)


def duration(seconds: float | None) -> str:
    """Seconds as ``12.3 s``, ``4 min 05 s`` or ``1 h 02 min``."""
    if seconds is None or not math.isfinite(seconds):
        return "–"
    whole = round(seconds)
    if seconds < 100:
        return f"{seconds:.1f} s"
    return (
        f"{whole // 60} min {whole % 60:02d} s"
        if whole < 3600
        else f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    )


def size(count: int) -> str:
    """Bytes as ``312 B``, ``24.4 kB``, ``1.2 MB``."""
    for unit, limit in (("B", 1e3), ("kB", 1e6), ("MB", 1e9)):
        if count < limit:
            scaled = count / (limit / 1e3)
            return f"{scaled:.0f} {unit}" if unit == "B" else f"{scaled:.3g} {unit}"
    return f"{count / 1e9:.3g} GB"


def plain_name(name: str) -> str:
    """``actuator_lag`` as ``actuator lag``."""
    return name.replace("_", " ")


def joined(items: Iterable[str], last: str = "and") -> str:
    """``a, b and c``."""
    words = list(items)
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}" if words else ""


def in_powers(text: str) -> str:
    """``4.91e-05`` as ``4.91·10⁻⁵``."""
    return re.sub(r"(?<=\d)e([+-]?\d+)", lambda found: f"·10{superscript(int(found[1]))}", text)


def as_period(p: Estimated) -> Estimated:
    """A frequency as its period, s, which is what a person sees; anything else as it is."""
    if p.name != "frequency" or p.unit != "rad/s" or not p.value > 0:
        return p
    value = 2 * math.pi / p.value
    return replace(p, name="period", value=value, stderr=value * p.stderr / p.value, unit="s")


def for_reading(p: Estimated) -> tuple[float, float, str]:
    """Value, error and unit with angles in degrees."""
    if p.unit == "rad" or p.unit.startswith("rad/"):
        return p.value * DEGREES, p.stderr * DEGREES, p.unit.replace("rad", "°", 1)
    return p.value, p.stderr, "" if p.unit == "1" else p.unit


def quantity(p: Estimated, errors: bool = True) -> str:
    """A parameter with its unit, and its error if wanted; angles in degrees, directions in 0-360."""
    value, error, unit = for_reading(p)
    value = value % 360 if p.name == "direction" and math.isfinite(value) else value
    gap = "" if unit == "°" or not unit else " "
    return (plus_minus(value, error) if errors else number(value)) + gap + unit


def name_of(effect: FittedEffect) -> str:
    """An effect without its numbers: ``actuator lag of rudder``."""
    return plain_name(effect.name) + (f" of {effect.input}" if effect.input else "")


def effect_words(effect: FittedEffect, errors: bool = True) -> str:
    """One effect as a noun phrase with its numbers, and their errors if wanted."""
    values = {p.name: quantity(p, errors) for p in map(as_period, effect.parameters)}
    if effect.name == "current" and {"speed", "direction"} <= values.keys():
        return f"a current of {values['speed']} flowing to {values['direction']}"
    if effect.name == "wind" and {"speed", "direction"} <= values.keys():
        return f"a wind of {values['speed']} from {values['direction']}"
    if effect.name == "input_wiring":
        return wiring_words(effect)
    numbers = ", ".join(f"{plain_name(k)} {v}" for k, v in values.items())
    of = f" of {effect.input}" if effect.input else ""
    return f"{article(effect.name)}{plain_name(effect.name)}{of}{option_words(effect)}" + (
        f" ({numbers})" if numbers else ""
    )


def article(name: str) -> str:
    """``a`` or ``an`` before an effect that can be counted."""
    if name in UNCOUNTED:
        return ""
    return "an " if name[0] in "aeiou" else "a "


def wiring_words(effect: FittedEffect) -> str:
    """Inputs that are swapped or reversed."""
    ways = (("swapped", effect.options.get("swapped")), ("reversed", effect.options.get("reversed")))
    parts = [
        f"a {way} wiring of {joined(map(str, of))}"
        for way, of in ways
        if isinstance(of, (list, tuple)) and of
    ]
    return joined(parts) or "a wiring that is not as declared"


#: Forms of effects that their names do not tell.
_FORMS = {
    "whole": ", Coriolis terms too,",
    "coupled": ", Coriolis terms in part,",
    "apart": ", what other effects add left as it is,",
    "whole apart": ", Coriolis terms too, what other effects add left as it is,",
}


def option_words(effect: FittedEffect) -> str:
    """What of an effect is not a number: form, stream, logs."""
    options = effect.options
    form = _FORMS.get(str(form), f" as {form}") if (form := options.get("form")) else ""
    stream = f" of the {plain_name(str(options['stream']))} stream" if options.get("stream") else ""
    logs = options.get("logs")
    return (
        form + stream + (f" in {joined(map(str, logs))}" if isinstance(logs, (list, tuple)) and logs else "")
    )


def look_alikes(effects: Iterable[TakenEffect]) -> list[str]:
    """Every look-alike once, in order."""
    return list(dict.fromkeys(in_words(x) for e in effects for x in e.look_alikes))


def error_words(results: Results) -> str:
    """How the error on unseen logs changed, in the plainest number there is."""
    before, after = results.validation_before, results.validation_after
    for what, b, a, unit, scale in (
        ("position error", before.position_rmse, after.position_rmse, "m", 1.0),
        ("heading error", before.heading_rmse, after.heading_rmse, "°", DEGREES),
        ("fitness", before.fitness, after.fitness, "", 1.0),
    ):
        if b is not None and a is not None and math.isfinite(b) and math.isfinite(a):
            verb = "falls" if a < b else "rises"
            gap = "" if unit == "°" or not unit else " "
            first, last = number(b * scale), number(a * scale)
            change = f"stays at {last}" if first == last else f"{verb} from {first} to {last}"
            return f"the {what} on unseen logs {change}{gap}{unit}"
    return "no error on unseen logs can be given"


def is_validated(results: Results) -> bool:
    """Whether any log, or part of one, was left to validate on."""
    return any(log.role == "validate" for log in results.validation_after.logs)


def unseen_words(results: Results) -> str:
    """How well unseen logs are predicted, channel by channel, and which no better than by their mean."""
    if not is_validated(results):
        return "nothing was left to validate it on"
    known = {c: s.r2 for c, s in results.validation_after.channels.items() if s.r2 is not None}
    if not known:
        return "no error on unseen logs can be given"
    scores = joined(f"{c} {share(r2)}" for c, r2 in known.items())
    poor = [c for c, r2 in known.items() if not r2 > 0]
    where = "" if len(poor) == len(known) else f"in {joined(poor)} "
    no_good = f", {where}no better than the mean of what was measured" if poor else ""
    return f"it predicts unseen logs with an R² of {scores}{no_good}"


def headline(results: Results) -> str:
    """The answer in one sentence."""
    found, model = results.diagnosis, results.after.model
    if found is None:
        return f"The model {model} was fitted; {unseen_words(results)}; what it lacks was not searched for."
    effects = joined(effect_words(e.fitted, errors=False) for e in found.effects) or "what is named below"
    if found.verdict is Verdict.ADEQUATE:
        return f"The model {model} lacks nothing material that these data can show."
    if found.verdict is Verdict.EXPLAINED:
        return f"The model {model} lacked {effects}; with this, {error_words(results)}."
    if found.verdict is Verdict.AMBIGUOUS:
        others = joined(look_alikes(found.effects), "or") or "another cause"
        return (
            f"The model {model} lacks something: best explained by {effects}, but on these data that "
            f"cannot be told from {others}; with it, {error_words(results)}."
        )
    beside = f"Beside {effects}, the" if found.effects else "The"
    return f"{beside} model {model} misses something material that no known effect accounts for."


def equations(fit: Fit) -> list[str]:
    """Linear equations as they were fitted, from the coefficients and their terms."""
    out = []
    for dof in dict.fromkeys(p.dof for p in fit.coefficients if p.dof):
        terms = [(p.value, p.term or p.name) for p in fit.coefficients if p.dof == dof]
        signed = [
            f"{'−' if v < 0 else '+'} {number(abs(v), 4)} {'' if t == '1' else t}".strip() for v, t in terms
        ]
        left = RATES.get(dof, dof)
        out.append(f"{left} = {' '.join(signed).removeprefix('+ ')}")
    return out
