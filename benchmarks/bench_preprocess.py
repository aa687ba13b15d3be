# ruff: noqa: E402, ANN001, ANN201, ANN202
"""Preprocessing, measured: accuracy beside other methods, noise levels, outliers, clocks, and time.

``python benchmarks/bench_preprocess.py [--quick] [--seeds N]`` prints one table after another. The truth is
simulated; each method gets the same samples. "given" is the same smoother with the true noise levels and the true
outliers set aside; "given, plain" a Kalman/RTS smoother in earth axes with the same.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks import preprocess_real

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "tests")]

from preprocess_samples import Imperfect, Sampled, sampled, truth_of

from preprocess import frames
from preprocess.chains import Stream
from preprocess.driven import smooth_heading
from preprocess.ekf import Tuning, filter_motion
from preprocess.eso import Observer, observe, tune
from preprocess.kalman import Rows, smooth
from preprocess.outliers import robust_three_sigma, sliding_three_sigma
from preprocess.run_of_log import LoggedRun
from preprocess.smoother import smooth_chain, states
from preprocess.trial import Measurement, Trial
from preprocess.trials import make_trials
from preprocess.turning import smooth_track

SAILED = (
    ("usv", "zigzag"),
    ("usv", "random"),
    ("catamaran", "random"),
    ("tanker", "zigzag"),
    ("patrol", "random"),
    ("raft", "random"),
)
CHANNELS = ("u", "v", "r", "du", "dv", "dr")
CASES = (
    ("usv", "zigzag", (5, 10, 20), 0.1, 0.0),
    ("usv", "random", (1, 5, 5), 0.2, 0.0),
    ("catamaran", "random", (5, 10, 10), 0.4, 0.0),
    ("tanker", "zigzag", (5, 10, 20), 0.1, 0.05),
    ("patrol", "random", (10, 20, 20), 0.2, 0.05),
    ("raft", "random", (5, 10, 10), 0.0, 0.05),
)


def make(case, seed: int) -> Sampled:
    vessel, manoeuvre, rates, lost, outliers = case
    sensors = {
        "position": Imperfect(rates[0], 0.02, 0.2, lost, outliers),
        "heading": Imperfect(rates[1], 0.01, 0.2, lost, outliers),
        "yaw_rate": Imperfect(rates[2], 0.003, 0.2, lost, outliers),
    }
    return sampled(truth_of(vessel, manoeuvre, 120.0, seed), seed, **sensors)


def trial_of(made: Sampled) -> Trial:
    return make_trials([LoggedRun("a", made.log, "identify")], made.vessel, made.inputs, made.sensors)[0]


def samples(trial: Trial, name: str):
    """The good samples of a sensor, so that every method has the same."""
    m = trial.measurements[name]
    return m.t[m.good], m.value[m.good]


def given(trial: Trial, made: Sampled, plain: bool = False):
    """The same smoother, given the true noise levels and which samples are outliers."""
    truth = {"position": 0.02, "heading": 0.01, "yaw_rate": 0.003}

    def stream(name: str, order: int) -> Stream:
        m = trial.measurements[name]
        value = m.value if m.value.ndim == 2 else m.value[:, None]
        good = ~made.bad[name]
        return Stream(name, m.t, value, order, good, good, truth[name])

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


def eso(trial: Trial):
    """The observer of Xie et al. on positions and heading, bandwidth tuned."""
    t, p = samples(trial, "position")
    h_t, h = samples(trial, "heading")
    z, y = observe(tune(t, p[:, 0]), t, p), observe(tune(h_t, h), h_t, h)
    psi, r, dr = (np.interp(t, h_t, y[:, k]) for k in range(3))
    return from_earth(t, z[:, 0], z[:, 1], z[:, 2], psi, r, dr)


def ekf(trial: Trial):
    """Forwards only, with process intensities fixed by hand."""
    t, x = filter_motion(
        samples(trial, "position"),
        samples(trial, "heading"),
        samples(trial, "yaw_rate"),
        Tuning(0.02, 0.05, 0.05, 0.02, 0.01, 0.003),
    )
    return {"t": t} | dict(zip(CHANNELS, x[:, 3:].T, strict=True))


def errors(out, truth) -> np.ndarray:
    t = np.asarray(out["t"])
    inside = (t > 5.0) & (t < truth.t[-1] - 2.0)
    rows = []
    for name in CHANNELS:
        of = getattr(truth, name) if len(name) == 1 else np.gradient(getattr(truth, name[1:]), truth.t)
        e = np.asarray(out[name])[inside] - np.interp(t[inside], truth.t, of)
        rows.append(float(np.sqrt(np.nanmean(e**2))))
    return np.array(rows)


def accuracy(seeds: int) -> None:
    methods = {
        "ESO": eso,
        "EKF": ekf,
        "Savitzky-Golay": savitzky_golay,
        "Gauss process": gaussian_process,
        "differences": differences,
    }
    print("RMSE of body velocities and accelerations (m/s, rad/s, m/s², rad/s²), median over seeds")
    for case in CASES:
        table: dict[str, list[np.ndarray]] = {}
        for seed in range(seeds):
            made = make(case, seed)
            trial = trial_of(made)
            table.setdefault("default", []).append(errors(trial.states, made.truth))
            table.setdefault("given", []).append(errors(given(trial, made), made.truth))
            table.setdefault("given, plain", []).append(errors(given(trial, made, plain=True), made.truth))
            for name, method in methods.items():
                table.setdefault(name, []).append(errors(method(trial), made.truth))
        print(f"\n{case[0]} {case[1]}, {case[2]} Hz, lost {case[3]:.0%}, outliers {case[4]:.0%}")
        best = np.median(table["given"], axis=0)
        for name, rows in table.items():
            row = np.median(rows, axis=0)
            print(f"  {name:15s}" + "".join(f"{c:>4s} {x:8.5f}" for c, x in zip(CHANNELS, row, strict=True)))
            if name == "default":
                ratio = row / best
                print(
                    "   ÷ given       "
                    + "".join(f"{c:>4s} {x:8.3f}" for c, x in zip(CHANNELS, ratio, strict=True))
                )


def outliers_and_levels(seeds: int) -> None:
    print("\nnoise levels found ÷ true; recall and false alarms (default; plain 3σ; sliding 3σ alone)")
    for case in CASES:
        case = (*case[:4], 0.05)
        ratio: dict[str, list[float]] = {}
        count = np.zeros((3, 4))
        for seed in range(seeds):
            made = make(case, seed)
            trial = trial_of(made)
            for name, sigma in (("position", 0.02), ("heading", 0.01), ("yaw_rate", 0.003)):
                m, bad = trial.measurements[name], made.bad[name]
                ratio.setdefault(name, []).append(m.sigma / sigma)
                columns = np.reshape(m.value, (len(m.t), -1)).T
                plain = np.any([robust_three_sigma(c) for c in columns], axis=0)
                for k, mark in enumerate((~m.good, plain, sliding_three_sigma(m.t, m.value, 4.0))):
                    count[k] += [mark[bad].sum(), bad.sum(), mark[~bad].sum(), (~bad).sum()]
        levels = ", ".join(f"{k} {np.mean(v):.3f}" for k, v in ratio.items())
        shown = "; ".join(f"{c[0] / c[1]:.3f} {c[2] / c[3]:.4f}" for c in count)
        print(f"  {case[0]:10s} {case[1]:8s} {levels} | {shown}")


def clocks(seeds: int) -> None:
    print(
        "\nclock offsets at 5 Hz position: bias ± scatter of those found (true −0.2, 0.1, 0.3 s in turn), s;"
    )
    print("their mean standard error; share of 95 % intervals that hold the truth")
    for vessel, manoeuvre in SAILED:
        shown = []
        for stream in ("yaw_rate", "position", "inputs"):
            found = []
            for seed in range(seeds):
                delay = (-0.2, 0.1, 0.3)[seed % 3]
                step = clock_step(delayed(vessel, manoeuvre, seed, stream, delay))
                key = "the inputs" if stream == "inputs" else stream
                if key in step:
                    found.append((step[key][1] - delay, step[key][2]))
            e, se = np.array(found).reshape(-1, 2).T
            if len(e):
                held = np.mean(np.abs(e) < 1.96 * se)
                shown.append(f"{stream} {e.mean():+.3f} ± {e.std():.3f} ({se.mean():.3f}) {held:.2f}")
            else:
                shown.append(f"{stream} not told")
        print(f"  {vessel:10s}{manoeuvre:8s}" + "; ".join(shown))


def delayed(vessel: str, manoeuvre: str, seed: int, stream: str, delay: float) -> Trial:
    """A trial in which the stamps of one stream are late."""
    rates = {"position": (5, 0.02), "heading": (10, 0.01), "yaw_rate": (20, 0.003)}
    sensors = {k: Imperfect(*v, delay=delay * (k == stream)) for k, v in rates.items()}
    made = sampled(truth_of(vessel, manoeuvre, 150.0, seed), seed, **sensors)
    if stream == "inputs":
        index = made.log.tables["act"].index
        late = np.maximum(index.to_numpy() + round(delay * 1e9), 0)
        made.log.tables["act"].index = type(index)(late, name=index.name)
    return trial_of(made)


def clock_step(trial: Trial):
    (step,) = [s for s in trial.history if s.action == "clock_offsets"]
    return step.arguments


def levels_by_rate(seeds: int) -> None:
    print("\nnoise levels found ÷ true, mean (scatter) over vessels and seeds, by rate of the position")
    print("(heading twice, gyro four times as often, to 20 Hz; velocity as often as the position); 10 % lost")
    for rate in (1, 2, 5, 10, 20):
        ratio: dict[str, list[float]] = {}
        for vessel, manoeuvre in SAILED:
            for seed in range(seeds):
                sigma = {"position": 0.02, "heading": 0.01, "yaw_rate": 0.003, "velocity": 0.05}
                rates = dict(zip(sigma, (rate, min(2 * rate, 20), min(4 * rate, 20), rate), strict=True))
                sensors = {k: Imperfect(rates[k], s, 0.2, 0.1) for k, s in sigma.items()}
                found = trial_of(sampled(truth_of(vessel, manoeuvre, 90.0, seed), seed, **sensors))
                for k, s in sigma.items():
                    ratio.setdefault(k, []).append(found.measurements[k].sigma / s)
        shown = ", ".join(f"{k} {np.mean(v):.3f} ({np.std(v):.3f})" for k, v in ratio.items())
        print(f"  {rate:3d} Hz: {shown}")


def wanders(seeds: int) -> None:
    print(
        "\nwander of the position, 0.03 L rms over 90 s, beside 0.02 m white: white ÷ true, wander per root of"
    )
    print("time ÷ true (0: not told from the motion), error of u and v ÷ stated (root mean square)")
    for vessel, manoeuvre in SAILED:
        for doppler in (False, True):
            rows = [wandering(vessel, manoeuvre, seed, doppler) for seed in range(seeds)]
            white, walk, pull = np.mean(rows, axis=0)
            print(
                f"  {vessel:10s}{manoeuvre:8s}{'with velocity' if doppler else 'position only':15s}"
                f"white {white:.3f}  wander {walk:.2f}  pull {pull:.2f}"
            )


def wandering(vessel: str, manoeuvre: str, seed: int, doppler: bool) -> tuple[float, float, float]:
    sensors = {"position": Imperfect(5, 0.02), "heading": Imperfect(10, 0.01)}
    sensors |= {"yaw_rate": Imperfect(10, 0.003)} | ({"velocity": Imperfect(5, 0.05)} if doppler else {})
    made = sampled(truth_of(vessel, manoeuvre, 150.0, seed), seed, **sensors)
    level, t = 0.03 * made.vessel.length, made.log.tables["position"].index.to_numpy() * 1e-9
    made.log.tables["position"] += gauss_markov(t, level, 90.0, np.random.default_rng(seed + 99))
    trial = trial_of(made)
    m, s = trial.measurements["position"], trial.states
    walk = m.wander / np.sqrt(m.correlation_time) if m.correlation_time else 0.0
    keep = (s["t"] > 5.0) & (s["t"] < 145.0)
    z = [
        (s[k] - np.interp(s["t"], made.truth.t, getattr(made.truth, k)))[keep] / s[f"sigma_{k}"][keep]
        for k in "uv"
    ]
    return m.sigma / 0.02, walk / (level / np.sqrt(90.0)), float(np.sqrt(np.mean(np.square(z))))


def gauss_markov(t, level: float, time: float, rng) -> np.ndarray:
    """First-order Gauss-Markov noise (n, 2) at any times."""
    keep = np.exp(-np.diff(t, prepend=-np.inf) / time)
    kicks = level * np.sqrt(1.0 - keep**2)[:, None] * rng.standard_normal((len(t), 2))
    for i in range(1, len(t)):
        kicks[i] += keep[i] * kicks[i - 1]
    return kicks


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


def compiled_against_python() -> None:
    t = np.arange(0.0, 400.0, 0.02)
    y = np.sin(0.3 * t)
    observe(Observer(2.0), t, y)
    begin = time.perf_counter()
    observe(Observer(2.0), t, y)
    fast = time.perf_counter() - begin
    from preprocess import eso as module

    out = np.empty((len(t), 3, 1))
    begin = time.perf_counter()
    module._observe.py_func(t, y[:, None], 2.0, np.array([[y[0]], [0.0], [0.0]]), out)
    print(f"  ESO compiled against the same loop in Python: {(time.perf_counter() - begin) / fast:.0f} ×")
    rows = Rows(t, np.zeros(len(t), np.int64), y[:, None], np.full(len(t), 1e-4), t == 0.0, np.ones(len(t)))
    smooth(rows, 1.0, np.ones(3))
    begin = time.perf_counter()
    smooth(rows, 1.0, np.ones(3))
    print(f"  smoother: {(time.perf_counter() - begin) / len(t) * 1e9:.0f} ns per row")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    seeds = 1 if options.quick else options.seeds
    timing()
    accuracy(seeds)
    outliers_and_levels(seeds)
    levels_by_rate(max(seeds // 3, 1))
    wanders(max(seeds // 2, 1))
    clocks(2 * seeds)
    preprocess_real.measured()


if __name__ == "__main__":
    main()
