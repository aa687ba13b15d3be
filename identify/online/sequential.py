"""A sequential test with a stated rate of false alarms: cumulative sums of normal scores.

Each block's statistics become a normal score: standard normal as long as the model fits, by the distribution that the
statistics have had so far (gamma, with the mean and variance that theory gives, corrected by those that were found).
The sums restart at zero; their threshold follows from the rate by Siegmund's approximation of the average run length
(Siegmund 1985, eq. 2.56), so nothing is tuned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from scipy import optimize, special, stats

from identify.online.surprise import Surprise

#: Half the shift, in standard deviations, that the sums are the quickest to find.
REFERENCE = 1.0
#: Blocks that theory is worth when the distribution is learned.
WORTH = 12.0
#: A score above this, or below its negative, teaches nothing of the distribution.
LEARN_BELOW = 2.5
#: No block counts more.
MOST = 8.0


def threshold(run_length: float, reference: float = REFERENCE) -> float:
    """Threshold of a cumulative sum of normal scores for an average number of blocks between false alarms."""

    def excess(h: float) -> float:
        x = 2.0 * reference * (h + 1.166)
        return (math.exp(x) - x - 1.0) / (2.0 * reference**2) - run_length

    return float(optimize.brentq(excess, -1.1, 60.0 / reference))


@dataclass(frozen=True)
class Learned:
    """A statistic over its expectation: how many blocks it was seen in, mean, and mean square about 1."""

    count: float = 0.0
    mean: float = 1.0
    spread: float = 0.0

    def after(self, ratio: float, expected_variance: float) -> Learned:
        """With one more block; ``expected_variance`` is that of the ratio by theory."""
        count = min(self.count + 1.0, 400.0)
        mean = self.mean + (ratio - self.mean) / (count + WORTH)
        excess = (ratio - mean) ** 2 / expected_variance
        before = self.spread if self.count else 1.0
        return Learned(count, mean, before + (excess - before) / (count + WORTH))

    def upper(self, value: float, freedom: float) -> float:
        """Probability of a value as large or larger."""
        variance = (2.0 / freedom) * max(self.spread if self.count else 1.0, 1.0)
        shape = self.mean**2 / variance
        return float(special.gammaincc(shape, value / freedom * shape / self.mean))


@dataclass(frozen=True)
class Monitor:
    """The test's state.

    Attributes
    ----------
    limit : float
        Threshold of the sums.
    size, slow : Learned
        Distributions of both statistics.
    sums : tuple of float
        One per phase of the blocks, which overlap those of the other.
    since : tuple of float
        Where each sum was zero last, s.
    score : float
        Of the last block.
    alarm : bool
    """

    limit: float
    size: Learned = Learned()
    slow: Learned = Learned()
    sums: tuple[float, ...] = (0.0, 0.0)
    since: tuple[float, ...] = (0.0, 0.0)
    score: float = 0.0
    alarm: bool = False

    @property
    def changed_at(self) -> float:
        """When the change seems to have come, s: where the largest sum began."""
        return self.since[max(range(len(self.sums)), key=lambda k: self.sums[k])]


def monitor(rate: float, stride: float, phases: int = 2) -> Monitor:
    """A test.

    Parameters
    ----------
    rate : float
        False alarms per second, in all.
    stride : float
        Time from one block to the next of one phase, s.
    phases : int
        Interleaved series of blocks, each tested by itself at its share of the rate.
    """
    run_length = phases / (rate * stride)
    return Monitor(threshold(run_length), sums=(0.0,) * phases, since=(0.0,) * phases)


def score_of(m: Monitor, block: Surprise) -> float:
    """Normal score of a block: the less probable of both statistics, counted as the smaller of two."""
    least = min(m.size.upper(block.size, block.freedom), m.slow.upper(block.slow, block.slow_freedom))
    probability = 1.0 - (1.0 - min(least, 1.0)) ** 2
    return float(min(stats.norm.isf(max(probability, 1e-300)), MOST))


def watched(m: Monitor, block: Surprise, phase: int, *, learn: bool = True) -> Monitor:
    """The test after one more block of a phase."""
    score = score_of(m, block)
    before = m.sums[phase]
    total = max(0.0, before + score - REFERENCE)
    sums = tuple(total if k == phase else x for k, x in enumerate(m.sums))
    since = tuple((block.start if before == 0.0 else x) if k == phase else x for k, x in enumerate(m.since))
    alarm = total > m.limit
    taught = replace(m, sums=sums, since=since, score=score, alarm=alarm)
    return _taught(taught, block) if learn and not alarm and abs(score) < LEARN_BELOW else taught


def _taught(m: Monitor, block: Surprise) -> Monitor:
    size = m.size.after(block.size / block.freedom, 2.0 / block.freedom)
    slow = m.slow.after(block.slow / block.slow_freedom, 2.0 / block.slow_freedom)
    return replace(m, size=size, slow=slow)


def reset(m: Monitor, at: float) -> Monitor:
    """The test begun anew, with what it has learned."""
    return replace(m, sums=(0.0,) * len(m.sums), since=(at,) * len(m.sums), alarm=False)
