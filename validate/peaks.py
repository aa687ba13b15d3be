"""Peaks in the spectra of prediction errors: how high they stand above the smooth spectrum around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special, stats

from validate.error_spectra import TAPERS, Spectra

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Least cycles of a wave in a window, and enough of them to tell its frequency.
LEAST_CYCLES, ENOUGH_CYCLES = 3.0, 5.0
#: A peak stands at least so far above the power around it.
LEAST_RATIO = 2.0
#: Waves lie within this share of their frequency to either side.
BAND = 0.18
#: The spectrum around a peak is taken over this factor in frequency to either side.
AROUND = 2.5


@dataclass(frozen=True)
class Around:
    """The smooth spectrum around each frequency (f,).

    A line (f, 2) of slope and level in double logarithms, and how many degrees of freedom (f,) it is known with.
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


def chance_of(spectra: Spectra, power: FloatArray, around: Around) -> FloatArray:
    """Probability (f,) of a peak as high by chance; NaN where no peak is looked for, 1 where too low to matter."""
    ratio = power / around.level
    p = stats.f.sf(ratio, 2 * len(spectra.rate), np.maximum(around.freedom, 1e-3))
    slow = spectra.omega < 0.999 * 2.0 * spectra.spacing * LEAST_CYCLES
    judged = np.where(ratio > LEAST_RATIO, p, 1.0)
    return np.asarray(np.where(slow | ~np.isfinite(ratio), np.nan, judged), dtype=float)


def core_of(spectra: Spectra, omega: float | FloatArray) -> BoolArray:
    """Which frequencies (…, f) may hold part of a peak at ``omega`` (…): its band, widened by the tapers."""
    half = np.maximum(BAND * np.asarray(omega), 1.01 * spectra.spacing) + 0.5 * (TAPERS + 1) * spectra.spacing
    away = np.abs(spectra.omega - np.asarray(omega)[..., None])
    return np.asarray(away <= half[..., None], dtype=bool)


def around_of(spectra: Spectra, power: FloatArray) -> Around:
    """Local straight line (double logarithmic) through the spectrum outside the core of each frequency."""
    n, x = len(spectra.rate), np.log(spectra.omega)
    good = np.isfinite(power) & (power > 0)
    y = np.log(np.where(good, power, 1.0)) - special.digamma(n) + np.log(n)
    weight = ((np.abs(x - x[:, None]) < np.log(AROUND)) & ~core_of(spectra, spectra.omega) & good).astype(
        float
    )
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
    return Around(spectra.omega, np.where(known[:, None], line, np.nan), freedom)
