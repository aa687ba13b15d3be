"""Many tasks at once: each result once, an error or a lost worker costs its own task."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from ingest.errors import MissingSignal, UsageError
from seatrial.blas import one_blas_thread
from seatrial.parallel import WorkerLost, all_results, map_tasks


def square(x: int) -> int:
    if x == 3:
        raise MissingSignal(Path("a.csv"), "inputs.n.signal", "s", ["n"])
    return x * x


def square_or_die(x: int) -> int:
    if x == 2:
        os._exit(1)
    return square(x)


@pytest.mark.parametrize("workers", [1, 2])
def test_each_result_once_and_an_error_costs_its_own_task(workers):
    done = {d.index: d for d in map_tasks(square, [0, 1, 2, 3, 4], workers)}
    assert sorted(done) == [0, 1, 2, 3, 4]
    with pytest.raises(MissingSignal, match="'s'") as caught:
        done[3].result()
    assert caught.value.path == Path("a.csv")
    assert [done[i].result() for i in (0, 1, 2, 4)] == [0, 1, 4, 16]


@pytest.mark.parametrize("workers", [1, 2])
def test_results_are_in_order_and_the_first_error_is_raised(workers):
    assert all_results(square, [4, 1, 2], workers) == [16, 1, 4]
    with pytest.raises(MissingSignal):
        all_results(square, [1, 3], workers)


def test_a_lost_worker_costs_its_task_and_no_other():
    done = {d.index: d for d in map_tasks(square_or_die, [0, 1, 2, 4, 5, 6], 2)}
    with pytest.raises(WorkerLost, match="task 3"):
        done[2].result()
    assert [done[i].result() for i in (0, 1, 3, 4, 5)] == [0, 1, 16, 25, 36]


def test_a_scheduler_without_dask_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(UsageError, match=r"seatrial\[cluster\]"):
        list(map_tasks(square, [1], scheduler="tcp://127.0.0.1:1"))


def test_a_run_takes_one_thread_of_the_matrix_library_and_gives_the_others_back():
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_info, threadpool_limits

    def threads():
        return {x["num_threads"] for x in threadpool_info() if x["user_api"] == "blas"}

    with threadpool_limits(2, "blas"):
        before = threads()
        with one_blas_thread():
            assert threads() == {1}
        assert threads() == before
