"""Whether logs speak against what was found: those that nothing was fitted to, and whole ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.fitted import FAR, NEAR, Fitted
from identify.free_running import FOLLOWS
from identify.prepare import Prepared
from identify.stretch import Stretch
from validate.other_logs import on_other_logs, with_other_logs
from validate.scores import pooled, predictions

#: Unseen logs count as predicted worse from this ratio of the squared errors on; where a fit stays far from the noise
#: they must be predicted better.
WORSE, BETTER = 1.1, 0.9
#: ... and so much worse from this ratio on that no smoother's own errors can be why.
RUN_AWAY = 4.0


def speak_against(prepared: Prepared, declared: Fitted, after: Fitted) -> bool:
    """Whether unseen logs are predicted worse with the effects than without; far from the noise, whether no better.

    What is far has something else the matter with it, which effects that are none of its causes can be bent to.
    Free-running errors judge first; near the noise of the sensors the raw measurements have the last word: errors
    against a smoothed measurement are in part the smoother's, and the longer a prediction runs free, the more. Off the
    noise they have it where they are clearly nearer over whole logs too: a compass that is late, or a receiver that
    wanders, may have led the smoother astray.
    """
    unseen = prepared.validate
    before, after_ = (_misfit(prepared, f, unseen) for f in (declared, after))
    if after.chi2_per_dof > FAR:
        return after_ > BETTER * before
    if after_ <= WORSE * before:
        return False
    nearer = _times_nearer(unseen, declared, after, after.problem.length)
    if after.chi2_per_dof < NEAR and (nearer > RUN_AWAY or _left_open(after, unseen)):
        return False
    if nearer > RUN_AWAY and _times_nearer(unseen, declared, after, np.inf) > RUN_AWAY:
        return False
    return after_ > max(FOLLOWS, RUN_AWAY * before) or nearer <= 1.0


def leads_astray(prepared: Prepared, declared: Fitted, after: Fitted) -> bool:
    """Whether a fit's own logs are predicted far worse with the effects than without, over their whole length.

    Over windows a rich model may follow with causes that are none, by coefficients with which it runs away.
    """
    before, after_ = (_misfit(prepared, f, prepared.identify) for f in (declared, after))
    return after_ > max(FOLLOWS, RUN_AWAY * before)


def _left_open(after: Fitted, unseen: Sequence[Stretch]) -> bool:
    """Whether unseen logs come near the noise with parameters that the fit's own logs leave as open as that.

    A rich model that has seen zigzags alone may miss a circle however right its effects are.
    """
    followed = with_other_logs(after, unseen)
    return followed is not None and followed.chi2_per_dof < FAR


def _spread(stretches: Sequence[Stretch]) -> dict[str, float]:
    """Variance of u, v, r over all logs: one that holds its course and speed has hardly any of its own."""
    return dict(zip("uvr", np.vstack([s.states[:, 3:6] for s in stretches]).var(axis=0) + 1e-24, strict=True))


def _misfit(prepared: Prepared, fitted: Fitted, stretches: Sequence[Stretch]) -> float:
    """Squared free-running errors on some logs, channels added, each in units of its spread over all of them."""
    spread = _spread((*prepared.identify, *prepared.validate))
    runs = predictions(fitted.solution.structure, fitted.solution.p, stretches)
    found = pooled(prepared.structure, stretches, runs)
    return sum(s.mse / spread[c] for c, s in found.items() if s.mse is not None)


def _times_nearer(unseen: Sequence[Stretch], declared: Fitted, after: Fitted, length: float) -> float:
    """How many times nearer unseen logs' raw measurements are to what the effects say, in windows of a length, s."""
    alike = (replace(f, problem=replace(f.problem, length=length)) for f in (declared, after))
    one, other = (on_other_logs(f, unseen) for f in alike)
    if other is None:
        return 0.0
    return np.inf if one is None else one.chi2_per_dof / other.chi2_per_dof
