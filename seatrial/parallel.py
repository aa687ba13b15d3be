"""Many independent tasks at once: in turn, on this machine's cores, or on a cluster."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from types import TracebackType
from typing import Any, Generic, TypeVar, cast

from ingest.errors import DataError, UsageError

T = TypeVar("T")
R = TypeVar("R")
Numbered = tuple[int, T]


class WorkerLost(DataError):
    """A worker process died on a task twice: most often for want of memory."""

    def __init__(self, task: int) -> None:
        self.task = task
        super().__init__(f"task {task + 1}: its worker process died twice, most often for want of memory.")


@dataclass(frozen=True)
class Failure:
    """An exception as data, so that it survives the way between processes whatever its class takes."""

    kind: type[Exception]
    arguments: tuple[object, ...]
    facts: dict[str, object]

    def error(self) -> Exception:
        """The exception."""
        error = self.kind.__new__(self.kind)
        error.args = self.arguments
        error.__dict__.update(self.facts)
        return error


def failure_of(error: Exception) -> Failure:
    """An exception as data."""
    return Failure(type(error), error.args, dict(error.__dict__))


@dataclass(frozen=True)
class Done(Generic[R]):
    """A finished task: its number, and its value or why there is none."""

    index: int
    value: R | None = None
    failure: Failure | None = None

    def result(self) -> R:
        """The value; raises what the task raised."""
        if self.failure is not None:
            raise self.failure.error()
        return cast(R, self.value)


class Attempt:
    """A ``with`` block whose exception becomes data."""

    failure: Failure | None = None

    def __enter__(self) -> Attempt:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool:
        if isinstance(error, Exception):
            self.failure = failure_of(error)
        return self.failure is not None


def attempt(function: Callable[[T], R], index: int, task: T) -> Done[R]:
    """One task done here."""
    value: R | None = None
    with Attempt() as tried:
        value = function(task)
    return Done(index, value, tried.failure)


def map_tasks(
    function: Callable[[T], R], tasks: Sequence[T], workers: int = 1, scheduler: str | None = None
) -> Iterator[Done[R]]:
    """Do independent tasks, and give each as soon as it is finished.

    Parameters
    ----------
    function : callable
        Pure; of a module, so that another process can import it.
    tasks : sequence
        Small, picklable data.
    workers : int
        Processes on this machine; with one (the default) everything is done here, in turn.
    scheduler : str, optional
        Address of a Dask scheduler (``tcp://…``); needs ``seatrial[cluster]``.

    Yields
    ------
    Done
        In the order of finishing. An exception costs its own task; so does a worker that dies, at the
        second try.

    Raises
    ------
    UsageError
        ``scheduler`` is given and Dask is not installed.
    """
    if scheduler is not None:
        return on_cluster(function, tasks, scheduler)
    if min(workers, len(tasks)) > 1:
        return in_processes(function, tasks, min(workers, len(tasks)))
    return (attempt(function, index, task) for index, task in enumerate(tasks))


def all_results(
    function: Callable[[T], R], tasks: Sequence[T], workers: int = 1, scheduler: str | None = None
) -> list[R]:
    """Results in the order of the tasks; raises what the first task that failed raised."""
    done = sorted(map_tasks(function, tasks, workers, scheduler), key=lambda d: d.index)
    return [d.result() for d in done]


def in_processes(function: Callable[[T], R], tasks: Sequence[T], workers: int) -> Iterator[Done[R]]:
    """Tasks on a pool; when a worker dies, those that were under way are tried once more, each alone."""
    waiting = deque(enumerate(tasks))
    while waiting:
        suspects: list[Numbered[T]] = []
        yield from one_pool(function, waiting, workers, suspects)
        for suspect in suspects:
            lost: list[Numbered[T]] = []
            yield from one_pool(function, deque([suspect]), 1, lost)
            yield from (
                Done(i, failure=Failure(WorkerLost, WorkerLost(i).args, {"task": i})) for i, _ in lost
            )


def one_pool(
    function: Callable[[T], R], waiting: deque[Numbered[T]], workers: int, suspects: list[Numbered[T]]
) -> Iterator[Done[R]]:
    """Take tasks until none waits or the pool breaks; then ``suspects`` has those that were under way."""
    quiet = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with ProcessPoolExecutor(workers, mp_context=start_method(), initializer=quiet) as pool:
        under_way: dict[Future[Done[R]], Numbered[T]] = {}
        while (waiting and not suspects) or under_way:
            while waiting and not suspects and len(under_way) < workers:
                index, task = waiting.popleft()
                under_way[pool.submit(attempt, function, index, task)] = (index, task)
            for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                numbered = under_way.pop(future)
                if isinstance(future.exception(), BrokenProcessPool):
                    suspects.append(numbered)
                else:
                    yield future.result()


def start_method() -> multiprocessing.context.BaseContext:
    """Fresh processes: a fork would copy the locks of threads that it does not copy."""
    return multiprocessing.get_context("spawn" if sys.platform == "win32" else "forkserver")


def on_cluster(function: Callable[[T], R], tasks: Sequence[T], scheduler: str) -> Iterator[Done[R]]:
    """Tasks on a Dask cluster, which sees to lost workers itself."""
    try:
        import distributed
    except ImportError as error:
        message = "--scheduler needs Dask, which is not installed: pip install 'seatrial[cluster]'."
        raise UsageError(message) from error
    with distributed.Client(scheduler) as client:
        submit = partial(client.submit, attempt, function, pure=False)
        futures: dict[Any, int] = {submit(index, task): index for index, task in enumerate(tasks)}
        for future in distributed.as_completed(futures):
            lost = future.exception()
            index = futures[future]
            yield Done(index, failure=failure_of(WorkerLost(index))) if lost else future.result()
