"""The search for what a fit lacks, in the waves that it shows; and without them where they do not stand at its end."""

from __future__ import annotations

from dataclasses import replace

from identify.fitted import Fitted
from identify.prepare import Prepared
from validate.loop import search
from validate.outcome import Outcome
from validate.pace import Pace
from validate.refits import under
from validate.swell import in_swell, needs_waves, seen_waves, with_waves_known, without_waves
from validate.within import Within


def searched(prepared: Prepared, declared: Fitted, pace: Pace) -> tuple[Prepared, Fitted, Outcome]:
    """What a windowed fit lacks; with what was prepared, and the fit, as the search began with them.

    What is missing may swing as waves do, and waves that are known leave little of it to be seen. Where they do not
    show beside what was found, the search is made without them too, and the likelier of the two is taken.
    """
    in_waves, known = in_known_waves(prepared, declared)
    outcome = search(in_waves, known, pace)
    if known.problem.swell is None or waves_stand(outcome.fitted):
        return in_waves, known, outcome
    pace("without the waves that did not show any more")
    other = search(prepared, declared, pace, Within(waves=False))
    there = under(other.fitted.problem, without_waves(outcome.fitted), 20)
    if other.fitted.solution.total < there.solution.total:
        return prepared, declared, other
    return in_waves, known, outcome


def in_known_waves(prepared: Prepared, declared: Fitted) -> tuple[Prepared, Fitted]:
    """What was prepared, and the fit, with the waves known that this shows, if any."""
    known = with_waves_known(declared)
    return replace(prepared, identify=in_swell(prepared.identify, known.problem.swell)), known


def waves_stand(fitted: Fitted) -> bool:
    """Whether a fit that knows of waves still shows them, and leaves the noise without."""
    return seen_waves(fitted) is not None and needs_waves(fitted)
