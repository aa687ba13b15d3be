"""Who comes first on a busy machine: what reads the ports before all else, what decodes and identifies after it."""

from __future__ import annotations

import gc
import os
from contextlib import suppress

#: Niceness of the process that reads the ports, where the system allows it, and of the decoders.
PROMPT, PATIENT = -10, 5
#: The same of the decoders where somebody watches, and of the identification.
WATCHED, LAST = -5, 8


def set_niceness(value: int) -> None:
    """Ask to be scheduled before others, or after; a user may not be allowed the former, and that is no error."""
    with suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, 0, value)


def run_at_once() -> None:
    """Ask that this thread run as soon as there is something to do, before all that is not in real time.

    A terminal holds 44 ms of a line at 921,600 baud, and on a machine that is busy with other work a thread may wait
    longer for its turn. Every thread of the process has to ask: one that waits for its turn with the interpreter's
    lock holds up the others. What they start later does not inherit it. Where it is not allowed, that is no error.
    """
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))


def no_long_pauses() -> None:
    """Keep Python from looking through all objects for rings of them: every thread waits meanwhile, 0.1 s and more.

    What a capture makes is gone when it is written; `young_garbage` looks through the little that is new.
    """
    gc.freeze()
    gc.disable()


def young_garbage() -> None:
    """Free rings among the objects that are new; a matter of microseconds."""
    gc.collect(0)
