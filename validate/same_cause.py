"""Which candidates are no other cause than an effect that was taken: the same by another name, or more of it."""

from __future__ import annotations

from identify.effect import Active
from identify.effects.sensors import MASS_CHANGE
from validate.candidates import plainly_read


def is_rival(active: Active, other: Active, among: set[str]) -> bool:
    """Whether another cause is one ``among`` some logs, which these can tell apart, and no more of the same."""
    return acting(other, among) != acting(active, among) and not more_of(active, other)


def more_of(active: Active, rival: Active) -> bool:
    """Whether a rival is the same effect on this input and others besides: more of the same is no other cause."""
    mine, theirs = active.variant.inputs, rival.variant.inputs
    return rival.effect is active.effect and len(theirs) > len(mine) and set(theirs) > set(mine)


def of_all_others(active: Active, rival: Active, among: set[str]) -> bool:
    """Whether a rival says of all other logs ``among`` some what a load says of its own: one is lighter by as much.

    Which of the two a person would say is asked last (``validate.told_logs``).
    """
    if active.effect is not MASS_CHANGE or rival.effect is not MASS_CHANGE:
        return False
    mine, theirs = (a.variant.options.get("logs") for a in (active, rival))
    return isinstance(mine, tuple) and isinstance(theirs, tuple) and among - set(mine) == among & set(theirs)


def acting(active: Active, among: set[str]) -> tuple[str, tuple[str, ...], dict[str, object]]:
    """What an effect is ``among`` some logs: in which others it acts, these cannot tell; its forms are one cause."""
    options = dict(plainly_read(active).variant.options)
    if isinstance(logs := options.get("logs"), tuple):
        options["logs"] = tuple(n for n in logs if n in among)
    return active.effect.name, active.variant.inputs, options
