# ruff: noqa: ANN001, ANN201, ANN202
"""Other ways to velocities and accelerations, on the same samples: each returns them at times of its own."""

from __future__ import annotations

import numpy as np

from benchmarks.preprocess_cases import NOISE, samples
from preprocess import frames
from preprocess.chains import Stream
from preprocess.run_of_log import LoggedRun
from preprocess.smoother import smooth_chain, states
from preprocess.trial import Trial
from preprocess.trials import make_trials
from preprocess.turning import smooth_track
from preprocess.vessel import Smoothing


def given(trial: Trial, made, plain: bool = False):
    """The same smoother, given the true noise levels and which samples are outliers."""

    def stream(name: str, order: int) -> Stream:
        m = trial.measurements[name]
        value = m.value if m.value.ndim == 2 else m.value[:, None]
        good = ~made.bad[name]
        return Stream(name, m.t, value, order, good, good, NOISE[name])

    wanted = trial.states["t"].to_numpy()
    heading = smooth_chain(
        (stream("heading", 0), stream("yaw_rate", 1)), trial.segments, wanted, trial.inputs
    )
    position = (stream("position", 0),)
    if plain:
        return states(smooth_chain(position, trial.segments, wanted, trial.inputs), heading)
    track = smooth_track(position, heading, trial.segments, wanted, trial.inputs, trial.segments)
    return states(track, heading)


def from_earth(t, position, rate, acceleration, psi, r, dr):
    body, force = frames.earth_to_body(rate, psi), frames.earth_to_body(acceleration, psi)
    u, v = body.T
    return {"t": t, "u": u, "v": v, "r": r, "du": force[:, 0] + r * v, "dv": force[:, 1] - r * u, "dr": dr}


def differences(trial: Trial):
    """Plain central differences, twice."""
    t, p = samples(trial, "position")
    h_t, h = samples(trial, "heading")
    rate, r = np.gradient(p, t, axis=0), np.gradient(h, h_t)
    values = rate, np.gradient(rate, t, axis=0), np.interp(t, h_t, h), np.interp(t, h_t, r)
    return from_earth(t, p, *values, np.interp(t, h_t, np.gradient(r, h_t)))


def savitzky_golay(trial: Trial):
    """Cubic over 1.5 s after resampling to the mean rate, as it is usually done."""
    from scipy.signal import savgol_filter

    def smoothed(t, x):
        step = np.ptp(t) / (len(t) - 1)
        grid = np.arange(t[0], t[-1], step)
        even = np.column_stack([np.interp(grid, t, c) for c in np.reshape(x, (len(t), -1)).T])
        width = max(5, 2 * round(0.75 / step) + 1)
        return grid, [savgol_filter(even, width, 3, deriv=k, delta=step, axis=0) for k in range(3)]

    t, p = smoothed(*samples(trial, "position"))
    h_t, h = smoothed(*samples(trial, "heading"))
    psi, r, dr = (np.interp(t, h_t, x[:, 0]) for x in h)
    return from_earth(t, p[0], p[1], p[2], psi, r, dr)


def gaussian_process(trial: Trial):
    """Squared-exponential kernel, length by marginal likelihood on 400 samples, in windows of 200 samples."""
    from scipy.linalg import cho_factor, cho_solve

    def regress(t, x, sigma):
        x = np.reshape(x, (len(t), -1))
        outs = [np.zeros_like(x) for _ in range(3)]

        def solve(i, j, ell):
            tt, y = t[i:j], x[i:j] - x[i:j].mean(axis=0)
            d = tt[:, None] - tt[None, :]
            s2 = max(float(y.var()), 1e-12) * 4.0
            k = s2 * np.exp(-0.5 * (d / ell) ** 2)
            c = cho_factor(k + sigma**2 * np.eye(len(tt)))
            alpha = cho_solve(c, y)
            return k, d, alpha, y, 2.0 * np.log(np.diag(c[0])).sum()

        n = min(200, len(t))
        grid = np.geomspace(0.3, 10.0, 12)
        score = [solve(0, n, ell) for ell in grid]
        ell = grid[int(np.argmin([(y * a).sum() + y.shape[1] * ld for _k, _d, a, y, ld in score]))]
        for i in range(0, len(t), n // 2):
            j = min(i + n, len(t))
            if j - i < 10:
                break
            k, d, alpha, _y, _ = solve(i, j, ell)
            own = slice(i if i == 0 else i + n // 4, j)
            part = slice(own.start - i, None)
            outs[0][own] = (k @ alpha + x[i:j].mean(axis=0))[part]
            outs[1][own] = ((-d / ell**2 * k) @ alpha)[part]
            outs[2][own] = (((d / ell**2) ** 2 - 1 / ell**2) * k @ alpha)[part]
        return outs

    t, p = samples(trial, "position")
    h_t, h = samples(trial, "heading")
    a, b = regress(t, p, 0.02), regress(h_t, h, 0.01)
    psi, r, dr = (np.interp(t, h_t, x[:, 0]) for x in b)
    return from_earth(t, a[0], a[1], a[2], psi, r, dr)


def by_observer(smoother: str):
    """An observer of the program as a campaign chooses it, tuned by itself."""

    def made(made_of):
        run = LoggedRun("a", made_of.log, "identify")
        chosen = Smoothing(smoother)
        (trial,) = make_trials([run], made_of.vessel, made_of.inputs, made_of.sensors, smoothing=chosen)
        return trial.states

    return made


#: Methods that take the log itself.
OBSERVERS = {"ESO": by_observer("eso"), "EKF": by_observer("ekf")}
METHODS = {
    "Savitzky-Golay": savitzky_golay,
    "Gauss process": gaussian_process,
    "differences": differences,
}
