"""What ``auto`` did, in a sentence for the report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.choose_model import RICH, Considered


def choice_in_words(name: str, table: Sequence[Considered], logs: int) -> str:
    """Which model was chosen, by what, over which others, and how little that may mean.

    Parameters
    ----------
    name, table
        As ``choose_model`` returns them.
    logs : int
        Logs to identify on.
    """
    taken = next(c for c in table if c.name == name)
    fitted = [c for c in table if np.isfinite(c.error)]
    others = ", ".join(f"{c.name} {_error(c)}" for c in fitted if c.name != name)
    parts = _parts(table, logs)
    text = f"The model '{name}' was chosen: left out in turn, {parts} are predicted with an error of {_error(taken)}"
    text += f" of the motion's spread (the others: {others})." if others else " of the motion's spread."
    if taken is not table[0]:
        text += f" '{table[0].name}' is no more than 2 % better and has more coefficients."
    if logs == 1:
        text += " What only another manoeuvre would show could not be asked of one log: give it more."
    if taken.error >= 1.0:
        text += " No model predicts better than the mean: the choice means little."
    return text


def _parts(table: Sequence[Considered], logs: int) -> str:
    """What was left out."""
    whole = any(c.name in RICH and np.isfinite(c.error) for c in table)
    if logs == 1:
        return "parts of the log"
    return "whole logs" if whole else "the logs' windows"


def _error(one: Considered) -> str:
    return f"{one.error:.2g}" if one.error < 10 else "> 10"
