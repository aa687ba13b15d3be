"""What the rounding of logged inputs does to free runs: an effect that does no more for them is not told from it.

A pulse width is written down in whole microseconds. In a log with one speed of the propeller that leaves the thrust a
fraction of a percent off from beginning to end, as if this log's water or load were another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.chain import spreads
from identify.fitted import Fitted
from identify.predict import relative_errors
from identify.stretch import Stretch
from preprocess.trial import Measurement

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: So many draws of which values were rounded up and which down.
DRAWS = 4
#: Values that are whole steps of less than this share of their range are not rounded, those of more were chosen.
FINE, COARSE = 1e-4, 1 / 40


@dataclass(frozen=True)
class Scale:
    """The values that an input is logged in: the lowest, the step between neighbours, and how many there are."""

    lowest: float
    step: float
    levels: int

    def off(self, measured: Measurement, draw: int) -> Measurement:
        """Every value half a step off, up or down by chance; the same value always the same way."""
        up = np.random.default_rng(draw).random(self.levels) < 0.5
        above = np.nan_to_num(measured.value, nan=self.lowest) - self.lowest
        place = np.round(above / self.step).astype(int)
        return replace(measured, value=measured.value + self.step * (up[place] - 0.5))


def done_by_rounding(fitted: Fitted) -> float:
    """Mean squared change of free-running u, v, r, each in units of its spread, with every input off by half a step.

    The three are summed. The step is the longest of which all differences between an input's logged values are whole
    multiples; what is logged finely, or takes a few values only, is not rounded.
    """
    stretches = fitted.problem.stretches
    scales = {name: scale for name in stretches[0].inputs if (scale := scale_of(name, stretches))}
    if not scales:
        return 0.0
    changed = sum(
        _changed(fitted, stretch, spread, scales)
        for stretch, spread in zip(stretches, spreads(stretches), strict=True)
    )
    return changed / (DRAWS * sum(s.steps + 1 for s in stretches))


def scale_of(name: str, stretches: Sequence[Stretch]) -> Scale | None:
    """The values that an input is logged in, in all stretches; None where these are not rounded."""
    values = np.unique(np.concatenate([s.inputs[name].value for s in stretches]))
    values = values[np.isfinite(values)]
    extent = float(np.ptp(values)) if len(values) else 0.0
    # ahead and astern a pulse width may count differently
    steps = [
        common_step(np.diff(half), FINE * extent) for half in (values[values >= 0.0], values[values <= 0.0])
    ]
    step = min((s for s in steps if s is not None), default=0.0)
    within = FINE * extent < step < COARSE * extent
    return Scale(float(values[0]), step, round(extent / step) + 1) if within else None


def common_step(steps: FloatArray, least: float) -> float | None:
    """The longest step of which all are whole multiples (Euclid); 0 if no longer than ``least``, None of no steps."""
    if not len(steps):
        return None
    found = float(steps[0])
    for other in steps:
        step = float(other)
        while step > least:
            found, step = step, found % step
        if found <= 2.0 * least:
            return 0.0
    return found


def _changed(fitted: Fitted, stretch: Stretch, spread: FloatArray, scales: dict[str, Scale]) -> float:
    """Sum over a stretch and all draws of the squared changes of its free run, in units of ``spread`` (3,)."""
    structure, p = fitted.solution.structure, fitted.solution.p
    as_logged, total = relative_errors(structure, p, stretch, spread), 0.0
    for draw in range(DRAWS):
        inputs = {n: scales[n].off(m, draw) if n in scales else m for n, m in stretch.inputs.items()}
        off = relative_errors(structure, p, replace(stretch, inputs=inputs), spread)
        total += float(np.sum((off - as_logged) ** 2))
    return total
