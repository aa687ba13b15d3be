"""What a search came to: the last fit, and what every effect in it is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identify.fitted import Fitted
from validate.look_alikes import Standing, standing
from validate.pace import Pace
from validate.pruning import searched
from validate.rounds import Turn
from validate.runners_up import runners_up
from validate.turned_round import same_wiring
from validate.wiring import Wiring


@dataclass(frozen=True)
class Outcome:
    """Where the loop ended: the last fit, its rounds, for every effect taken its gain and look-alikes, the wiring.

    ``refuted``: effects that were taken back, because unseen or whole logs are predicted worse with them;
    ``unsure``: because their own standard errors do not tell them from nothing; ``slight``: no more than any log has.
    """

    fitted: Fitted
    turns: tuple[Turn, ...]
    standing: tuple[Standing, ...]
    wiring: Wiring | None
    refuted: tuple[str, ...] = ()
    unsure: tuple[str, ...] = ()
    slight: tuple[str, ...] = ()


def all_standing(
    fitted: Fitted, wiring: Wiring | None, pace: Pace, turns: Sequence[Turn] = ()
) -> tuple[Standing, ...]:
    """What every effect of a fit is worth, and what could stand in its place; ``turns`` say what nearly did."""
    found = [Standing(wiring.active, wiring.z**2, wiring.p_value, wiring.look_alikes)] if wiring else []
    pace.expect(len(searched(fitted)))
    for k in searched(fitted):
        pace(f"rivals of {fitted.solution.structure.actives[k].label}")
        stands = standing(fitted, k, runners_up(turns, fitted, k))
        same = same_wiring(fitted.solution.structure, fitted.solution.p, k)
        found.append(replace(stands, look_alikes=(*stands.look_alikes, same)) if same else stands)
    return tuple(found)
