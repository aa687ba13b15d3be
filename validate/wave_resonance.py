"""The frequency of waves: of the resonance, driven by white noise, whose spectrum is likeliest to have made a peak.

A centroid is drawn to where a band is cut off, and to lower frequencies where sensors show a motion and not the
accelerations that made it: for slow waves, of which a window holds few, by some per cent. The likelihood is Whittle's
(1953) over a peak's band, in each channel above the spectrum around it; tapers widen the resonance as they do the peak.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from validate.error_spectra import TAPERS

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

#: Damping, as a share of critical, with which a search begins, and least and most of it.
BEGUN, DAMPED = 0.05, (0.001, 0.3)
#: Resonances are reckoned at so many frequencies in an interval of the spectra (narrower ones would fall between), and
#: up to so many intervals beside the band.
FINE, BESIDE = 32, 5
#: Points of a taper.
POINTS = 128
#: Step of a derivative by a logarithm.
STEP = 1e-4


class Resonance(NamedTuple):
    """Frequency, rad/s, damping as a share of critical, and standard errors of the frequency by sets of groups."""

    frequency: float
    damping: float
    stderrs: tuple[float, ...]


class _Peak(NamedTuple):
    """A peak's powers (w, f, c) by window over ``level`` (f, c), and what of ``fine`` (g,) frequencies they hold."""

    power: FloatArray
    level: FloatArray
    fine: FloatArray
    held: FloatArray
    order: FloatArray

    def spectrum(self, x: FloatArray) -> FloatArray:
        """The likeliest power (f, c) with logarithms ``x`` (2 + c,) of frequency, damping and heights."""
        frequency, damping = np.exp(x[:2])
        across = (frequency / self.fine - self.fine / frequency) / (2.0 * damping)
        shape = (self.fine / frequency)[:, None] ** -self.order / (1.0 + across[:, None] ** 2)
        return np.asarray(self.level + np.exp(x[2:]) * (self.held @ shape), dtype=float)

    def slopes(self, x: FloatArray) -> FloatArray:
        """Derivatives (f, c, 2 + c) of the logarithm of the spectrum."""
        moved = STEP * np.eye(len(x))
        rise = [np.log(self.spectrum(x + d) / self.spectrum(x - d)) for d in moved]
        return np.stack(rise, axis=-1) / (2.0 * STEP)


def resonance_of(
    omega: FloatArray, power: FloatArray, level: FloatArray, order: FloatArray, groupings: Sequence[IntArray]
) -> Resonance:
    """The resonance that a peak's band shows.

    Parameters
    ----------
    omega : array (f,)
        Frequencies of the band, rad/s, at equal intervals of half a cycle in a window.
    power : array (w, f, c)
        What the sensors show in each window and channel, as a density.
    level : array (f, c)
        The same without the peak.
    order : array (c,)
        The power of frequency from that density to that of the accelerations.
    groupings : sequence of arrays (w,)
        Which windows go together, for one standard error each.
    """
    peak = _peak(omega, power, level, order)
    best = _likeliest(peak, omega)
    frequency = float(np.exp(best[0]))
    stderrs = tuple(frequency * _doubt(peak, best, groups) for groups in groupings)
    return Resonance(frequency, float(np.exp(best[1])), stderrs)


def _likeliest(peak: _Peak, omega: FloatArray) -> FloatArray:
    """Logarithms (2 + c,) of frequency, damping and heights that a peak is likeliest with."""
    mean = peak.power.mean(axis=0)

    def deviance(x: FloatArray) -> tuple[float, FloatArray]:
        spectrum = peak.spectrum(x)
        ratio = mean / spectrum
        slope = np.einsum("fc,fcn->n", 1.0 - ratio, peak.slopes(x))
        return float(np.sum(np.log(spectrum) + ratio)), slope

    middle = float(omega[np.argmax(np.sum(mean / peak.level, axis=1))])
    height = np.log(np.maximum(np.max(mean / peak.level, axis=0), 2.0)) + np.log(peak.level.mean(axis=0))
    least = max(DAMPED[0], (peak.fine[1] - peak.fine[0]) / middle)
    bounds = [tuple(np.log(omega[[0, -1]])), tuple(np.log([least, DAMPED[1]]))]
    bounds += [(h - 10.0, h + 10.0) for h in height]
    begin = np.array([np.log(middle), np.log(BEGUN), *height])
    return np.asarray(minimize(deviance, begin, jac=True, method="L-BFGS-B", bounds=bounds).x, dtype=float)


def _peak(omega: FloatArray, power: FloatArray, level: FloatArray, order: FloatArray) -> _Peak:
    """What tapered windows, a parabola taken off them, hold of every frequency: those of ``error_spectra``."""
    spacing = omega[1] - omega[0]
    fine = spacing / FINE * np.arange(FINE // 2, FINE * (round(omega[-1] / spacing) + BESIDE) + 1)
    fine = fine[fine > omega[0] - BESIDE * spacing]
    x = (np.arange(POINTS) + 0.5) / POINTS
    tapers = np.sin(np.pi * np.arange(1, TAPERS + 1)[:, None] * x) * np.sqrt(2.0)
    seen = np.einsum("kt,ft->kft", tapers, np.exp(-1j * np.pi / spacing * np.outer(omega, x)))
    parabola = np.linalg.qr(np.vander(x, 3))[0]
    seen = (seen - seen @ parabola @ parabola.T).reshape(-1, POINTS)
    swings = np.exp(1j * np.pi / spacing * np.outer(x, fine))
    held = np.abs(seen @ swings / POINTS) ** 2 + np.abs(seen @ swings.conj() / POINTS) ** 2
    held = held.reshape(TAPERS, len(omega), len(fine)).mean(axis=0) / (2.0 * FINE)
    return _Peak(power, level, fine, np.asarray(held, dtype=float), order)


def _doubt(peak: _Peak, x: FloatArray, groups: IntArray) -> float:
    """Standard error of the logarithm of the frequency, by what scores vary from group to group."""
    slopes = peak.slopes(x)
    scores = np.einsum("wfc,fcn->wn", peak.power / peak.spectrum(x) - 1.0, slopes)
    information = len(scores) * np.einsum("fcn,fcm->nm", slopes, slopes)
    summed = np.array([scores[groups == g].sum(axis=0) for g in np.unique(groups)])
    if len(summed) < 2:
        return 0.0
    inverse = np.linalg.pinv(information)
    varied = summed.T @ summed * len(summed) / (len(summed) - 1.0)
    return float(np.sqrt((inverse @ varied @ inverse)[0, 0]))
