"""The estimate and its watch: blocks are tested as they come, windows are taken in while the model fits."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from identify.online.doubt import judged
from identify.online.horizon import Horizon, duration, estimate, recalibrated, slid, update, with_window
from identify.online.knowledge import Estimate
from identify.online.sequential import Monitor, monitor, reset, watched
from identify.online.surprise import Surprise, surprise
from identify.online.suspects import Suspicion, suspects
from identify.output_error import Solution, prior_for
from identify.regression import coefficient_scales
from identify.stretch import Stretch
from seatrial.online.updates import MONITOR, PARAMETERS, Note, Reading, Update
from seatrial.online.words import changed, fits_again, learning_anew, looks_like

#: False alarms: one in so long on average, s; ten hours then have more than one in one case of forty.
FALSE_ALARM_S = 144_000.0
#: After so many seconds of data since a change it is asked what it looks like.
ASK_AT_S = (20.0, 40.0, 80.0, 160.0)
#: A change that stays is learned after so long, s; what was known before then counts so much.
RELEARN_S, OLD_WORTH = 180.0, 0.02
#: Estimates of the past to which one can go back.
REMEMBERED = 8
#: The model fits again when the scores of so many blocks in a row are on average below this.
CALM_BLOCKS, CALM = 8, 1.0
#: The weak knowledge beforehand is renewed until so many windows have been seen.
PRIOR_WINDOWS = 10


@dataclass(frozen=True)
class Change:
    """An alarm that stands.

    Attributes
    ----------
    at : float
        When the change came, s.
    told : float
        When it was noticed, s.
    before : Horizon
    known : Estimate
        Of before the change.
    blocks : tuple of Stretch
        Since it was noticed, one after the other: the change came before all of them.
    asked : int
        How often it was asked what it looks like.
    suspicion : Suspicion, optional
        The last answer.
    """

    at: float
    told: float
    before: Horizon
    known: Estimate
    blocks: tuple[Stretch, ...] = ()
    asked: int = 0
    suspicion: Suspicion | None = None


@dataclass
class Estimator:
    """Takes blocks and windows in the order of time.

    Attributes
    ----------
    horizon : Horizon
    known : Estimate
        The latest; what blocks are predicted with.
    monitor : Monitor
    change : Change, optional
        While the model does not fit.
    """

    horizon: Horizon
    known: Estimate
    monitor: Monitor
    change: Change | None = None
    changes: list[Change] = field(default_factory=list)
    chi2: float = float("nan")
    _past: deque[tuple[float, Horizon, Estimate]] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    _scores: deque[float] = field(default_factory=lambda: deque(maxlen=CALM_BLOCKS))

    @classmethod
    def of(cls, horizon: Horizon, stride: float) -> Estimator:
        """An estimator of a horizon, whose blocks follow each other by ``stride`` s within a phase."""
        size = len(horizon.p)
        known = Estimate(horizon.p, horizon.past.dispersed + np.diag(1.0 / horizon.prior.sd**2))
        assert known.information.shape == (size, size)
        return cls(horizon, known, monitor(1.0 / FALSE_ALARM_S, stride))

    def test(self, block: Stretch, phase: int) -> Iterator[Update]:
        """Test one block that the estimate has not seen."""
        block = judged(self.horizon.structure, self.known.p, block, self.horizon.noise)
        found = surprise(self.horizon.structure, self.known, block, self.horizon.noise)
        if found is None:
            return
        before = self.monitor
        self.monitor = watched(before, found, phase, learn=self.change is None)
        self._scores.append(self.monitor.score)
        yield self._watching(found)
        if self.change is not None:
            yield from self._during(found, block, phase)
        elif self.monitor.alarm:
            yield from self._alarm(found)

    def take(self, window: Stretch, *, whole: bool) -> Iterator[Update]:
        """Learn from a window; one that is not whole yet counts until the next one."""
        if self.change is not None:
            return
        window = judged(self.horizon.structure, self.known.p, window, self.horizon.noise)
        horizon, solution = update(self.horizon, window, keep=whole)
        if not np.isfinite(solution.cost):
            return
        if whole:
            horizon = slid(self._renewed(recalibrated(horizon, solution)))
            horizon, solution = update(horizon, None) if horizon.windows else (horizon, solution)
        self.horizon = horizon
        seen = with_window(replace(horizon, p=solution.p), window) if not whole else horizon
        self.known = estimate(seen, solution)
        self.chi2 = chi2_per_dof(seen, solution)
        end = window.start + duration(window)
        self._past.append((end, self.horizon, self.known))
        yield self.parameters(end)

    def parameters(self, t: float) -> Reading:
        """Values and standard errors of all parameters."""
        sd = np.sqrt(np.maximum(np.diag(self.known.covariance), 0.0))
        values: dict[str, float] = {}
        for name, p, s in zip(names(self.horizon), self.known.p, sd, strict=True):
            values[name], values[f"{name}_stderr"] = float(p), float(s)
        return Reading(PARAMETERS, t, values, {})

    def _renewed(self, horizon: Horizon) -> Horizon:
        """The weak knowledge beforehand from all windows so far, while they are few."""
        if len(horizon.windows) > PRIOR_WINDOWS or horizon.past.at > 0.0:
            return horizon
        scales = coefficient_scales(horizon.structure, horizon.p, horizon.windows)
        return replace(horizon, prior=prior_for(horizon.structure, scales))

    def _watching(self, s: Surprise) -> Reading:
        m = self.monitor
        values = {
            "score": m.score, "sum": max(m.sums), "limit": m.limit, "alarm": float(m.alarm or self.change is not None),
            "size": s.size / s.freedom, "slow": s.slow / s.slow_freedom,
            "surge_acceleration": float(s.acceleration[0]), "sway_acceleration": float(s.acceleration[1]),
            "yaw_acceleration": float(s.acceleration[2]),
        }  # fmt: skip
        units = {"surge_acceleration": "m/s²", "sway_acceleration": "m/s²", "yaw_acceleration": "rad/s²"}
        return Reading(MONITOR, s.end, values, units)

    def _alarm(self, s: Surprise) -> Iterator[Update]:
        """Go back to what was known before the change."""
        at = self.monitor.changed_at
        earlier = [x for x in self._past if x[0] <= at + 1e-6] or list(self._past)[:1]
        horizon, known = (earlier[-1][1], earlier[-1][2]) if earlier else (self.horizon, self.known)
        self.horizon, self.known = horizon, known
        self.change = Change(at, s.end, horizon, known)
        self.changes.append(self.change)
        self._scores.clear()
        yield Note(s.end, changed(s, at), warning=True)

    def _during(self, s: Surprise, block: Stretch, phase: int) -> Iterator[Update]:
        change = self.change
        assert change is not None
        free_from = change.blocks[-1].start + duration(change.blocks[-1]) if change.blocks else change.told
        if block.start >= free_from - 1e-6:
            change = replace(change, blocks=(*change.blocks, block))
        seconds = sum(map(duration, change.blocks))
        if change.asked < len(ASK_AT_S) and seconds >= ASK_AT_S[change.asked] - 1e-6:
            scale = self.monitor.size.mean
            noise = change.before.noise
            earlier = change.suspicion
            found = suspects(change.before.structure, change.known, noise, change.blocks, scale, earlier)
            change = replace(change, asked=change.asked + 1, suspicion=found)
            yield Note(s.end, looks_like(found), warning=True)
        self.change = self.changes[-1] = change
        if len(self._scores) == CALM_BLOCKS and float(np.mean(self._scores)) < CALM:
            yield from self._over(s.end, fits_again(s.end))
        elif s.end - change.told > RELEARN_S:
            self._learn_anew(change)
            yield from self._over(s.end, learning_anew())

    def _over(self, at: float, text: str) -> Iterator[Update]:
        self.change = None
        self.monitor = reset(self.monitor, at)
        yield Note(at, text)

    def _learn_anew(self, change: Change) -> None:
        """What was known counts little; what came since the change is what there is to learn from."""
        old = slid(change.before, most=0)
        horizon = replace(old, past=old.past.faded(OLD_WORTH))
        for block in change.blocks:
            horizon = with_window(horizon, block)
        horizon, solution = update(horizon, None)
        self.horizon = recalibrated(horizon, solution)
        self.known = estimate(self.horizon, solution)
        self._past.clear()


def names(horizon: Horizon) -> list[str]:
    """Names of all parameters, those of effects with the effect's name."""
    structure = horizon.structure
    return [
        s.name if s.effect < 0 else f"{structure.actives[s.effect].effect.name}_{s.name}"
        for s in structure.slots
    ]


def chi2_per_dof(horizon: Horizon, solution: Solution) -> float:
    """Squared errors of the horizon's windows over the white noise of the sensors, per degree of freedom."""
    total, rows = 0.0, 0
    for window, residual in zip(horizon.windows, solution.moments.residuals, strict=False):
        kind = window.samples.kind
        total += float(np.sum(residual**2 * (horizon.noise.inflation[kind] ** 2)[:, None]))
        rows += len(kind) + int(np.isin(kind, (0, 3)).sum())
    return total / max(rows - 6 * len(horizon.windows) - len(solution.p), 1)
