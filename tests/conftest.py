"""Fixtures that several files of tests share."""

from __future__ import annotations

import contextlib
import os

import pytest
from hypothesis import settings

# One thread, as a run keeps it (``seatrial.blas``), for what the tests call below it too: set before numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# How long an example takes is the machine's affair: on a busy one any may wait for its turn.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

pytest.register_assert_rewrite(
    "can_samples", "capture_samples", "doc_pages", "mavlink_peers", "reader_checks"
)


def pytest_configure(config):
    """Old compiled code must not answer for new sources."""
    if not hasattr(config, "workerinput"):
        from seatrial.compiled_code import forget_stale_code

        forget_stale_code()


#: Groups that are begun first: of documents, whose commands compile nearly everything, beside files that mostly wait
#: for devices, and so do not compile the same at the same time.
FIRST = ("test_docs", "test_capture", "test_capture_faults", "test_capture_can")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """A file's tests go to one worker, where they name no group of their own; those with slow ones first.

    A worker that begins one of those last would keep the others waiting.
    """
    place = {name: k for k, name in enumerate(FIRST)}
    slow = {item.path for item in items if item.get_closest_marker("slow")}

    def turn(item):
        return place.get(group_of(item), len(FIRST)), item.path not in slow

    for item in items:
        item.add_marker(pytest.mark.xdist_group(group_of(item)))
    items.sort(key=turn)


def group_of(item):
    """The tests that go to the same worker."""
    own = item.get_closest_marker("xdist_group")
    return own.args[0] if own else item.path.stem


@pytest.fixture
def device(tmp_path):
    """Make serial devices in the test's folder, by name."""
    from capture_samples import Device

    made: list[Device] = []

    def make(name: str) -> Device:
        made.append(Device(tmp_path / name))
        return made[-1]

    yield make
    for one in made:
        with contextlib.suppress(OSError):
            os.close(one.master)


@pytest.fixture(scope="session")
def example():
    """Results without the pipeline: four logs of a toy boat, one effect taken."""
    from benchmarks.results_example import example_results

    return example_results()


@pytest.fixture(scope="session")
def example_folder(example, tmp_path_factory):
    """The results folder of the example."""
    from validate.report_files import write_results

    path = tmp_path_factory.mktemp("example") / "results"
    write_results(example, path)
    return path


@pytest.fixture(scope="session")
def example_page(example_folder):
    """report.html of the example."""
    return (example_folder / "report.html").read_text(encoding="utf-8")
