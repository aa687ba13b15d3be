"""``auto`` once more: a model that seems to be needed may only make up for an effect.

A compass that is off bends a vessel's motion as asymmetric terms do, and a rich model has those. Whether a simpler one
with a single effect says as much is asked of each that predicts nearly as well: by the likelihood over the same
windows, every coefficient counted (Schwarz 1978), the chosen model with its own best effect too. Terms that other
models have are no effects here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from identify.base_fit import tried
from identify.choose_model import Choice
from identify.fitted import FAR, Fitted
from identify.noise import dispersed_cost, recalibrated
from validate.candidates import candidates, screen
from validate.refits import refit, under

#: A simpler model is asked where its error is no more than so many times the best one's; so many of them.
NEARLY, MOST_RIVALS = 2.5, 2
#: So many effects are refitted with each model.
FINALISTS = 2


@dataclass(frozen=True)
class Simpler:
    """A simpler model, and the effect with which it says as much as the chosen one: its name, and where it is."""

    name: str
    effect: str
    label: str

    def in_words(self, chosen: str) -> str:
        """What the report says of it."""
        return (
            f"With the effect {self.label}, '{self.name}' says as much as '{chosen}' with fewer coefficients: "
            f"it was taken in its place."
        )


def simpler_with_an_effect(choice: Choice) -> Simpler | None:
    """The simpler model that is likelier with one effect than the chosen one with or without; None without one."""
    rivals = _rivals(choice)
    if not rivals:
        return None
    ways = {name: _ways(choice.fits[name]) for name in (choice.name, *rivals)}
    nearest = min((f for fits in ways.values() for f in fits), key=lambda f: f.chi2_per_dof)
    if not nearest.chi2_per_dof < FAR:
        return None
    problem = recalibrated(nearest.problem, nearest.solution)

    def score(fitted: Fitted) -> float:
        there = under(problem, fitted)
        counted = float(np.log(problem.rows)) * len(fitted.solution.p)
        return dispersed_cost(problem, there.solution) + counted

    scores = {name: [score(f) for f in fits] for name, fits in ways.items()}
    least = {name: min(s) for name, s in scores.items()}
    best = min(least, key=lambda name: least[name])
    with_it = int(np.argmin(scores[best]))
    if best == choice.name or with_it == 0:
        return None
    active = ways[best][with_it].solution.structure.actives[-1]
    return Simpler(best, active.effect.name, active.label)


def _rivals(choice: Choice) -> list[str]:
    """Models with fewer terms than the chosen one that predict nearly as well, the best first."""
    if choice.name not in choice.fits:
        return []
    chosen = next(c for c in choice.table if c.name == choice.name)
    near = [c for c in choice.table if c.error <= NEARLY * chosen.error and c.terms < chosen.terms]
    return [c.name for c in near if c.name in choice.fits][:MOST_RIVALS]


def _ways(fitted: Fitted) -> list[Fitted]:
    """A model as it is, and with each of the effects that promise most."""
    every = candidates(fitted.solution.structure)
    effects = [a for a in every if a.effect.parameters or a.effect.place != "hull"]
    most = screen(fitted, effects)[:FINALISTS]
    return [fitted, *(f for s in most if (f := tried(partial(refit, fitted, s))))]
