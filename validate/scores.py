"""How well a fit predicts, free-running, against the smoothed measurement."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from identify.predict import free_run
from identify.stretch import Stretch
from identify.structure import Structure
from validate.diagnosis import ChannelScore, LogScore, Validation

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

CHANNELS = ("u", "v", "r")
_COLUMN = {"x": 0, "y": 1, "psi": 2, "u": 3, "v": 4, "r": 5}
_NOTHING = ChannelScore(None, None, None, None)


def held_after_running_away(prediction: FloatArray) -> FloatArray:
    """A prediction (n, 6) that ran away keeps its last finite value."""
    good = np.asarray(np.isfinite(prediction).all(axis=1), dtype=bool)
    if good.all():
        return prediction
    last = prediction[good][-1] if good.any() else np.zeros(prediction.shape[1])
    return np.where(good[:, None], prediction, last)


def predictions(structure: Structure, p: FloatArray, stretches: Iterable[Stretch]) -> list[FloatArray]:
    """Free-running prediction (steps + 1, 6) of every stretch."""
    return [held_after_running_away(free_run(structure, p, s)) for s in stretches]


def score(measured: FloatArray, predicted: FloatArray, channel: str, predicts: Sequence[str]) -> ChannelScore:
    """Scores of one channel from states (n, 6); None where the model does not predict it."""
    if channel not in predicts or len(measured) == 0:
        return _NOTHING
    k = _COLUMN[channel]
    mse = float(np.mean((predicted[:, k] - measured[:, k]) ** 2))
    spread = float(np.var(measured[:, k])) or 1e-12
    return ChannelScore(mse, mse**0.5, 1.0 - mse / spread, (mse / spread) ** 0.5)


def pooled(
    structure: Structure, stretches: Sequence[Stretch], predicted: Sequence[FloatArray]
) -> dict[str, ChannelScore]:
    """Scores of all of some stretches together, per channel."""
    pairs = [(s.states, q) for s, q in zip(stretches, predicted, strict=True)]
    return _channels(pairs, structure.model.predicts)


def validation(
    structure: Structure, stretches: Sequence[Stretch], predicted: Sequence[FloatArray]
) -> Validation:
    """Pooled scores of the stretches with role validate, and scores of every log."""
    predicts = structure.model.predicts
    names = dict.fromkeys((s.name, s.role) for s in stretches)
    logs = []
    for name, role in names:
        pairs = [
            (s.states, q)
            for s, q in zip(stretches, predicted, strict=True)
            if (s.name, s.role) == (name, role)
        ]
        logs.append(LogScore(name, role, _channels(pairs, predicts)))
    unseen = [(s.states, q) for s, q in zip(stretches, predicted, strict=True) if s.role == "validate"]
    channels = _channels(unseen, predicts)
    scores = [c.mse for c in channels.values() if c.mse is not None]
    full = "u" in predicts
    return Validation(
        channels,
        float(sum(scores)) if scores else None,
        _rmse(unseen, (0, 1)) if full else None,
        _rmse(unseen, (2,)),
        tuple(logs),
    )


def _channels(
    pairs: Sequence[tuple[FloatArray, FloatArray]], predicts: Sequence[str]
) -> dict[str, ChannelScore]:
    if not pairs:
        return dict.fromkeys(CHANNELS, _NOTHING)
    measured, predicted = (np.vstack(x) for x in zip(*pairs, strict=True))
    return {c: score(measured, predicted, c, predicts) for c in CHANNELS}


def _rmse(pairs: Sequence[tuple[FloatArray, FloatArray]], columns: tuple[int, ...]) -> float | None:
    if not pairs:
        return None
    measured, predicted = (np.vstack(x)[:, columns] for x in zip(*pairs, strict=True))
    return float(np.sqrt(np.mean(np.sum((predicted - measured) ** 2, axis=1))))
