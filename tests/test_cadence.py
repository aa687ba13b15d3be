"""Times from the order of records alone: a device of its own rate beside a receiver that states its time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marine_samples import nmea, pvt

from ingest.marine.cadence import by_rate
from ingest.marine.epochs import UNKNOWN, spread
from ingest.marine.stream import decode_stream

SECOND = 1_000_000_000


def logged(fixes, free, late=0.0):
    """Times and half widths that ``spread`` finds for records at the times ``free``, s, between those of ``fixes``."""
    t = np.concatenate([fixes + late, free])
    order = np.argsort(t, kind="stable")
    states = (np.arange(len(t)) < len(fixes))[order]
    stated = np.where(states, np.rint(np.concatenate([fixes, free])[order] * SECOND), UNKNOWN).astype(
        np.int64
    )
    ns, unsure = spread(stated, np.where(states, 0, 1), states)
    return ns[~states] / SECOND, unsure[~states]


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from([0.1, 0.2, 0.5, 1.0]), st.floats(0.04, 1.2), st.floats(0.0, 1.0), st.floats(-2e-4, 2e-4)
)
def test_a_regular_rate_is_found_within_its_bounds(epoch, interval, phase, drift):
    fixes = 1000.0 + epoch * np.arange(int(120 / epoch))
    free = 1002.0 + interval * (phase + (1.0 + drift) * np.arange(int(110 / interval)))
    found, unsure = logged(fixes, free)
    first = np.searchsorted(fixes, free, side="right") - 1
    assert (found >= fixes[first] - 1e-6).all()
    assert (found <= fixes[first + 1] + 1e-6).all()
    np.testing.assert_allclose(np.diff(found), interval, rtol=0, atol=1e-2 * (interval + epoch))
    assert np.abs(np.mean(found - free)) <= 1.8 * unsure.max() + 1e-3 * (epoch + interval)
    assert unsure.max() <= 0.5 * epoch


def test_a_rate_that_slides_through_the_epochs_is_known_far_better_than_they_last():
    free = 2.0 + 0.1003 * np.arange(5000)
    found, unsure = logged(np.arange(600.0), free)
    assert np.abs(found - free).max() < 0.002
    assert unsure.max() < 0.002


def test_a_slow_drift_and_a_pause_are_followed():
    step = 0.1 * (1.0 + 5e-4 * np.sin(np.arange(20_000) / 3000.0))
    free = 3.0 + np.cumsum(step) + np.where(np.arange(20_000) > 9000, 27.345, 0.0)
    found, _ = logged(0.25 * np.arange(9000), free)
    assert np.median(np.abs(found - free)) < 0.02
    assert np.abs(found - free).max() < 0.1


def test_a_lost_record_does_not_shift_the_others():
    free = np.delete(0.4 + np.arange(600.0), [100, 150, 200, 250])
    found, unsure = logged(np.arange(602.0), free)
    np.testing.assert_allclose(found - free, 0.1, atol=1e-3)
    assert 0.4 < unsure.min() <= unsure.max() <= 0.5


def test_without_a_rate_each_is_midway():
    rng = np.random.default_rng(3)
    free = np.sort(rng.uniform(1.0, 299.0, 300))
    found, unsure = logged(np.arange(300.0), free)
    assert np.abs(np.mean(found - free)) < 0.05
    assert (np.floor(found) == np.floor(free)).all()
    assert unsure.max() == pytest.approx(0.5)


def test_a_receiver_that_sends_late_makes_the_others_early_by_that():
    """What the order cannot tell, as the documentation of ``spread`` says."""
    free = 2.0 + 0.1003 * np.arange(3000)
    found, _ = logged(np.arange(400.0), free, late=0.08)
    np.testing.assert_allclose(found - free, -0.08, atol=0.003)


def test_a_long_log_without_a_rate_keeps_its_bounds():
    rng = np.random.default_rng(1)
    free = np.sort(rng.uniform(0.0, 1e4, 200_000))
    lower = np.floor(free)
    found, unsure = by_rate(lower, lower + 1.0, free)
    said = ~np.isnan(found)
    assert (np.abs(found - lower - 0.5)[said] <= 0.5 + 1e-6).all()
    assert unsure.max() <= 0.5 + 1e-6


def test_an_attitude_sensor_without_stamps_runs_by_itself_beside_a_receiver():
    fixes = 43200.0 + 0.125 * np.arange(400)
    turns = 43200.04 + 0.1003 * np.arange(480)
    attitude = "VNYMR,{:+08.3f},+000.5,-000.8,+0.2,+0.0,+0.4,+0.1,+0.1,-9.8,+0.001,-0.002,+0.021"
    sent = [(t, pvt(t)) for t in fixes] + [(t, nmea(attitude.format(k / 10.0))) for k, t in enumerate(turns)]
    tables = decode_stream(b"".join(record for _, record in sorted(sent))).tables
    fixed, told = (tables[name].index.to_numpy() / SECOND for name in ("NAV-PVT", "VNYMR"))
    np.testing.assert_allclose(told - fixed[0], turns - fixes[0], rtol=0.0, atol=0.02)
    assert np.median(told - fixed[0] - (turns - fixes[0])) == pytest.approx(0.0, abs=0.005)


def stream(*devices):
    """Stated times, kinds and owners of records of devices, (times, kind, own, stated) each, in the order of time."""
    t = np.concatenate([d[0] for d in devices])
    order = np.argsort(t, kind="stable")
    kind, own, states = (
        np.concatenate([np.full(len(d[0]), d[k]) for d in devices])[order] for k in (1, 2, 3)
    )
    stated = np.where(states.astype(bool), np.rint(t[order] * SECOND), UNKNOWN).astype(np.int64)
    return t[order], stated, kind.astype(np.int64), own.astype(bool)


@pytest.mark.parametrize("phase", [0.25, 0.5, 0.93])
def test_a_compass_under_the_receiver_s_name_that_sends_long_after_its_burst_has_its_own_time(phase):
    """Each heading had the time of the fix before it: early by up to a second, otherwise in every log."""
    fixes = 1000.1 + np.arange(300.0)
    gyro, rudder = 1000.0 + 0.1 * np.arange(3000), 1000.03 + 0.2 * np.arange(1500)
    t, stated, kind, own = stream(
        (fixes, 0, 1, 1), (gyro, 1, 0, 0), (rudder, 2, 0, 0), (fixes + phase, 3, 1, 0)
    )
    ns, unsure = spread(stated, kind, own)
    late = (ns / SECOND - t)[kind == 3][:-1]
    assert np.abs(late).max() < 0.11
    assert unsure[kind == 3].max() < 0.11


@pytest.mark.parametrize("sentences", [1, 5, 9])
def test_what_a_receiver_sends_in_one_burst_is_of_one_moment_however_slow_the_line(sentences):
    """At 4800 baud a burst lasts most of a second, and what other devices send goes on within it."""
    fixes = 1000.0 + np.arange(60.0)
    burst = [(fixes + 0.1 * k, k, 1, k == 0) for k in range(1 + sentences)]
    _, stated, kind, own = stream(*burst, (1000.05 + 0.1 * np.arange(600), 20, 0, 0))
    ns, _ = spread(stated, kind, own)
    for k in range(1, 1 + sentences):
        np.testing.assert_allclose(ns[kind == k] / SECOND, fixes, atol=1e-6)
