"""Independent work on several cores gives what it gives on one, whatever becomes of the other processes."""

from __future__ import annotations

import os
import signal
import time

import pytest

from preprocess import cores
from preprocess.cores import on_cores, side_by_side


def test_the_results_are_those_of_one_core_in_the_order_of_the_items():
    known = {"scale": lambda x: 3 * x}  # not picklable: a forked process has it all the same
    told = []
    with on_cores(2):
        assert side_by_side(lambda x: known["scale"](x), range(40), told.append) == [3 * x for x in range(40)]
    assert set(told) <= set(range(40))


def test_other_processes_take_their_part(tmp_path):
    """However busy the machine is: this process waits until another has taken something."""
    here, taken = os.getpid(), tmp_path / "taken"

    def done(x):
        if os.getpid() != here:
            taken.touch()
        until = time.monotonic() + 20.0
        while not taken.exists() and time.monotonic() < until:
            time.sleep(0.01)
        return x, os.getpid()

    with on_cores(3):
        found = side_by_side(done, range(6))
    assert [x for x, _ in found] == list(range(6))
    assert {process for _, process in found} != {here}


def test_without_cores_granted_nothing_is_forked():
    assert {side_by_side(lambda _: os.getpid(), range(4))[k] for k in range(4)} == {os.getpid()}


def test_what_a_process_that_died_had_taken_is_done_again():
    here = os.getpid()

    def done(x):
        if os.getpid() != here:
            os.kill(os.getpid(), signal.SIGKILL)
        return x

    with on_cores(2):
        assert side_by_side(done, range(8)) == list(range(8))


def test_an_error_is_raised_as_on_one_core():
    def fails(x):
        if x == 5:
            raise ValueError("the fifth")
        return x

    with on_cores(2), pytest.raises(ValueError, match="the fifth"):
        side_by_side(fails, range(8))


def test_results_that_cannot_be_sent_are_made_here():
    with on_cores(2):
        found = side_by_side(lambda x: lambda: x, range(6))
    assert [f() for f in found] == list(range(6))


def test_work_within_such_work_forks_no_further():
    def inner(x):
        return side_by_side(lambda y: (x, y, os.getpid()), range(3))

    with on_cores(2):
        found = side_by_side(inner, range(4))
    assert [[pair[:2] for pair in each] for each in found] == [[(x, y) for y in range(3)] for x in range(4)]


def test_a_process_that_hangs_is_not_waited_for_without_end(monkeypatch):
    here = os.getpid()
    monkeypatch.setattr(cores, "PATIENCE", 0.0)
    monkeypatch.setattr(cores, "LEAST_PATIENCE", 0.2)

    def done(x):
        if os.getpid() != here:
            time.sleep(60.0)
        return x

    with on_cores(2):
        assert side_by_side(done, range(6)) == list(range(6))
