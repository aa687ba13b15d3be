"""Independent work on several cores: forked processes, which have all data there is and send back what they find."""

from __future__ import annotations

import io
import multiprocessing
import pickle
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import Synchronized
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")
Found = TypeVar("Found")

#: Another process is waited for so many times as long as the work here took, and so many s: it may hang.
PATIENCE, LEAST_PATIENCE = 10.0, 60.0
#: How many cores the work under way may take.
_CORES: ContextVar[int] = ContextVar("cores", default=1)


@contextmanager
def on_cores(count: int) -> Iterator[None]:
    """Within, ``side_by_side`` takes so many cores."""
    token = _CORES.set(count)
    try:
        yield
    finally:
        _CORES.reset(token)


def granted() -> int:
    """How many cores the work under way may take: one within ``side_by_side``, since the others are taken."""
    return _CORES.get()


def side_by_side(
    function: Callable[[Item], Found],
    items: Sequence[Item],
    tell: Callable[[Item], object] = lambda _item: None,
    shared: Sequence[object] = (),
) -> list[Found]:
    """What ``function`` makes of every item, in their order, on the cores that ``on_cores`` grants.

    Parameters
    ----------
    function : callable
        Pure; whatever it refers to is there in the other processes as it is here. Its results must be picklable.
    items : sequence
    tell : callable
        Told each item that is taken here, as it begins: other processes say nothing.
    shared : sequence
        What results may refer to and need not be sent, since it is here.

    Raises
    ------
    Exception
        What ``function`` raised. What another process could not do, for whatever reason, is done again here.
    """
    others = min(_CORES.get(), len(items)) - 1
    if others < 1 or not _may_fork():
        return [_told(function, item, tell) for item in items]
    context = multiprocessing.get_context("fork")
    todo = _Todo(partial(_alone, function), items, context.Value("i", 0), _Shared(tuple(shared)))
    with ExitStack() as lines:
        answers = [lines.enter_context(_other(context, todo)) for _ in range(others)]
        began = time.monotonic()
        found = dict(todo.taken(tell))
        for answer in answers:
            found |= answer(PATIENCE * (time.monotonic() - began) + LEAST_PATIENCE)
    return [found[k] if k in found else _told(function, item, tell) for k, item in enumerate(items)]


@dataclass(frozen=True)
class _Shared:
    """Objects that forked processes have in common: sent by their number."""

    objects: tuple[object, ...]

    def dumped(self, value: object) -> bytes:
        """A value as bytes."""
        number = {id(x): k for k, x in enumerate(self.objects)}
        out = io.BytesIO()
        pickler = pickle.Pickler(out, protocol=pickle.HIGHEST_PROTOCOL)
        pickler.persistent_id = lambda x: number.get(id(x))  # type: ignore[method-assign]
        pickler.dump(value)
        return out.getvalue()

    def loaded(self, data: bytes) -> Any:
        """The value of such bytes."""
        unpickler = pickle.Unpickler(io.BytesIO(data))
        unpickler.persistent_load = lambda k: self.objects[k]  # type: ignore[method-assign]
        return unpickler.load()


@dataclass(frozen=True)
class _Todo(Generic[Item, Found]):
    """Items that several processes take from in turn."""

    function: Callable[[Item], Found]
    items: Sequence[Item]
    next: Synchronized[int]
    shared: _Shared

    def taken(self, tell: Callable[[Item], object]) -> Iterator[tuple[int, Found]]:
        """Number and result of the items that are done here, as long as there are any."""
        while (k := self._one()) < len(self.items):
            yield k, _told(self.function, self.items[k], tell)

    def _one(self) -> int:
        with self.next.get_lock():
            k = self.next.value
            self.next.value = k + 1
        return k

    def send(self, line: Connection) -> None:
        """All that is done here, to who waits at the other end; what fails is done again there."""
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        done: dict[int, Found] = {}
        with suppress(Exception):
            done.update(self.taken(lambda _item: None))
        with line, suppress(Exception):
            line.send_bytes(self.shared.dumped(done))


@contextmanager
def _other(
    context: multiprocessing.context.ForkContext, todo: _Todo[Item, Found]
) -> Iterator[Callable[[float], dict[int, Found]]]:
    """Another process at work: what is called for its answer, and how long to wait. It ends with the block."""
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=todo.send, args=(there,), daemon=True)
    process.start()
    there.close()
    try:
        with here:
            yield partial(_answer, here, todo.shared)
    finally:
        process.terminate()
        process.join()


def _answer(line: Connection, shared: _Shared, wait: float) -> dict[int, Found]:
    """What another process has done; nothing where it died, or says nothing for so many seconds."""
    with suppress(EOFError, OSError):
        if not line.poll(wait):
            return {}
        found: dict[int, Found] = shared.loaded(line.recv_bytes())
        return found
    return {}


def _told(function: Callable[[Item], Found], item: Item, tell: Callable[[Item], object]) -> Found:
    tell(item)
    return function(item)


def _alone(function: Callable[[Item], Found], item: Item) -> Found:
    """What is done on one core, the others being taken."""
    with on_cores(1):
        return function(item)


def _may_fork() -> bool:
    """Whether processes can be forked safely from here: not by a forked one, nor where a system's libraries mind."""
    return sys.platform == "linux" and not multiprocessing.current_process().daemon
