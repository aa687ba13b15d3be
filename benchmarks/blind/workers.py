"""Cases on processes of their own, each with a time limit: one that hangs or dies costs itself alone."""

from __future__ import annotations

import multiprocessing
import os
import time
import traceback
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any
from unittest import mock

#: Threads of the numerical libraries in each process.
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
#: Seconds for drawing, and for the start of a process.
PATIENCE = 120.0
#: Steps on the way to an error that are told.
FRAMES = 5

Record = dict[str, Any]


@dataclass(frozen=True)
class Task:
    """A case to run: its seed and kind (None: drawn), where to keep its files, whether to ask the oracle."""

    seed: int
    kind: str | None
    keep: Path | None = None
    oracle: bool = True


@dataclass
class _Worker:
    process: BaseProcess
    line: Connection
    task: Task | None = None
    record: Record = field(default_factory=dict)
    step: int = 0
    deadline: float = 0.0


def serve(line: Connection) -> None:
    """Run cases as they come, sending each step's part of the record, then None."""
    from benchmarks.blind.case import steps_of

    while (task := line.recv()) is not None:
        try:
            for part in steps_of(task.seed, task.kind, task.keep, task.oracle):
                line.send(part)
        except Exception as error:  # noqa: BLE001 - a case that fails is a failed case, whatever the error
            line.send({"why": f"{type(error).__name__}: {error} ({way_to(error)})"})
        line.send(None)


def way_to(error: Exception) -> str:
    """Return the last steps on the way to an error."""
    frames = traceback.extract_tb(error.__traceback__)[-FRAMES:]
    return " > ".join(f"{Path(f.filename).name}:{f.lineno} {f.name}" for f in frames)


def run_cases(tasks: Sequence[Task], workers: int, limit: float) -> Iterator[Record]:
    """Yield the record of every case as it is finished; ``limit`` is the time for a diagnosis, s."""
    waiting = deque(tasks)
    busy: list[_Worker] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < workers:
                busy.append(_hand_over(_started(), waiting.popleft(), limit))
            yield from _step(busy, waiting, limit)
    finally:
        for worker in busy:
            worker.process.kill()


def one_thread() -> AbstractContextManager[Any]:
    """What is started meanwhile has one thread for each numerical library; the environment is then as it was."""
    return mock.patch.dict(os.environ, dict.fromkeys(THREADS, "1"))


def _started() -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=serve, args=(theirs,), daemon=True)
    with one_thread():
        process.start()
    theirs.close()
    return _Worker(process, ours)


def _hand_over(worker: _Worker, task: Task, limit: float) -> _Worker:
    worker.task, worker.step, worker.deadline = task, 0, time.monotonic() + PATIENCE
    worker.record = {"seed": task.seed, "asked": task.kind or "all", "limit": limit}
    worker.line.send(task)
    return worker


def _step(busy: list[_Worker], waiting: deque[Task], limit: float) -> Iterator[Record]:
    """Wait for news, and for those whose time is up."""
    patience = max(0.0, min(w.deadline for w in busy) - time.monotonic())
    ready = wait([w.line for w in busy], timeout=min(patience, 5.0) + 0.01)
    for worker in list(busy):
        finished = _news(worker, limit) if worker.line in ready else _late(worker)
        if finished:
            yield _ended(worker)
            if worker.process.is_alive() and waiting:
                _hand_over(worker, waiting.popleft(), limit)
            else:
                worker.process.kill()
                busy.remove(worker)


def _news(worker: _Worker, limit: float) -> bool:
    """Take in a part of the record; True where the case is over."""
    try:
        part = worker.line.recv()
    except (EOFError, ConnectionResetError):
        worker.record.setdefault("why", "the process died")
        worker.process.kill()
        worker.process.join()
        return True
    if part is None:
        return True
    worker.record |= part
    worker.step += 1
    worker.deadline = time.monotonic() + limit
    return False


def _late(worker: _Worker) -> bool:
    if time.monotonic() < worker.deadline:
        return False
    worker.record["why"] = (
        f"still {('drawing', 'diagnosing', 'asking the oracle')[worker.step]} when the time was up"
    )
    worker.process.kill()
    worker.process.join()
    return True


def _ended(worker: _Worker) -> Record:
    record, worker.record = worker.record, {}
    record["status"] = "ok" if "verdict" in record else "failed"
    return record
