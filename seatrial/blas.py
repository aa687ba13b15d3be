"""The matrix library's own threads, which cost more than they save on matrices of some hundred rows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within, products and solutions of matrices take one thread, as before afterwards; also a decorator.

    OpenBLAS wakes a thread per core for every matrix that is not tiny, and these wait by spinning: a fit of thirty
    parameters then takes up to four times the processor's time.
    """
    import scipy.linalg  # noqa: F401  only a library that is loaded can be told: scipy brings one of its own
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    with threadpool_limits(limits=1, user_api="blas"):
        yield
