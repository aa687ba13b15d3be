"""What a peak of the errors' spectra says of the waves that made it: their band, how strong, how well that is known."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from identify.fitted import Fitted
from identify.swell import Sighting, Swell
from validate.error_spectra import TAPERS, Spectra
from validate.peaks import around_of, core_of
from validate.wave_resonance import Resonance, resonance_of

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: No band is taken to be narrower than this share of its frequency.
NARROWEST = 0.03
CHANNELS = ("u", "v", "r")


def measured(fitted: Fitted, spectra: Spectra, place: int, p_value: float) -> Swell:
    """Frequency, amplitudes and shares of a peak: what its band holds above the spectrum around it."""
    core = core_of(spectra, spectra.omega[place])
    around = [around_of(spectra, p) for p in np.mean(np.abs(spectra.force) ** 2, axis=0).T]
    level = np.column_stack([a.across(place) for a in around])
    # as the sensors show it: there the tapers widen the peak to both sides alike
    shown_as = (spectra.omega[:, None] / spectra.omega[place]) ** -spectra.order
    excess = (by_window(np.abs(spectra.force) ** 2) - level) * shown_as
    logs = spectra.log
    weighted = np.nan_to_num(
        excess[:, core] / level[place]
    )  # of what a model does not predict there is nothing
    centre, sharpness = _centroid(spectra, weighted.sum(axis=2), core, np.arange(len(logs)))
    doubt = _within(spectra, level * shown_as, core) * np.sqrt(
        2.0 / np.array([a.freedom[place] for a in around])
    )
    amplitude, stderr = _amplitudes(_within(spectra, excess, core), doubt, logs)
    share = _shares(spectra, place, core)
    motion, width = _motion(spectra, place, core, centre)
    waves = _resonance(spectra, level, core)
    order = _of_all(np.maximum(weighted.mean(axis=0).sum(axis=0), 0.0), spectra.order)
    by_log = _centroid(spectra, weighted.sum(axis=2), core, logs)[1]
    apart = centre + order * width**2 / centre - waves.frequency
    names = [(c, k) for k, c in enumerate(CHANNELS) if c in fitted.solution.structure.model.predicts]
    seen = Sighting(
        waves.frequency, math.hypot(max(sharpness, by_log, *waves.stderrs), apart), sharpness,
        {c: float(amplitude[k]) for c, k in names}, {c: float(stderr[k]) for c, k in names}, p_value,
        {c: float(share[k]) for c, k in names}, _together(spectra, core),
        0.5 * centre / spectra.spacing,
    )  # fmt: skip
    predicted = np.isin(np.arange(3), [k for _, k in names])
    return Swell(
        centre, width, three(motion * predicted), fitted.solution.structure.vessel.antenna,
        damping=three(-np.diag(spectra.slope) * predicted), seen=seen,
    )  # fmt: skip


def three(values: FloatArray) -> tuple[float, float, float]:
    """Of u, v, r, as numbers."""
    u, v, r = (float(x) for x in values)
    return u, v, r


def _together(spectra: Spectra, core: BoolArray) -> ComplexArray:
    """Coherence (3, 3) of the velocities in a peak's band."""
    velocity = (spectra.rate / spectra.omega[:, None])[:, core].reshape(-1, 3)
    cross = velocity.T @ velocity.conj()
    size = np.sqrt(np.maximum(np.diag(cross).real, 1e-300))
    return np.asarray(cross / np.outer(size, size), dtype=complex)


def _resonance(spectra: Spectra, level: FloatArray, core: BoolArray) -> Resonance:
    """What the waves' accelerations swing with, by the channels whose spectra (f, 3) around the peak are known."""
    known = np.isfinite(level).all(axis=0)
    omega, order = spectra.omega[core], spectra.order[known]
    shown_as = (omega[:, None] / omega.mean()) ** -order
    power = by_window(np.abs(spectra.force) ** 2)[:, core][..., known] * shown_as
    groups = (np.arange(len(power)), spectra.log)
    return resonance_of(omega, power, level[core][:, known] * shown_as, order, groups)


def _motion(spectra: Spectra, place: int, core: BoolArray, centre: float) -> tuple[FloatArray, float]:
    """Root mean square (3,) of the velocities in a peak's band, and the band's standard deviation, rad/s."""
    power = np.mean(np.abs(spectra.rate) ** 2, axis=0) / spectra.omega[:, None] ** 2
    level = np.column_stack([around_of(spectra, p).across(place) for p in power.T])
    excess = power - np.nan_to_num(level)
    weight = np.maximum(excess[core] @ np.nan_to_num(1.0 / np.maximum(level[place], 1e-300)), 0.0)
    wide = float(weight @ (spectra.omega[core] - centre) ** 2 / max(weight.sum(), 1e-300))
    narrow = wide - 2.0 * spectra.spacing**2  # what the tapers widen a line by
    spread = math.sqrt(max(narrow, (NARROWEST * centre) ** 2))
    return np.sqrt(np.maximum(_within(spectra, excess, core), 0.0)), spread


def by_window(power: FloatArray) -> FloatArray:
    """Mean over the tapers of each window (windows, …)."""
    return np.asarray(power.reshape(-1, TAPERS, *power.shape[1:]).mean(axis=1), dtype=float)


def _within(spectra: Spectra, excess: FloatArray, core: BoolArray) -> FloatArray:
    """Variance (…, 3) in a band of densities (…, f, 3)."""
    return np.asarray(excess[..., core, :].sum(axis=-2) * spectra.spacing / np.pi, dtype=float)


def _amplitudes(variance: FloatArray, doubt: FloatArray, logs: IntArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (3,) and standard errors from the variance in each window (w, 3), less what is doubtful."""
    square = 2.0 * variance.mean(axis=0)
    varied = [_jackknifed(lambda x: x.mean(axis=0), variance, g) for g in (np.arange(len(variance)), logs)]
    spread = 2.0 * np.hypot(np.max(varied, axis=0), doubt)
    amplitude = np.sqrt(np.maximum(square, 0.0))
    return amplitude, np.minimum(spread / np.maximum(2.0 * amplitude, 1e-300), np.sqrt(spread))


def _centroid(spectra: Spectra, excess: FloatArray, core: BoolArray, groups: IntArray) -> tuple[float, float]:
    """Middle of what each window (w, c) has above its surroundings, with the standard error from group to group."""

    def middle(some: FloatArray) -> FloatArray:
        weight = np.maximum(some.mean(axis=0), 0.0)
        if not weight.any():  # nothing stands above its surroundings: the band's own middle
            weight = np.ones(len(weight))
        return np.asarray(weight @ spectra.omega[core] / weight.sum())

    return float(middle(excess)), float(_jackknifed(middle, excess, groups))


def _jackknifed(
    statistic: Callable[[FloatArray], FloatArray], rows: FloatArray, groups: IntArray
) -> FloatArray:
    """Standard error of a statistic of rows that come in groups (w,): each is left out in turn."""
    left = np.array([statistic(rows[groups != g]) for g in np.unique(groups) if np.any(groups != g)])
    return np.sqrt((len(left) - 1) * left.var(axis=0)) if len(left) else np.zeros_like(statistic(rows))


def _of_all(weights: FloatArray, values: FloatArray) -> float:
    """Mean of values by their weights."""
    return float(weights @ values / max(weights.sum(), 1e-300))


def _shares(spectra: Spectra, place: int, core: BoolArray) -> FloatArray:
    """Part (3,) of the mean squared error of the velocities that the peak holds."""
    power = np.mean(np.abs(spectra.errors) ** 2, axis=0)
    level = np.column_stack([around_of(spectra, p).across(place) for p in power.T])
    share = _within(spectra, power - np.nan_to_num(level), core) / np.maximum(spectra.mean_square, 1e-300)
    return np.clip(share, 0.0, 1.0)
