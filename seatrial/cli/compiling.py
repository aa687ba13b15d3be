"""A word when code is compiled, which a new installation does once."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

SAID = "Compiling for this machine, which is done once: about a minute in all."


@contextmanager
def told_of_compiling(say: Callable[[str], None]) -> Iterator[Callable[[], None]]:
    """Say so at the first function that is compiled, not only loaded.

    What this gives is to be called now and then: it listens from when compiled code is loaded, and loads none itself.
    """
    heard: list[Any] = []

    def listen() -> None:
        event = sys.modules.get("numba.core.event")
        if event is not None and not heard:
            heard.append((event, _listener(event, say)))
            event.register("numba:compile", heard[0][1])

    try:
        yield listen
    finally:
        for event, listener in heard:
            event.unregister("numba:compile", listener)


def _listener(event: Any, say: Callable[[str], None]) -> Any:
    """A listener that speaks once; in forked processes, which work beside this one, it does not."""
    here = os.getpid()

    class Once(event.Listener):  # type: ignore[misc]
        said = False

        def on_start(self, _: object) -> None:
            if not self.said and os.getpid() == here:
                self.said = True
                say(SAID)

        def on_end(self, _: object) -> None:
            pass

    return Once()
