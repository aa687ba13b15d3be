"""``auto`` once more: a model that seems to be needed may only make up for an effect.

A compass that is off bends a vessel's motion as asymmetric terms do, and a rich model has those. Whether a simpler one
with a single effect says as much is asked of each that predicts, or follows its own windows, nearly as well: by the
likelihood over the same windows, every coefficient counted (Schwarz 1978), the chosen model with its own best effect
too. Where no model comes near the noise, every one is asked: one that does with an effect needs no richer one. Terms
that other models have are no effects here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from identify.base_fit import tried
from identify.choose_model import Choice
from identify.fitted import FAR, Fitted
from identify.noise import dispersed_cost, recalibrated
from preprocess.cores import side_by_side
from validate.candidates import candidates, screen
from validate.refits import refit, under

#: A simpler model is asked where its error is no more than so many times the best one's, or where its cost is; at most
#: so many of them.
NEARLY, AS_NEAR, MOST_RIVALS = 2.5, 1.5, 4
#: So many effects are refitted with each model; and so many far from the noise, where a first order says less, each of
#: another name, with models of no more terms than this.
FINALISTS, FAR_FINALISTS, FEW_TERMS = 2, 6, 30


@dataclass(frozen=True)
class Simpler:
    """A simpler model, and the effect with which it says as much as the chosen one: its name, and where it is.

    ``alone``: no model comes near the noise without.
    """

    name: str
    effect: str
    label: str
    alone: bool = False

    def in_words(self, chosen: str) -> str:
        """What the report says of it."""
        if self.alone:
            return (
                f"No model alone comes near the noise of the sensors, even over short windows. "
                f"With the effect {self.label}, '{self.name}' does: it was taken."
            )
        return (
            f"With the effect {self.label}, '{self.name}' says as much as '{chosen}' with fewer coefficients: "
            f"it was taken in its place."
        )


def simpler_with_an_effect(choice: Choice) -> Simpler | None:
    """The simpler model that is likelier with one effect than the chosen one with or without; None without one."""
    names = _few_terms(choice) if choice.far else _rivals(choice)
    if not names:
        return None
    names = names if choice.far else [choice.name, *names]
    ways = {name: _ways(choice.fits[name], choice.far) for name in names}
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
    if with_it == 0 or (best == choice.name and not choice.far):
        return None
    active = ways[best][with_it].solution.structure.actives[-1]
    return Simpler(best, active.effect.name, active.label, choice.far)


def _rivals(choice: Choice) -> list[str]:
    """Models with fewer terms than the chosen one that predict, or follow their windows, nearly as well; best first.

    What an effect bends a model to may predict nothing.
    """
    if choice.name not in choice.fits:
        return []
    chosen = next(c for c in choice.table if c.name == choice.name)
    enough = AS_NEAR * choice.fits[choice.name].chi2_per_dof
    near = [
        c.name
        for c in choice.table
        if c.terms < chosen.terms and c.name in choice.fits
        if c.error <= NEARLY * chosen.error or choice.fits[c.name].chi2_per_dof <= enough
    ]
    return near[:MOST_RIVALS]


def _few_terms(choice: Choice) -> list[str]:
    """Models with few terms."""
    return [c.name for c in choice.table if c.name in choice.fits and c.terms <= FEW_TERMS]


def _ways(fitted: Fitted, far: bool) -> list[Fitted]:
    """A model as it is, and with each of the effects that promise most."""
    every = candidates(fitted.solution.structure)
    effects = [a for a in every if a.effect.parameters or a.effect.place != "hull"]
    most = screen(fitted, effects)
    if far:
        most = list({s.active.effect.name: s for s in reversed(most)}.values())[::-1]
    some = most[: FAR_FINALISTS if far else FINALISTS]
    fits = side_by_side(lambda s: tried(partial(refit, fitted, s)), some, shared=[s.active for s in some])
    return [fitted, *(f for f in fits if f)]
