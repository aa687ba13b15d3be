"""What was made of an object, so that it is not made again."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any, Generic, TypeVar

from preprocess.cores import side_by_side

Of = TypeVar("Of")
Made = TypeVar("Made")
Key = TypeVar("Key", bound=Hashable)


class Remembered(Generic[Of]):
    """``remembered(make, *key)`` is ``make(of, *key)``, made once."""

    def __init__(self, of: Of) -> None:
        self._of = of
        self._made: dict[Hashable, Any] = {}

    def __call__(self, make: Callable[..., Made], *key: Hashable) -> Made:
        """What ``make`` gives, or gave."""
        if (make, *key) not in self._made:
            self._made[make, *key] = make(self._of, *key)
        found: Made = self._made[make, *key]
        return found

    def each(
        self, make: Callable[[Of, Key], Made], keys: Sequence[Key], shared: Sequence[object]
    ) -> list[Made]:
        """What ``make`` gives for every key: what it did not give before side by side, with what is ``shared``."""
        todo = [k for k in keys if (make, k) not in self._made]
        for key, made in zip(
            todo, side_by_side(lambda k: make(self._of, k), todo, shared=shared), strict=True
        ):
            self._made[make, key] = made
        return [self._made[make, k] for k in keys]
