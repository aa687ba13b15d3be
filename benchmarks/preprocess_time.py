# ruff: noqa: ANN001, ANN202
"""Time that preprocessing takes: an hour at 50 Hz; compiled code against the same loop in Python."""

from __future__ import annotations

import time

import numpy as np

from preprocess.chains import Stream
from preprocess.driven import smooth_heading
from preprocess.kalman import Rows, smooth
from preprocess.smoother import smooth_chain, states
from preprocess.trial import Measurement
from preprocess.turning import smooth_track


def timing() -> None:
    print("\ntime: one hour at 50 Hz, position, heading, yaw rate and velocity, s")
    rng, n = np.random.default_rng(0), 180_000
    t = np.arange(n) * 0.02
    psi, r = 0.5 * np.sin(0.1 * t), 0.05 * np.cos(0.1 * t)
    rate = np.column_stack([2.0 * np.cos(psi), 2.0 * np.sin(psi)])
    position = np.cumsum(rate, axis=0) * 0.02
    everything = np.ones(n, bool)

    def streams(known: bool):
        def one(name, value, order, sigma):
            noisy = value + rng.normal(0.0, sigma, value.shape)
            return Stream(name, t, noisy, order, everything, everything, sigma if known else float("nan"))

        return (
            (one("heading", psi[:, None], 0, 0.01), one("yaw_rate", r[:, None], 1, 0.003)),
            (one("position", position, 0, 0.02), one("velocity", rate, 1, 0.05)),
        )

    steps = np.where(np.cos(0.1 * t[::5]) > 0.0, 0.3, -0.3)
    inputs = {"rudder": Measurement("rudder", t[::5], steps, 0.0, everything[::5], held=True)}
    for known in (True, True, False):
        heading, track = streams(known)
        begin, used = time.perf_counter(), time.process_time()
        all_ = ((0.0, 3600.0),)
        if known:
            a, b = smooth_chain(heading, all_, t, q=1e-4), smooth_chain(track, all_, t, q=1e-3)
        else:
            a = smooth_heading(heading, (t, np.full(n, 2.0)), all_, t, inputs, all_)
            b = smooth_track(track, a, all_, t, inputs, all_)
        states(b, a)
        wall, used = time.perf_counter() - begin, time.process_time() - used
        print(f"  levels {'given' if known else 'estimated'}: {wall:.2f} ({used:.2f} of processor)")
    compiled_against_python()


def shortest(work, times: int) -> float:
    """Least processor time of a piece of work, s."""
    used = []
    for _ in range(times):
        begin = time.process_time()
        work()
        used.append(time.process_time() - begin)
    return min(used)


def compiled_against_python() -> None:
    from preprocess import eso as module

    t = np.arange(0.0, 400.0, 0.02)
    y, out = np.sin(0.3 * t), np.empty((len(t), 3, 1))
    first = np.array([[y[0]], [0.0], [0.0]])
    module._observe(t, y[:, None], 2.0, first, out)
    fast = shortest(lambda: [module._observe(t, y[:, None], 2.0, first, out) for _ in range(20)], 5) / 20
    slow = shortest(lambda: module._observe.py_func(t, y[:, None], 2.0, first, out), 3)
    print(f"  ESO compiled against the same loop in Python: {slow / fast:.0f} ×")
    rows = Rows(t, np.zeros(len(t), np.int64), y[:, None], np.full(len(t), 1e-4), t == 0.0, np.ones(len(t)))
    smooth(rows, 1.0, np.ones(3))
    took = shortest(lambda: [smooth(rows, 1.0, np.ones(3)) for _ in range(10)], 5) / 10
    print(f"  smoother: {took / len(t) * 1e9:.0f} ns per row")
