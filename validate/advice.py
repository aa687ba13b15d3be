"""What to do next, in sentences."""

from __future__ import annotations

from collections.abc import Mapping

from identify.effects import EFFECTS
from validate.diagnosis import TakenEffect, Verdict
from validate.loop import Outcome

_CHECK = {e.name: e.check for e in EFFECTS}


def advice_for(
    verdict: Verdict,
    taken: tuple[TakenEffect, ...],
    left: Mapping[str, float],
    outcome: Outcome,
    materiality: float,
) -> str:
    """Sentences: what to check on the vessel, and which manoeuvre would decide."""
    del outcome
    parts = [f"{t.fitted.name}: {_CHECK.get(t.fitted.name, '')}" for t in taken]
    for t in taken:
        if t.look_alikes:
            others = ", ".join(t.look_alikes)
            parts.append(
                f"On these data {t.fitted.name} cannot be told from {others}; to decide: {_decide(t)}"
            )
    if verdict is Verdict.UNEXPLAINED:
        worst = max(left, key=lambda c: left[c])
        parts.append(
            f"In {worst}, {100 * left[worst]:.0f} % of the standard deviation is structure that nothing in the library "
            f"accounts for (material above {100 * materiality:.0f} %). Look at the residuals in the report: when, at "
            "which heading, speed and input they grow."
        )
    if verdict is Verdict.ADEQUATE:
        parts.append("Nothing to add. Other speeds and amplitudes than those of these logs remain untested.")
    return " ".join(parts)


def _decide(t: TakenEffect) -> str:
    checks = (_CHECK.get(n.split(" (")[0], "") for n in (t.fitted.name, *t.look_alikes))
    return " ".join(dict.fromkeys(c for c in checks if c))
