"""Whether logs that nothing was fitted to speak against what was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identify.base_fit import FAR, Fitted
from identify.prepare import Prepared
from identify.stretch import Stretch
from validate.diagnosis import Validation
from validate.other_logs import on_other_logs
from validate.scores import predictions, validation

#: Unseen logs count as predicted worse from this ratio of the squared errors on.
WORSE = 1.1


def speak_against(prepared: Prepared, declared: Fitted, after: Fitted) -> bool:
    """Whether unseen logs are predicted worse with the effects than without.

    Free-running errors judge first; near the noise of the sensors the raw measurements have the last word: errors
    against a smoothed measurement are in part the smoother's, and the longer a prediction runs free, the more.
    """
    unseen = prepared.validate
    scores = [
        validation(prepared.structure, unseen, predictions(f.solution.structure, f.solution.p, unseen))
        for f in (declared, after)
    ]
    if not worse(*scores):
        return False
    return after.chi2_per_dof > FAR or not _measured_better(unseen, declared, after)


def worse(before: Validation, after: Validation) -> bool:
    """Whether free-running errors on unseen logs have grown (each channel by its own spread)."""
    pairs = [(before.channels[c].nrmse, after.channels[c].nrmse) for c in before.channels]
    known = [(b, a) for b, a in pairs if a is not None and b is not None]
    return sum(a * a for _, a in known) > WORSE * sum(b * b for b, _ in known)


def _measured_better(unseen: Sequence[Stretch], declared: Fitted, after: Fitted) -> bool:
    """Whether the raw measurements of unseen logs are nearer to what the effects say, over windows of one length."""
    alike = replace(declared, problem=replace(declared.problem, length=after.problem.length))
    one, other = on_other_logs(alike, unseen), on_other_logs(after, unseen)
    return other is not None and (one is None or other.chi2_per_dof < one.chi2_per_dof)
