"""How far the search for what is missing has come: how many steps there will be is not known, only guessed."""

from __future__ import annotations

from collections.abc import Callable

#: Steps of a round that is likely to follow one in which something is taken, and of the last looks at what was taken.
ANOTHER, LAST = 10.0, 6.0


class Pace:
    """Turns the steps of a search into a share that only grows, and never reaches one before the end.

    Parameters
    ----------
    tell : callable
        Told what is being done and the share (0…1) that is done.
    """

    def __init__(self, tell: Callable[[str, float], None] = lambda _text, _share: None) -> None:
        self.tell = tell
        self.share = 0.0
        self.left = ANOTHER + LAST

    def expect(self, steps: float, later: float = 0.0) -> None:
        """So many steps now, and so many more that are likely afterwards."""
        self.left = steps + later

    def __call__(self, text: str) -> None:
        """One step is done, or begins: it takes its part of what the bar has left."""
        self.share += (1.0 - self.share) / (1.0 + max(self.left, 1.0))
        self.left = max(self.left - 1.0, 1.0)
        self.tell(text, self.share)
