"""Ctrl-C that no library keeps to itself."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def remembered_interrupt() -> Iterator[Callable[[], None]]:
    """While this lasts Ctrl-C is a ``KeyboardInterrupt`` as ever, and what is yielded raises it once more.

    Where libraries are loaded or call back, some handle every exception in silence: nothing would come of it. Nor is
    anything said of one that comes where none can be raised (as a process forks): it is raised again.
    """
    before = signal.getsignal(signal.SIGINT)
    heard: list[int] = []

    def hear(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        raise KeyboardInterrupt

    def again() -> None:
        if heard:
            raise KeyboardInterrupt

    if before is not signal.default_int_handler or threading.current_thread() is not threading.main_thread():
        yield again
        return
    said = sys.unraisablehook

    def unraisable(what: sys.UnraisableHookArgs) -> None:
        if not issubclass(what.exc_type, KeyboardInterrupt):
            said(what)

    signal.signal(signal.SIGINT, hear)
    sys.unraisablehook = unraisable
    try:
        yield again
    finally:
        sys.unraisablehook = said
        signal.signal(signal.SIGINT, before)
