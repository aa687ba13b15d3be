"""What neither unseen nor whole logs speak against, of what a search found."""

from __future__ import annotations

from dataclasses import replace

from identify.fitted import Fitted
from identify.prediction_fit import fit_far_from_noise
from identify.prepare import Prepared
from validate.logs_of_effects import in_logs_as_they_say
from validate.look_alikes import dropped, losses_without
from validate.outcome import Outcome, all_standing
from validate.pace import Pace
from validate.pruning import searched
from validate.told_logs import told_of_the_odd_logs
from validate.unseen import leads_astray, speak_against


def borne_out(
    prepared: Prepared, declared: Fitted, outcome: Outcome, after: Fitted
) -> tuple[Outcome, Fitted]:
    """What neither unseen nor whole logs speak against, in the logs that say so; else the wiring.

    Where they speak against all of it, the least of it may be why: it is taken back alone, as long as others are left.
    """
    placed = told_of_the_odd_logs(in_logs_as_they_say(outcome, prepared))
    after = after if placed is outcome else placed.fitted
    if not spoken_against(prepared, declared, after):
        return placed, after
    fewer = _fewer_borne_out(prepared, declared, placed) if after is placed.fitted else None
    if fewer:
        return fewer, fewer.fitted
    kept = placed.standing[: 1 if outcome.wiring else 0]
    refuted = tuple(t.active.label for t in placed.standing[len(kept) :])
    after = rewired(prepared, outcome) if outcome.wiring else declared
    return replace(outcome, standing=kept, refuted=refuted), after


def _fewer_borne_out(prepared: Prepared, declared: Fitted, outcome: Outcome) -> Outcome | None:
    """The outcome without the least of what was found, and the next, until nothing speaks against it; or None."""
    fitted, refuted = outcome.fitted, list(outcome.refuted)
    while len(doubted := searched(fitted)) > 1:
        losses = losses_without(fitted, doubted)
        weakest = min(losses, key=lambda k: losses[k])
        refuted.append(fitted.solution.structure.actives[weakest].label)
        fitted = dropped(fitted, weakest)
        if not spoken_against(prepared, declared, fitted):
            standing = all_standing(fitted, outcome.wiring, Pace(), outcome.turns)
            return replace(outcome, fitted=fitted, standing=standing, refuted=tuple(refuted))
    return None


def spoken_against(prepared: Prepared, declared: Fitted, after: Fitted) -> bool:
    """Whether unseen logs, or a fit's own over their whole length, are predicted worse with what was found."""
    return speak_against(prepared, declared, after) or leads_astray(prepared, declared, after)


def rewired(prepared: Prepared, outcome: Outcome) -> Fitted:
    """The declared model with nothing but the wiring put right, which was found on grounds of its own."""
    wired = [prepared.structure.with_effect(w.active) for w in (outcome.wiring,) if w]
    return fit_far_from_noise(wired[0] if wired else prepared.structure, prepared.identify)
