"""Compile a function with numba, cached on disk, keeping its type."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """``numba.njit(cache=True)``; the module that uses it is to be imported only when there is work to do."""
    return cast(Callable[P, R], numba.njit(cache=True)(function))
