"""Waves: a narrow band in the prediction errors that nothing the vessel did can account for.

The errors of the raw measurements over windows, at their own times, give the spectrum of the velocities' errors in
body axes; through the model's own linear response, that of the accelerations that would cause them. A peak above the
smooth spectrum around it is waves if chance, the inputs, and the motion that they cause do not account for it. A
wandering sensor and forces that are missing make smooth spectra; a model that answers wrongly makes peaks where the
manoeuvre has them, coherent with it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy import stats

from identify.fit import Estimated, FittedEffect
from identify.fitted import Fitted
from identify.swell import Swell
from validate.error_spectra import TAPERS, Spectra, spectra_of
from validate.peaks import AROUND, BAND, ENOUGH_CYCLES, Around, around_of, chance_of, core_of
from validate.structure_left import spread_of
from validate.wave_band import CHANNELS, by_window, measured, three

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
ComplexArray = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: A peak counts where chance would give it in fewer than this share of campaigns. It is far below the false alarms that
#: are meant (0.002), because real spectra are not quite the smooth lines that the reckoning takes them for.
FALSE_ALARM = 1e-6
#: ... and in fewer than this where waves need but be tried: a fit that knows of them must then come to the noise.
WORTH_A_TRY = 1e-2
#: ... and in fewer than this where waves were seen before, and the others' weights are those of errors without them.
SEEN_BEFORE = 2e-3
#: Standard error of a narrow band's frequency, as a share of it: what is wider is no band.
SHARP = 0.03
#: Coherence with what the vessel did: least chance where that has no line near the peak, and where it has one.
COHERENT, COHERENT_AT_LINE = 0.01, 0.1
#: Half of a peak may be what the vessel did, unless chance would show so little of it in fewer than this share.
NOT_EXCLUDED = 0.05
#: Waves do not ask what the vessel does: a peak that grows with it by more than chance would have it in this share of
#: campaigns, and by this factor in power from the quietest third of the windows to the busiest, is none.
GROWS_BY_CHANCE, GROWS = 0.01, 3.0
#: Windows where the vessel turns faster than this share of a wave's frequency cannot tell it from a sensor's wander.
SLOW_TURN = 0.45
#: m/s².
GRAVITY = 9.81
#: Amplitude of an acceleration along that no waves give, m/s²: they break where their slope passes 0.44 (Stokes).
BREAKING = 0.44 * GRAVITY
#: Waves shorter than this share of a vessel's length push one way here and the other there, and do not move it.
SHORTEST = 0.25
#: Nothing is made of a band where u, v, r, of which the model predicts them, are missed by more than this share of
#: their variance, on average.
TOO_FAR = 1.0
_UNITS = {"u": "m/s²", "v": "m/s²", "r": "rad/s²"}


def as_effect(swell: Swell) -> FittedEffect:
    """The effect ``waves`` as the report has it."""
    seen = swell.seen
    if seen is None:
        return FittedEffect("waves", None, (), {})
    parameters = [Estimated("", "frequency", seen.frequency, seen.frequency_stderr, "rad/s")]
    parameters += [Estimated("", c, a, seen.stderrs[c], _UNITS[c]) for c, a in seen.amplitudes.items()]
    return FittedEffect("waves", None, tuple(parameters), {})


def find_waves(fitted: Fitted) -> Swell | None:
    """Find a narrow band in the windows' errors that stands out and goes with nothing that the vessel did.

    Parameters
    ----------
    fitted : Fitted
        The last fit of the loop.

    Returns
    -------
    Swell or None
        None where there is no such band, or the data cannot show one (fewer than two windows, too short windows).
    """
    spectra = _spectra_near(fitted)
    return None if spectra is None else _found_in(fitted, spectra)


def _spectra_near(fitted: Fitted) -> Spectra | None:
    """Spectra of the errors; None where they cannot show anything, or are those of another vessel.

    How far they are above the sensors' noise says nothing of that: a good compass sees any swell at a thousand times.
    """
    spectra = spectra_of(fitted)
    if spectra is None:
        return None
    predicted = [c in fitted.solution.structure.model.predicts for c in CHANNELS]
    missed = float(np.mean((spectra.mean_square / spread_of(fitted.problem.stretches) ** 2)[predicted]))
    return spectra if missed < TOO_FAR else None


def _found_in(fitted: Fitted, spectra: Spectra, *, perhaps: bool = False) -> Swell | None:
    """The likeliest narrow band of the errors' spectra that stands and goes with nothing; or that ``perhaps`` does."""
    around, chance, tried = _chances(fitted, spectra)
    least = WORTH_A_TRY if perhaps else FALSE_ALARM
    least = least if fitted.problem.swell is None else SEEN_BEFORE
    while chance.min() < least:
        place, channel = (int(i) for i in np.unravel_index(np.argmin(chance), chance.shape))
        found = measured(fitted, spectra, place, float(chance[place, channel]))
        stands = _stands(spectra, place, channel, tried, least) and not _grows_with(spectra, place, channel)
        stands = stands and not _goes_with(spectra, place, channel, mostly=perhaps)
        if stands and _material(found, spectra, around[channel], place, channel):
            return found
        chance[core_of(spectra, spectra.omega[place])] = 1.0
    return None


def perhaps_waves(fitted: Fitted) -> Swell | None:
    """Waves that a fit's errors may show; whether a fit that knows of them comes to the noise must tell."""
    spectra = _spectra_near(fitted)
    return None if spectra is None else _found_in(fitted, spectra, perhaps=True)


def waves_of(fitted: Fitted) -> Swell | None:
    """Waves that a fit's errors show, or that it knows of if these are still to be seen: as they were seen sharpest."""
    known, spectra = fitted.problem.swell, _spectra_near(fitted)
    if spectra is None:
        return None
    again = _seen_again(fitted, spectra, known) if known else None
    if not known or not again:
        return _found_in(fitted, spectra)
    return again if hardly_seen(known) else min(_driven(known, spectra), again, key=_doubt)


def hardly_seen(swell: Swell) -> bool:
    """Whether waves were seen in windows of too few cycles to tell their frequency."""
    return swell.seen is not None and swell.seen.cycles < 0.9 * ENOUGH_CYCLES


def _driven(swell: Swell, spectra: Spectra) -> Swell:
    """Waves seen in another fit, by the accelerations that would move the vessel as they do if it answers as now."""
    seen, motion = swell.seen, np.array(swell.motion)
    if seen is None:
        return swell
    by = 1j * swell.frequency * np.eye(3) - spectra.slope
    power = np.diag(by @ (seen.together * np.outer(motion, motion)) @ by.conj().T).real
    now = {c: float(np.sqrt(2.0 * max(power[CHANNELS.index(c)], 0.0))) for c in seen.amplitudes}
    # what was not seen at all is known no better for being nothing now
    less = {c: min(now[c] / x, 1.0) if x > 0.0 else 1.0 for c, x in seen.amplitudes.items()}
    stderrs = {c: x * less[c] for c, x in seen.stderrs.items()}
    seen = replace(seen, amplitudes=now, stderrs=stderrs)
    return replace(swell, damping=three(-np.diag(spectra.slope) * (motion > 0.0)), seen=seen)


def _seen_again(fitted: Fitted, spectra: Spectra, known: Swell) -> Swell | None:
    """What the errors' highest peak in a band that is known shows; None where there is none."""
    _, chance, _ = _chances(fitted, spectra)
    chance[np.abs(spectra.omega - known.frequency) > BAND * known.frequency] = 1.0
    place, channel = (int(i) for i in np.unravel_index(np.argmin(chance), chance.shape))
    least = float(chance[place, channel])
    return measured(fitted, spectra, place, least) if least < SEEN_BEFORE else None


def _doubt(swell: Swell) -> float:
    """Product of the amplitudes' standard errors, in logarithms."""
    return sum(math.log(max(x, 1e-12)) for x in swell.seen.stderrs.values()) if swell.seen else math.inf


def _chances(fitted: Fitted, spectra: Spectra) -> tuple[list[Around], FloatArray, int]:
    """What is around each channel's peaks, chances (f, 3) of such a peak at any frequency, how many are looked at."""
    power = np.mean(np.abs(spectra.rate) ** 2, axis=0)
    around = [around_of(spectra, p) for p in power.T]
    p_values = np.column_stack([chance_of(spectra, p, a) for p, a in zip(power.T, around, strict=True)])
    tried = int(np.isfinite(p_values).sum())
    chance = -np.expm1(tried * np.log1p(-np.minimum(np.nan_to_num(p_values, nan=1.0), 1 - 1e-16)))
    chance[_resonant(fitted, spectra) | (spectra.omega > fastest(fitted))] = 1.0
    return around, chance, tried


def fastest(fitted: Fitted) -> float:
    """Highest frequency, rad/s, at which a vessel meets waves long enough to move it: from ahead, in deep water."""
    stretches = fitted.problem.stretches
    speed = max(float(np.quantile(np.hypot(*s.states[:, 3:5].T), 0.95)) for s in stretches)
    number = 2.0 * math.pi / (SHORTEST * fitted.solution.structure.vessel.length)
    return math.sqrt(GRAVITY * number) + number * speed


def _resonant(fitted: Fitted, spectra: Spectra) -> BoolArray:
    """Frequencies (f,) at which an effect of the fit swings by itself: what excites it by chance there is no wave."""
    structure, p = fitted.solution.structure, fitted.solution.p
    own = [structure.values(p, k) for k, a in enumerate(structure.actives) if a.effect.fixed_terms]
    near = [core_of(spectra, values["frequency"]) for values in own]
    return np.asarray(np.any([np.zeros(len(spectra.omega), dtype=bool), *near], axis=0), dtype=bool)


def _stands(spectra: Spectra, place: int, channel: int, tried: int, least: float) -> bool:
    """Whether a peak stands in the windows where the vessel does not turn as fast, counted by how alike they are.

    A sensor's slow wander in the earth's axes is a peak at the rate of turn in the vessel's; and where a few windows
    are much louder than the others, the mean is known no better than those few tell.
    """
    slow = spectra.turning < SLOW_TURN * spectra.omega[place]
    if slow.sum() < 2 * TAPERS:
        return False
    rows = np.abs(spectra.rate[slow, :, channel]) ** 2
    around = around_of(spectra, rows.mean(axis=0))
    beside = np.abs(np.log(spectra.omega / spectra.omega[place])) < np.log(AROUND)
    beside &= ~core_of(spectra, spectra.omega[place])
    loud = by_window(rows[:, beside] / around.across(place)[beside]).mean(axis=1)
    n = TAPERS * np.sum(loud) ** 2 / np.sum(loud**2)
    ratio = rows[:, place].mean() / around.level[place]
    p = stats.f.sf(ratio, 2.0 * n, around.freedom[place] * n / len(rows))
    return bool(tried * p < least)


def _material(found: Swell, spectra: Spectra, around: Around, place: int, channel: int) -> bool:
    """Whether the band is narrow, and the waves are no higher than waves are, and above the noise over one window."""
    noise = around.level[place] * 2.0 * spectra.spacing / np.pi
    seen = found.seen
    if seen is None or not seen.sharpness < SHARP * found.frequency:
        return False
    if max(seen.amplitudes.get(c, 0.0) for c in "uv") > BREAKING:
        return False
    return bool(0.5 * seen.amplitudes.get(CHANNELS[channel], 0.0) ** 2 > noise)


def _goes_with(spectra: Spectra, place: int, channel: int, *, mostly: bool = False) -> bool:
    """Whether the peak is coherent with anything that the vessel did: surely; or perhaps, where that has a line.

    Perhaps is not enough where enough windows say that it accounts for the lesser part at most. Nor is surely where it
    is to be ``mostly``: a helmsman answers the waves, and his rudder is coherent with what they do.
    """
    force, n = spectra.rate[:, place, channel], len(spectra.rate)
    done = spectra.done[:, place]
    own = np.sum(np.abs(done) ** 2, axis=0)
    coherence = np.abs(force.conj() @ done) ** 2 / np.maximum(own * np.sum(np.abs(force) ** 2), 1e-300)
    most = min(float(coherence.max(initial=0.0)), 1.0)
    least = 1.0 - (1.0 - (1.0 - most) ** (n - 1)) ** max(len(coherence), 1)
    if least < COHERENT:
        return not mostly or _may_be_half(most, n)
    return bool(least < COHERENT_AT_LINE and _has_line(spectra, place) and _may_be_half(most, n))


def _grows_with(spectra: Spectra, place: int, channel: int) -> bool:
    """Whether a peak is the higher the more the vessel did in its band, whatever the phase.

    What swings by itself on board (a tank that is half full) answers every manoeuvre, and bends what it answers.
    """
    core = core_of(spectra, spectra.omega[place])
    power = by_window(np.abs(spectra.rate[:, core, channel]) ** 2).mean(axis=1)
    done = by_window(np.abs(spectra.done[:, core]) ** 2).mean(axis=1)
    busy = np.mean(done / np.maximum(done.mean(axis=0), 1e-300), axis=1)
    if not np.ptp(busy) > 0.0 or not np.ptp(power) > 0.0:
        return False
    order, third = np.argsort(busy), max(len(busy) // 3, 1)
    by = power[order[-third:]].mean() / max(power[order[:third]].mean(), 1e-300)
    chance = stats.spearmanr(busy, power, alternative="greater").pvalue
    return bool(by > GROWS and chance < GROWS_BY_CHANCE)


def _may_be_half(coherence: float, n: int) -> bool:
    """Whether a squared coherence that ``n`` rows show may be one half in truth (Fisher's z: Carter 1987)."""
    below = math.atanh(math.sqrt(0.5)) - math.atanh(math.sqrt(min(coherence, 1.0 - 1e-12)))
    return bool(stats.norm.sf(below * math.sqrt(2.0 * (n - 1))) > NOT_EXCLUDED)


def _has_line(spectra: Spectra, place: int) -> bool:
    """Whether anything that the vessel did has a line of its spectrum near a frequency."""
    near = slice(max(place - 1, 0), place + 2)
    for k in range(spectra.done.shape[2]):
        power = np.mean(np.abs(spectra.done[:, :, k]) ** 2, axis=0)
        if np.nanmin(chance_of(spectra, power, around_of(spectra, power))[near], initial=1.0) < COHERENT:
            return True
    return False
