"""Spectra of the prediction errors over windows, from the raw measurements at their own times.

Each window's errors are tapered by sines (Riedel and Sidorenko 1995, IEEE Trans. Signal Process. 43, 188-195) and
transformed at the samples' own times; the streams are turned to body axes and merged to the errors of u, v, r by their
precision; through the model's own linear response these become the accelerations that would cause them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from identify import kernel
from identify.drive import Drive, drive
from identify.first_states import begun
from identify.fitted import Fitted
from identify.predict import accelerations_at, run, shown
from identify.stretch import KIND, Samples, Stretch
from identify.structure import Structure
from identify.true_motion import through_water
from identify.windows import Problem, Window, moments
from validate.tables import held_at

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]

#: Sine tapers per window.
TAPERS = 2
#: The lowest frequency, cycles in a window.
LOWEST_CYCLES = 1.5
#: No vessel follows anything faster than this, rad/s.
FASTEST = 25.0
#: Spectra go up to this share of the Nyquist frequency; a stream of its own says nothing beyond a little more.
UP_TO, AT_MOST = 0.8, 0.9
#: A spectrum steps where a stream ends beside which the other's noise is so many times as large.
STEP = 2.0
#: So many times its noise has a stream of what it says nothing of.
ENDLESS = 1e12


@dataclass(frozen=True)
class Spectra:
    """Fourier amplitudes, one row per window and taper; squared, they are densities per Hz, two-sided.

    ``omega`` (f,); ``rate`` (n, f, 3) derivatives of the errors of u, v, r, ``force`` (n, f, 3) the accelerations that
    would cause them, ``errors`` (n, f, 3) of the velocities as the smoother shows
    them, ``done`` (n, f, m) what the vessel did; ``mean_square`` (3,) of the velocities' errors;
    ``order`` (3,) the power of frequency from the density of what the sensors measure to that of the accelerations;
    ``turning`` (n,) how fast the vessel turns over a quarter of the window, at most, rad/s; ``slope`` (3, 3)
    derivatives of the accelerations u̇, v̇, ṙ by u, v, r, 1/s; ``log`` (n / tapers,) of each window, by number.
    """

    omega: FloatArray
    rate: ComplexArray
    force: ComplexArray
    errors: ComplexArray
    done: ComplexArray
    mean_square: FloatArray
    order: FloatArray
    turning: FloatArray
    slope: FloatArray
    log: IntArray

    @property
    def spacing(self) -> float:
        """Interval of the frequencies, rad/s: half of one cycle per window."""
        return float(self.omega[1] - self.omega[0])


def spectra_of(fitted: Fitted) -> Spectra | None:
    """Fourier amplitudes of all windows of nearly the usual length; None where they cannot show anything."""
    problem, structure = fitted.problem, fitted.solution.structure
    lengths = np.array([problem.stretches[w.stretch].h * w.steps for w in problem.windows])
    usual = float(np.median(lengths)) if len(lengths) else 0.0
    used = [k for k, length in enumerate(lengths) if length > 0.75 * usual]
    fastest = min(FASTEST, UP_TO * np.pi / _interval(fitted)) if used else 0.0
    omega = np.arange(LOWEST_CYCLES, fastest * usual / (2.0 * np.pi), 0.5) * 2.0 * np.pi / max(usual, 1e-9)
    if len(used) < 2 or len(omega) < 12:
        return None
    p, first = fitted.solution.p, fitted.solution.first
    seen = moments(problem, structure, p, first)
    residuals = seen.raw if problem.swell or problem.drifts else seen.residuals
    drives = [drive(structure, p, s) for s in problem.stretches]
    begin, _ = begun(problem, structure, drives, first)
    looks = [
        _look(fitted, k, begin[k], residuals[k], drives[problem.windows[k].stretch], omega) for k in used
    ]
    rate, force, errors, done, error, turning, slope = (
        np.concatenate(part) for part in zip(*looks, strict=True)
    )
    moved = np.ptp(np.abs(done), axis=(0, 1)) > 0
    return Spectra(
        omega, rate, force, errors, done[..., moved], np.mean(error**2, axis=0), _order(structure), turning,
        slope.mean(axis=0), np.array([problem.windows[k].stretch for k in used]),
    )  # fmt: skip


def _order(structure: Structure) -> FloatArray:
    streams = structure.setting.streams
    along, turn = 2.0 if "velocity" in streams else 4.0, 2.0 if "yaw_rate" in streams else 4.0
    return np.array([along, along, turn])


def _interval(fitted: Fitted) -> float:
    """Longest of the intervals between samples of what tells the velocities and of what tells the yaw rate, s.

    Of two streams that tell one thing the faster counts, unless its noise is so much the larger where the other ends
    that a spectrum of both would have a step there, beside which no line is smooth.
    """
    samples = [s.samples for s in fitted.problem.stretches]
    longest = 0.0
    for kinds in ((kernel.POSITION, kernel.VELOCITY), (kernel.HEADING, kernel.YAW_RATE)):
        told = sorted(x for k, power in zip(kinds, (2.0, 0.0), strict=True) for x in _told(samples, k, power))
        if len(told) == 2:
            (fast, *_), (slow, *_) = told
            one, other = (noise * (np.pi / slow) ** power for _, power, noise in told)
            longest = max(longest, fast if one < STEP * other else slow)
        else:
            longest = max([longest, *(interval for interval, *_ in told)])
    return longest


def _told(samples: Sequence[Samples], kind: int, power: float) -> list[tuple[float, float, float]]:
    """Usual interval of one stream, s, the power of frequency that its noise in a rate grows with, and its density."""
    mine = [(s.t[s.kind == kind], s.sigma[s.kind == kind]) for s in samples if (s.kind == kind).sum() > 2]
    if not mine:
        return []
    interval = min(float(np.median(np.diff(t))) for t, _ in mine)
    sigma = float(np.median(np.concatenate([x for _, x in mine])))
    return [(interval, power, sigma**2 * interval)]


def _look(
    fitted: Fitted, number: int, first: FloatArray, residual: FloatArray, d: Drive, omega: FloatArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray, FloatArray, FloatArray, FloatArray]:
    """One window from ``first`` (8,): amplitudes as in ``Spectra``, the velocities' errors (n, 3), turning, slopes."""
    problem, structure = fitted.problem, fitted.solution.structure
    w = problem.windows[number]
    stretch = problem.stretches[w.stretch]
    part = slice(w.first, w.first + w.steps + 1)
    states = run(structure, d, stretch, first, w.first, w.steps)
    error = shown(structure, d, stretch, states)[:, 3:6] - stretch.states[part, 3:6]
    speed = through_water(stretch.states[part], d.current)[:, 3:6].mean(axis=0)
    velocity = _velocities(_streams(problem, w, residual, omega), speed, structure.vessel.antenna, omega)
    rate = 1j * omega[:, None] * velocity
    jacobian = _jacobian(structure, d, states, w)
    force = rate - velocity @ jacobian.T
    t = stretch.grid[part]
    turning = np.full(TAPERS, max(abs(float(r.mean())) for r in np.array_split(stretch.states[part, 5], 4)))
    errors, done = (
        _transform(t, x, t[0], t[-1], omega) for x in (error, _deeds(structure, stretch, states, t))
    )
    return rate, force, errors, done, error, turning, jacobian[None]


def _streams(
    problem: Problem, w: Window, residual: FloatArray, omega: FloatArray
) -> dict[str, tuple[ComplexArray, FloatArray]]:
    """Amplitudes (tapers, f, rows) of each stream's errors, vectors in body axes, and its noise (f,) per Hz.

    Of frequencies that its samples are too far apart for it says nothing: none, in endless noise.
    """
    stretch = problem.stretches[w.stretch]
    samples, (begin, end) = stretch.samples, stretch.grid[[w.first, w.first + w.steps]]
    t, kind, sigma = samples.t[w.samples], samples.kind[w.samples], samples.sigma[w.samples]
    psi = np.interp(t, stretch.grid, stretch.states[:, 2])
    error = residual * (sigma * problem.inflation[kind])[:, None]
    out = {}
    for name in (n for n, k in KIND.items() if np.sum(kind == k) > 20):
        mine = kind == KIND[name]
        usual = float(np.median(sigma[mine]))
        mine &= sigma < 100.0 * usual
        e = error[mine, :1]
        if KIND[name] in (kernel.POSITION, kernel.VELOCITY):
            turn = (error[mine, 0] + 1j * error[mine, 1]) * np.exp(-1j * psi[mine])
            e = np.column_stack([turn.real, turn.imag])
        told = omega < AT_MOST * np.pi / float(np.median(np.diff(t[mine])))
        amplitudes = np.where(told[:, None], _transform(t[mine], e, begin, end, omega), 0.0)
        out[name] = amplitudes, usual**2 * (end - begin) / len(e) * np.where(told, 1.0, ENDLESS)
    return out


def _velocities(
    streams: Mapping[str, tuple[ComplexArray, FloatArray]],
    speed: FloatArray,
    arm: tuple[float, float],
    omega: FloatArray,
) -> ComplexArray:
    """Errors (tapers, f, 3) of u, v, r from all streams that show them, each by its precision.

    A position's error in body axes grows with that of the velocity, with what an error of heading makes of the speed,
    and turns with the vessel; what an antenna ahead of the origin does in yaw is taken off.
    """
    s = 1j * omega
    yaw = [(x[0][..., 0] * (s if n == "heading" else 1.0), x[1] * (omega**2 if n == "heading" else omega**0))
           for n in ("heading", "yaw_rate") if (x := streams.get(n))]  # fmt: skip
    r = _merged(yaw) if yaw else np.zeros((TAPERS, len(omega)), dtype=complex)
    psi = r / s
    both = []
    if "position" in streams:
        (x, y), noise = np.moveaxis(streams["position"][0], -1, 0), streams["position"][1]
        x, y = x + arm[1] * psi, y - arm[0] * psi
        u, v = s * x - speed[2] * y + speed[1] * psi, s * y + speed[2] * x - speed[0] * psi
        both.append((np.stack([u, v], axis=-1), (noise * omega**2)[:, None]))
    if "velocity" in streams:
        (u, v), noise = np.moveaxis(streams["velocity"][0], -1, 0), streams["velocity"][1]
        u, v = u + arm[1] * r + speed[1] * psi, v - arm[0] * r - speed[0] * psi
        both.append((np.stack([u, v], axis=-1), noise[:, None]))
    uv = _merged(both) if both else np.zeros((TAPERS, len(omega), 2), dtype=complex)
    return np.concatenate([uv, r[..., None]], axis=-1)


def _merged(estimates: Sequence[tuple[ComplexArray, FloatArray]]) -> ComplexArray:
    """Mean of several estimates by their precision."""
    return np.asarray(sum(x / n for x, n in estimates) / sum(1.0 / n for _, n in estimates), dtype=complex)


def _transform(
    t: FloatArray, values: FloatArray, begin: float, end: float, omega: FloatArray
) -> ComplexArray:
    """Fourier amplitudes (tapers, f, c) of values (n, c) at any times, a parabola taken off; |·|² per Hz, two-sided.

    Between samples the tapered values go straight, and that is transformed as it is: by the jumps of its slope. At even
    times the sum over the samples is that over sinc². At others a sum shows a slow line once more, where the pattern of
    the times has one (a logger that writes at the ticks of a slower clock has two kinds of intervals), and
    accelerations grow with the square of frequency.
    """
    x = (t - begin) / (end - begin)
    parabola = np.vander(x - 0.5, 3)
    rest = values - parabola @ np.linalg.lstsq(parabola, values, rcond=None)[0]
    tapers = np.sin(np.pi * np.arange(1, TAPERS + 1)[:, None] * x) * np.sqrt(2.0 / (end - begin))
    tapered = np.moveaxis(tapers[:, :, None] * rest, 0, 1).reshape(len(t), -1)
    wave = np.exp(-1j * np.outer(omega, t - begin))
    straight = (omega * np.sinc(omega * np.median(np.diff(t)) / (2.0 * np.pi)))[:, None] ** 2
    return np.moveaxis((wave @ _bends(t, tapered) / -straight).reshape(len(omega), TAPERS, -1), 1, 0)


def _bends(t: FloatArray, values: FloatArray) -> FloatArray:
    """Jumps (n, c) of the slopes of straight lines through values (n, c), which are nothing before and after.

    Before the first and after the last they go down over an interval as long as the next.
    """
    step = np.maximum(np.diff(t), 1e-9)
    ends = (values[:1] / step[:1, None], -values[-1:] / step[-1:, None])
    return np.diff(np.concatenate([ends[0], np.diff(values, axis=0) / step[:, None], ends[1]]), axis=0)


def _deeds(structure: Structure, stretch: Stretch, states: FloatArray, t: FloatArray) -> FloatArray:
    """What the vessel did (n, m): inputs, the motion that the model says they cause, and products of two of them."""
    inputs = [held_at(stretch.inputs[i.name], t) for i in structure.inputs]
    motion = [states[:, j] for j in (3, 4, 5)]
    pairs = [a * b for part in (inputs, motion) for a, b in combinations_with_replacement(part, 2)]
    heading = [np.cos(states[:, 2]), np.sin(states[:, 2])]
    return np.column_stack([*inputs, *motion, *pairs, *heading])


def _jacobian(structure: Structure, d: Drive, states: FloatArray, w: Window) -> FloatArray:
    """Mean derivative (3, 3) of the accelerations u̇, v̇, ṙ by u, v, r along a window; zeros for a discrete model."""
    if structure.model.discrete:
        return np.zeros((3, 3))
    size = 1e-3 * (np.abs(states[:, 3:6]).mean(axis=0) + 1e-3)
    out, places = np.zeros((3, 3)), np.linspace(0, w.steps - 1, 8).astype(int)
    for i in places:
        for j in range(3):
            move = np.zeros(kernel.NX)
            move[3 + j] = size[j]
            high, low = (
                accelerations_at(structure, d, states[i] + s * move, w.first + i)[:3] for s in (1.0, -1.0)
            )
            out[:, j] += (high - low) / (2.0 * size[j] * len(places))
    return out
