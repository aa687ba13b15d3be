"""Waves: a narrow band in the prediction errors that nothing the vessel did can account for.

The errors of the raw measurements over windows, at their own times, give the spectrum of the velocities' errors in
body axes; through the model's own linear response, that of the accelerations that would cause them. A peak above the
smooth spectrum around it is waves if chance, the inputs, and the motion that they cause do not account for it. A
wandering sensor and forces that are missing make smooth spectra; a model that answers wrongly makes peaks where the
manoeuvre has them, coherent with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy import special, stats

from identify import kernel
from identify.base_fit import Fitted
from identify.drive import Drive, drive
from identify.fit import Estimated, FittedEffect
from identify.predict import run, shown
from identify.regression import through_water
from identify.stretch import KIND, Stretch
from identify.structure import Structure
from identify.windows import Problem, Window, moments
from validate.tables import held_at

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]

#: Waves are found in at most this share of campaigns that have none.
FALSE_ALARM = 0.002
#: Sine tapers per window (Riedel and Sidorenko 1995).
TAPERS = 2
#: Least cycles of a wave in a window; the spectrum around it is followed down to half of it.
LEAST_CYCLES = 3.0
#: No vessel follows waves faster than this, rad/s.
FASTEST = 25.0
#: A peak stands at least so far above the power around it.
LEAST_RATIO = 2.0
#: Waves lie within this share of their frequency to either side.
BAND = 0.18
#: The spectrum around a peak is taken over this factor in frequency to either side.
AROUND = 2.5
#: Coherence with what the vessel did: least chance where that has no line near the peak, and where it has one.
COHERENT, COHERENT_AT_LINE = 0.01, 0.5
CHANNELS = ("u", "v", "r")
_UNITS = {"u": "m/s²", "v": "m/s²", "r": "rad/s²"}


@dataclass(frozen=True)
class Waves:
    """A narrow-band disturbance.

    Attributes
    ----------
    frequency, frequency_stderr : float
        Middle of the band, rad/s, as the vessel meets it.
    amplitudes, stderrs : mapping of str to float
        Per channel u, v, r: √2 times the root mean square of the acceleration, m/s² or rad/s².
    p_value : float
        Probability of such a peak at any frequency looked at, in any channel, by chance.
    share : mapping of str to float
        Per channel: part of the mean squared error of u, v, r over windows (prediction less smoothed measurement)
        that lies in the peak.
    """

    frequency: float
    frequency_stderr: float
    amplitudes: Mapping[str, float]
    stderrs: Mapping[str, float]
    p_value: float
    share: Mapping[str, float]

    def fitted_effect(self) -> FittedEffect:
        """The effect ``waves`` as the report has it."""
        parameters = [Estimated("", "frequency", self.frequency, self.frequency_stderr, "rad/s")]
        parameters += [
            Estimated("", c, self.amplitudes[c], self.stderrs[c], _UNITS[c]) for c in self.amplitudes
        ]
        return FittedEffect("waves", None, tuple(parameters), {})


@dataclass(frozen=True)
class _Spectra:
    """Fourier amplitudes, one row per window and taper; squared, they are densities per Hz, two-sided.

    ``omega`` (f,); ``force`` (n, f, 3) accelerations, ``errors`` (n, f, 3) of the velocities as the smoother shows
    them, ``done`` (n, f, m) what the vessel did; ``mean_square`` (3,) of the velocities' errors;
    ``order`` (3,) the power of frequency from the density of what the sensors measure to that of the accelerations.
    """

    omega: FloatArray
    force: ComplexArray
    errors: ComplexArray
    done: ComplexArray
    mean_square: FloatArray
    order: FloatArray

    @property
    def spacing(self) -> float:
        """Interval of the frequencies, rad/s: half of one cycle per window."""
        return float(self.omega[1] - self.omega[0])


@dataclass(frozen=True)
class _Around:
    """The smooth spectrum around each frequency (f,), a line (f, 2) of slope and level in double logarithms, and how
    many degrees of freedom (f,) it is known with.
    """

    omega: FloatArray
    line: FloatArray
    freedom: FloatArray

    @property
    def level(self) -> FloatArray:
        """At each frequency itself (f,)."""
        return np.asarray(np.exp(self.line[:, 0]), dtype=float)

    def across(self, place: int) -> FloatArray:
        """The line around one frequency, at all of them (f,)."""
        level, slope = self.line[place]
        return np.asarray(np.exp(level + slope * np.log(self.omega / self.omega[place])), dtype=float)


def find_waves(fitted: Fitted) -> Waves | None:
    """Find a narrow band in the windows' errors that stands out and goes with nothing that the vessel did.

    Parameters
    ----------
    fitted : Fitted
        The last fit of the loop.

    Returns
    -------
    Waves or None
        None where there is no such band, or the data cannot show one (fewer than two windows, too short windows).
    """
    spectra = _spectra(fitted)
    if spectra is None:
        return None
    power = np.mean(np.abs(spectra.force) ** 2, axis=0)
    around = [_around(spectra, p) for p in power.T]
    p_values = np.column_stack([_chance(spectra, p, a) for p, a in zip(power.T, around, strict=True)])
    tried = int(np.isfinite(p_values).sum())
    chance = -np.expm1(tried * np.log1p(-np.minimum(np.nan_to_num(p_values, nan=1.0), 1 - 1e-16)))
    while chance.min() < FALSE_ALARM:
        place, channel = (int(i) for i in np.unravel_index(np.argmin(chance), chance.shape))
        found = _measured(fitted, spectra, around, place, float(chance[place, channel]))
        if _material(found, spectra, around[channel], place, channel) and not _goes_with(
            spectra, place, channel
        ):
            return found
        chance[_core(spectra, spectra.omega[place])] = 1.0
    return None


def _chance(spectra: _Spectra, power: FloatArray, around: _Around) -> FloatArray:
    """Probability (f,) of a peak as high by chance; NaN where no peak is looked for, 1 where too low to matter."""
    ratio = power / around.level
    p = stats.f.sf(ratio, 2 * len(spectra.force), np.maximum(around.freedom, 1e-3))
    slow = spectra.omega < 1.999 * spectra.omega[0]
    return np.where(slow | ~np.isfinite(ratio), np.nan, np.where(ratio > LEAST_RATIO, p, 1.0))


def _core(spectra: _Spectra, omega: float | FloatArray) -> FloatArray:
    """Which frequencies (…, f) may hold part of a peak at ``omega`` (…): its band, widened by the tapers."""
    half = np.maximum(BAND * np.asarray(omega), 1.01 * spectra.spacing) + 0.5 * (TAPERS + 1) * spectra.spacing
    return np.abs(spectra.omega - np.asarray(omega)[..., None]) <= half[..., None]


def _around(spectra: _Spectra, power: FloatArray) -> _Around:
    """Local straight line (double logarithmic) through the spectrum outside the core of each frequency."""
    n, x = len(spectra.force), np.log(spectra.omega)
    good = np.isfinite(power) & (power > 0)
    y = np.log(np.where(good, power, 1.0)) - special.digamma(n) + np.log(n)
    weight = ((np.abs(x - x[:, None]) < np.log(AROUND)) & ~_core(spectra, spectra.omega) & good).astype(float)
    design = np.stack([np.ones_like(weight), x - x[:, None]], axis=-1)
    gram = np.einsum("fg,fgi,fgj->fij", weight, design, design) + 1e-9 * np.eye(2)
    inverse = np.linalg.inv(gram)
    line = np.einsum("fij,fgj,fg,g->fi", inverse, design, weight, y)
    misfit = weight * (y - np.einsum("fgi,fi->fg", design, line)) ** 2
    count = np.maximum(weight.sum(axis=1) - 2.0, 1.0)
    # neighbours within the tapers' width are one; a spectrum that is not a line counts as less well known
    scatter = np.maximum(misfit.sum(axis=1) / count, special.polygamma(1, n))
    freedom = 2.0 / (scatter * 2 * (TAPERS + 1) * inverse[:, 0, 0])
    known = good & (weight.sum(axis=1) >= 4)
    return _Around(spectra.omega, np.where(known[:, None], line, np.nan), freedom)


def _material(found: Waves, spectra: _Spectra, around: _Around, place: int, channel: int) -> bool:
    """Whether the velocity of the waves stands above the noise of an average over one window."""
    noise = around.level[place] * 2.0 * spectra.spacing / np.pi
    return bool(0.5 * found.amplitudes[CHANNELS[channel]] ** 2 > noise)


def _goes_with(spectra: _Spectra, place: int, channel: int) -> bool:
    """Whether the peak is coherent with anything that the vessel did: surely, or perhaps where that has a line."""
    force, n = spectra.force[:, place, channel], len(spectra.force)
    done = spectra.done[:, place]
    own = np.sum(np.abs(done) ** 2, axis=0)
    coherence = np.abs(force.conj() @ done) ** 2 / np.maximum(own * np.sum(np.abs(force) ** 2), 1e-300)
    single = (1.0 - np.minimum(coherence, 1.0)) ** (n - 1)
    least = 1.0 - (1.0 - single.min(initial=1.0)) ** max(len(single), 1)
    return bool(least < (COHERENT_AT_LINE if _has_line(spectra, place) else COHERENT))


def _has_line(spectra: _Spectra, place: int) -> bool:
    """Whether anything that the vessel did has a line of its spectrum near a frequency."""
    near = slice(max(place - 1, 0), place + 2)
    for k in range(spectra.done.shape[2]):
        power = np.mean(np.abs(spectra.done[:, :, k]) ** 2, axis=0)
        if np.nanmin(_chance(spectra, power, _around(spectra, power))[near], initial=1.0) < COHERENT:
            return True
    return False


def _measured(
    fitted: Fitted, spectra: _Spectra, around: Sequence[_Around], place: int, p_value: float
) -> Waves:
    """Frequency, amplitudes and shares of a peak: what its band holds above the spectrum around it."""
    core = _core(spectra, spectra.omega[place])
    level = np.column_stack([a.across(place) for a in around])
    # as the sensors show it: there the tapers widen the peak to both sides alike
    shown_as = (spectra.omega[:, None] / spectra.omega[place]) ** -spectra.order
    excess = (_by_window(np.abs(spectra.force) ** 2) - level) * shown_as
    centre, spread = _centroid(spectra, excess[:, core] @ (1.0 / level[place]), core)
    doubt = _within(spectra, level * shown_as, core) * np.sqrt(
        2.0 / np.array([a.freedom[place] for a in around])
    )
    amplitude, stderr = _amplitudes(_within(spectra, excess, core), doubt)
    share = _shares(spectra, place, core)
    names = [(c, k) for k, c in enumerate(CHANNELS) if c in fitted.solution.structure.model.predicts]
    return Waves(
        centre, spread, {c: float(amplitude[k]) for c, k in names}, {c: float(stderr[k]) for c, k in names},
        p_value, {c: float(share[k]) for c, k in names},
    )  # fmt: skip


def _by_window(power: FloatArray) -> FloatArray:
    """Mean over the tapers of each window (windows, …)."""
    return np.asarray(power.reshape(-1, TAPERS, *power.shape[1:]).mean(axis=1), dtype=float)


def _within(spectra: _Spectra, excess: FloatArray, core: BoolArray) -> FloatArray:
    """Variance (…, 3) in a band of densities (…, f, 3)."""
    return np.asarray(excess[..., core, :].sum(axis=-2) * spectra.spacing / np.pi, dtype=float)


def _amplitudes(variance: FloatArray, doubt: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (3,) and standard errors from the variance in each window (w, 3), and the doubt about what to take off."""
    square = 2.0 * variance.mean(axis=0)
    spread = 2.0 * np.hypot(variance.std(axis=0, ddof=1) / np.sqrt(len(variance)), doubt)
    amplitude = np.sqrt(np.maximum(square, 0.0))
    return amplitude, np.minimum(spread / np.maximum(2.0 * amplitude, 1e-300), np.sqrt(spread))


def _centroid(spectra: _Spectra, excess: FloatArray, core: BoolArray) -> tuple[float, float]:
    """Middle of what each window (w, c) has above its surroundings, with the jack-knife's standard error."""

    def middle(mean: FloatArray) -> float:
        weight = np.maximum(mean, 0.0)
        return float(weight @ spectra.omega[core] / max(weight.sum(), 1e-300))

    each = [middle(np.delete(excess, k, axis=0).mean(axis=0)) for k in range(len(excess))]
    return middle(excess.mean(axis=0)), float(np.sqrt((len(each) - 1) * np.var(each)))


def _shares(spectra: _Spectra, place: int, core: BoolArray) -> FloatArray:
    """Part (3,) of the mean squared error of the velocities that the peak holds."""
    power = np.mean(np.abs(spectra.errors) ** 2, axis=0)
    level = np.column_stack([_around(spectra, p).across(place) for p in power.T])
    share = _within(spectra, power - np.nan_to_num(level), core) / np.maximum(spectra.mean_square, 1e-300)
    return np.clip(share, 0.0, 1.0)


def _spectra(fitted: Fitted) -> _Spectra | None:
    """Fourier amplitudes of all windows of nearly the usual length; None where they cannot show anything."""
    problem, structure = fitted.problem, fitted.solution.structure
    lengths = np.array([problem.stretches[w.stretch].h * w.steps for w in problem.windows])
    usual = float(np.median(lengths)) if len(lengths) else 0.0
    used = [k for k, length in enumerate(lengths) if length > 0.75 * usual]
    fastest = min(FASTEST, 0.8 * np.pi / _interval(fitted)) if used else 0.0
    omega = np.arange(LEAST_CYCLES / 2, fastest * usual / (2.0 * np.pi), 0.5) * 2.0 * np.pi / max(usual, 1e-9)
    if len(used) < 2 or len(omega) < 12:
        return None
    p, first = fitted.solution.p, fitted.solution.first
    residuals = moments(problem, structure, p, first).residuals
    drives = {
        j: drive(structure, p, problem.stretches[j]) for j in {problem.windows[k].stretch for k in used}
    }
    looks = [_look(fitted, k, residuals[k], drives[problem.windows[k].stretch], omega) for k in used]
    force, errors, done, error = (np.concatenate(part) for part in zip(*looks, strict=True))
    moved = np.ptp(np.abs(done), axis=(0, 1)) > 0
    return _Spectra(omega, force, errors, done[..., moved], np.mean(error**2, axis=0), _order(structure))


def _order(structure: Structure) -> FloatArray:
    streams = structure.setting.streams
    along, turn = 2.0 if "velocity" in streams else 4.0, 2.0 if "yaw_rate" in streams else 4.0
    return np.array([along, along, turn])


def _interval(fitted: Fitted) -> float:
    """Longest of the streams' usual intervals between samples that the accelerations need, s."""
    longest = 0.0
    samples = [s.samples for s in fitted.problem.stretches]
    for kinds in ((kernel.POSITION, kernel.VELOCITY), (kernel.HEADING, kernel.YAW_RATE)):
        steps = [np.diff(s.t[s.kind == k]) for k in kinds for s in samples if (s.kind == k).sum() > 2]
        longest = max(longest, min((float(np.median(d)) for d in steps), default=0.0))
    return longest


def _look(
    fitted: Fitted, number: int, residual: FloatArray, d: Drive, omega: FloatArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray, FloatArray]:
    """One window: amplitudes (tapers, f, …) as in ``_Spectra``, and the velocities' errors (n, 3)."""
    problem, structure = fitted.problem, fitted.solution.structure
    w = problem.windows[number]
    stretch = problem.stretches[w.stretch]
    part = slice(w.first, w.first + w.steps + 1)
    states = run(structure, d, stretch, fitted.solution.first[number], w.first, w.steps)
    error = shown(structure, d, stretch, states)[:, 3:6] - stretch.states[part, 3:6]
    speed = through_water(stretch.states[part], d.current)[:, 3:6].mean(axis=0)
    velocity = _velocities(_streams(problem, w, residual, omega), speed, structure.vessel.antenna, omega)
    force = 1j * omega[:, None] * velocity - velocity @ _jacobian(structure, d, stretch, states, w).T
    t = stretch.grid[part]
    done = _deeds(structure, stretch, states, t)
    return force, _transform(t, error, t[0], t[-1], omega), _transform(t, done, t[0], t[-1], omega), error


def _streams(
    problem: Problem, w: Window, residual: FloatArray, omega: FloatArray
) -> dict[str, tuple[ComplexArray, float]]:
    """Amplitudes (tapers, f, rows) of each stream's errors, vectors in body axes, and its noise per Hz."""
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
        out[name] = _transform(t[mine], e, begin, end, omega), usual**2 * (end - begin) / len(e)
    return out


def _velocities(
    streams: Mapping[str, tuple[ComplexArray, float]],
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
        both.append((np.stack([u, v], axis=-1), np.full((len(omega), 1), noise)))
    uv = _merged(both) if both else np.zeros((TAPERS, len(omega), 2), dtype=complex)
    return np.concatenate([uv, r[..., None]], axis=-1)


def _merged(estimates: Sequence[tuple[ComplexArray, FloatArray]]) -> ComplexArray:
    """Mean of several estimates by their precision."""
    return np.asarray(sum(x / n for x, n in estimates) / sum(1.0 / n for _, n in estimates), dtype=complex)


def _transform(
    t: FloatArray, values: FloatArray, begin: float, end: float, omega: FloatArray
) -> ComplexArray:
    """Fourier amplitudes (tapers, f, c) of values (n, c) at any times, a parabola taken off; |·|² per Hz, two-sided."""
    x = (t - begin) / (end - begin)
    parabola = np.vander(x - 0.5, 3)
    rest = values - parabola @ np.linalg.lstsq(parabola, values, rcond=None)[0]
    tapers = np.sin(np.pi * np.arange(1, TAPERS + 1)[:, None] * x) * np.sqrt(2.0 * (end - begin)) / len(t)
    wave = np.exp(-1j * np.outer(omega, t - begin))
    return np.asarray(np.einsum("kn,fn,nc->kfc", tapers, wave, rest, optimize=True), dtype=complex)


def _deeds(structure: Structure, stretch: Stretch, states: FloatArray, t: FloatArray) -> FloatArray:
    """What the vessel did (n, m): inputs, the motion that the model says they cause, and products of two of them."""
    inputs = [held_at(stretch.inputs[i.name], t) for i in structure.inputs]
    motion = [states[:, j] for j in (3, 4, 5)]
    pairs = [a * b for part in (inputs, motion) for a, b in combinations_with_replacement(part, 2)]
    heading = [np.cos(states[:, 2]), np.sin(states[:, 2])]
    return np.column_stack([*inputs, *motion, *pairs, *heading])


def _jacobian(structure: Structure, d: Drive, stretch: Stretch, states: FloatArray, w: Window) -> FloatArray:
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
                _rates(structure, d, stretch, states[i] + s * move, w.first + i) for s in (1.0, -1.0)
            )
            out[:, j] += (high - low) / (2.0 * size[j] * len(places))
    return out


def _rates(structure: Structure, d: Drive, stretch: Stretch, state: FloatArray, step: int) -> FloatArray:
    """Accelerations (3,) that the model gives in a state (8,)."""
    table, part = structure.table, slice(step, step + 1)
    states, rates = np.empty((2, kernel.NX)), np.empty((2, kernel.NX))
    kernel.rollout(
        state, stretch.h, structure.model.discrete, d.channels[part], d.slopes[part], d.wind[part], d.current,
        structure.u0, table.equation, table.which, table.product, d.coefficients, states, rates,
    )  # fmt: skip
    return rates[0, 3:6]
