"""From the outcome of the loop to the diagnosis: verdict, evidence, and what to do next."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TypeGuard

import numpy as np

from identify.effect import Active
from identify.fitted import FAR, NEAR, SLOW, AtNoise, Fitted
from identify.parameter_covariance import covariance_of
from identify.prepare import Prepared
from identify.report_fit import fitted_effect
from identify.swell import Swell
from identify.whole_windows import as_a_whole, as_quick
from preprocess.cores import side_by_side
from validate.advice import advice_for
from validate.became import Became, became
from validate.candidates import Screened
from validate.diagnosis import Candidate, Diagnosis, Round, TakenEffect, Verdict
from validate.hidden_in_others import as_they_hide
from validate.judgement import Judged, least_gain
from validate.other_logs import on_other_logs, with_other_logs
from validate.outcome import Outcome
from validate.pushes import without_pushes
from validate.report.labels import NOT_REFITTED, in_order
from validate.residual_tests import residual_tests
from validate.rounds import MOST_EFFECTS, Turn
from validate.structure_left import cross_validated, over_whole_logs, spread_of, structured_share
from validate.wander import with_wander_anew
from validate.waves import as_effect
from validate.within import BELIEVABLE

#: Above this share of a channel's spread whole logs are predicted worse than by its mean.
ASTRAY = 1.0


def diagnose(
    prepared: Prepared,
    outcome: Outcome,
    after: Fitted,
    waves: Swell | None,
    materiality: float,
    reported: Fitted | None = None,
) -> Diagnosis:
    """Say what the declared model lacks, from the identify logs; the validate logs can only downgrade.

    ``after`` is the fit in windows, ``reported`` the one whose values and predictions are reported where it is another.
    """
    seen = waves.seen if waves else None
    taken = _taken(outcome) + ((TakenEffect(as_effect(waves), seen.p_value, ()),) if waves and seen else ())
    share, plain = seen.share if seen and not after.problem.swell else {}, without_pushes(after)
    told = without_pushes(reported or after)
    left = {
        c: x * np.sqrt(max(0.0, 1.0 - share.get(c, 0.0))) for c, x in _left(prepared, plain, told).items()
    }
    left |= {c: x for c, x in _stood_in_for(outcome).items() if x > left[c]}
    verdict = _verdict(taken, left, materiality)
    rounds = tuple(_round(t, b) for t, b in zip(outcome.turns, became(outcome), strict=True))
    undetermined = _undetermined(prepared, told, left, materiality)
    advice = advice_for(verdict, taken, left, outcome, materiality, undetermined)
    return Diagnosis(verdict, taken, rounds, left, advice, materiality)


def _taken(outcome: Outcome) -> tuple[TakenEffect, ...]:
    structure, p = outcome.fitted.solution.structure, outcome.fitted.solution.p
    covariance = covariance_of(outcome.fitted)
    return tuple(
        TakenEffect(fitted_effect(structure, p, covariance, k)[0], s.p_value, s.look_alikes)
        for k, s in enumerate(outcome.standing)
    )


def _stood_in_for(outcome: Outcome) -> dict[str, float]:
    """What is left beside the first few effects where as many as ever are taken stand: nothing where there are fewer.

    Causes come one or two at a time; so many together make up for one that is none of them.
    """
    if len(outcome.standing) < MOST_EFFECTS:
        return {}
    few = [t.base for t in outcome.turns if len(t.base.solution.structure.actives) <= BELIEVABLE]
    return structured_share(few[-1]) if few else {}


def _left(prepared: Prepared, fitted: Fitted, reported: Fitted) -> dict[str, float]:
    """The largest of what is left on the logs of the fit, over them as a whole, and on those that validate."""
    own, *others = side_by_side(
        lambda share: share(),
        (
            partial(structured_share, fitted),
            partial(_left_unseen, prepared, fitted),
            partial(_left_over_whole_unseen, prepared, fitted if reported.is_off else reported),
        ),
    )
    others.append(_left_astray(prepared, fitted))
    return {c: max(own[c], *(other.get(c, 0.0) for other in others)) for c in own}


def _left_astray(prepared: Prepared, fitted: Fitted) -> dict[str, float]:
    """What a fit that is off the noise leaves of its own logs over their whole length, where that is all there is.

    Over windows first states, and coefficients with which a rich model runs away, may hide nearly all that is missing.
    """
    if not fitted.is_off:
        return {}
    whole = over_whole_logs(fitted, prepared.identify, spread_of((*prepared.identify, *prepared.validate)))
    predicts = prepared.structure.model.predicts
    return {c: x for c, x in whole.items() if x > ASTRAY and c in predicts}


def _left_unseen(prepared: Prepared, fitted: Fitted) -> dict[str, float]:
    """What is left on the logs that validate; nothing where there are none.

    Where what is far from the noise runs away on them, all that it is off.
    """
    unseen = with_other_logs(fitted, prepared.validate)
    if unseen:
        near = _as_near(fitted)
        known = as_they_hide(unseen, near) if fitted.chi2_per_dof < near.chi2_per_dof else unseen
        return structured_share(known, prepared.identify, near)
    if not prepared.validate or fitted.chi2_per_dof < FAR:
        return {}
    spread = spread_of((*prepared.identify, *prepared.validate))
    return over_whole_logs(fitted, prepared.validate, spread)


def _left_over_whole_unseen(prepared: Prepared, fitted: Fitted) -> dict[str, float]:
    """What is left on unseen logs as a whole, where the fit's own are at the noise as a whole.

    Over windows first states that are free in each may follow what is missing where a rich model's wild values do not;
    so they do what a receiver is off for longer. Where the errors of the fit's own logs are slower as a whole, gusts or
    what inputs hide add up over minutes, and unseen logs say no more. Values follow as far as the fit's own logs
    leave them open.
    """
    own = as_a_whole(fitted) if prepared.validate and not fitted.is_off else None
    own = with_wander_anew(own) if own else None
    if not _is_near(own, fitted) or not as_quick(own, fitted):
        return {}
    if _is_near(shown := on_other_logs(own, prepared.validate), fitted):
        return {}
    followed = with_other_logs(own, prepared.validate) if shown else None
    return structured_share(followed, prepared.identify, _as_near(fitted)) if followed else {}


def _is_near(found: Fitted | None, fitted: Fitted) -> TypeGuard[Fitted]:
    """Whether a fit, on other logs or as a whole, is as near the noise as another is over its windows."""
    return found is not None and found.chi2_per_dof < _as_near(fitted).chi2_per_dof


def _as_near(fitted: Fitted) -> AtNoise:
    """How near the noise other logs are at it, if the fit's own are so far from it.

    A receiver that wanders is off by more than its white noise in all of them.
    """
    own = fitted.chi2_per_dof
    return AtNoise(NEAR * own if 1.0 < own < NEAR else NEAR, max(SLOW, NEAR * fitted.slow))


def _undetermined(
    prepared: Prepared, fitted: Fitted, left: dict[str, float], materiality: float
) -> dict[str, float]:
    """Error on unseen logs, per channel that has a material one, which the coefficients' own uncertainty allows.

    Where windows are predicted and whole logs are not even nearly, that of whole logs.
    """
    if fitted.chi2_per_dof > FAR:
        return {}
    unseen = on_other_logs(fitted, prepared.validate)
    share = structured_share(unseen, prepared.identify, _as_near(fitted)) if unseen else {}
    off = {c: x for c, x in share.items() if x > materiality >= left[c]}
    if off or not prepared.validate:
        return off
    whole = on_other_logs(replace(fitted, problem=replace(fitted.problem, length=np.inf)), prepared.validate)
    if whole is None:  # they run away
        spread = spread_of((*prepared.identify, *prepared.validate))
        share = over_whole_logs(fitted, prepared.validate, spread)
        return {c: x for c, x in share.items() if x > ASTRAY and materiality >= left[c]}
    if fitted.is_off or not _is_near(as_a_whole(fitted), fitted):
        return {}
    share = structured_share(whole, prepared.identify, _as_near(fitted))
    return {c: x for c, x in share.items() if x > materiality >= left[c]}


def _verdict(taken: tuple[TakenEffect, ...], left: dict[str, float], materiality: float) -> Verdict:
    if max(left.values()) > materiality:
        return Verdict.UNEXPLAINED
    if any(t.look_alikes for t in taken):
        return Verdict.AMBIGUOUS
    return Verdict.EXPLAINED if taken else Verdict.ADEQUATE


def _round(turn: Turn, became: Became | None) -> Round:
    """One round, and what ``became`` of the effect that it took."""
    before = cross_validated(turn.base)
    refitted = {j.label: j for j in turn.judged}
    candidates = []
    for screened in turn.screened:
        judged = refitted.get(screened.active.label)
        promise = _promise(turn, screened)
        candidates.append(
            _candidate(judged, before, promise) if judged else _looked_at(screened, before, promise)
        )
    accepted = turn.taken.screened.active.effect.name if turn.taken else None
    stands, remark = (became.stands, became.remark) if became else (True, "")
    return Round(residual_tests(turn.base), tuple(in_order(candidates)), accepted, stands, remark)


def _promise(turn: Turn, screened: Screened) -> float:
    """What a first look promises in the place of a candidate's evidence."""
    k = max(1, len(screened.p) - len(turn.base.solution.p))
    return screened.gain - least_gain(k, len(turn.screened)) if np.isfinite(screened.gain) else np.nan


def _looked_at(screened: Screened, before: dict[str, float], promise: float) -> Candidate:
    """A candidate that was not refitted, or given up on the way: nothing was measured of it."""
    active, unknown = screened.active, dict.fromkeys(before, np.nan)
    remark = f"{active.label}: {NOT_REFITTED}, or not to its end: others promised more"
    return Candidate(active.effect.name, _input_of(active), np.nan, np.nan, before, unknown, remark, promise)


def _input_of(active: Active) -> str | None:
    """The input that a candidate is on; none where it is on several alike."""
    return None if active.variant.besides else active.variant.input


def _candidate(judged: Judged, before: dict[str, float], promise: float) -> Candidate:
    active = judged.screened.active
    return Candidate(
        active.effect.name, _input_of(active), judged.evidence, judged.p_value, before,
        cross_validated(judged.fitted), active.label, promise,
    )  # fmt: skip
