"""Compiled work on several threads: they wait for it, since making them anew costs more than many a window."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")

_NAME = "seatrial-compiled"


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix=_NAME)


if hasattr(os, "register_at_fork"):  # a child does not have its parent's threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


def abreast(function: Callable[[Item], Found], items: Iterable[Item], workers: int) -> list[Found]:
    """What ``function`` makes of every item, in their order; one after another where this is such work itself."""
    if workers < 2 or threading.current_thread().name.startswith(_NAME):
        return [function(item) for item in items]
    return list(_pool(workers).map(function, items))
