"""From trials to what the estimators work on: stretches, pooled noise levels, and the declared structure."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.merged import merged
from identify.models import MODEL_BY_NAME
from identify.on_change import changes, with_changes_known
from identify.reference_speed import with_speed_from_motion
from identify.silent_inputs import known_inputs_alone
from identify.stretch import STREAMS, Stretch, sampled, step_for, stretches_of
from identify.structure import Structure, structure_for
from identify.usable import still, usable, why_none
from ingest.errors import NotIdentifiable
from preprocess.rounding import input_step
from preprocess.trial import Measurement, Trial
from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
#: Differences in time that are not looked at, s.
NEGLIGIBLE = 0.015
#: A receiver's errors wander if they do in this share of the logs, and in so many.
SHOWN, LEAST_SHOWN = 0.3, 2
#: ... by more than so many times what is as good as exact.
SMALL = 10.0


@dataclass(frozen=True)
class Prepared:
    """Stretches to identify on and to validate on, the declared structure, and notes for the report."""

    structure: Structure
    identify: tuple[Stretch, ...]
    validate: tuple[Stretch, ...]
    notes: tuple[str, ...]
    digest: str

    @property
    def speeds(self) -> tuple[float, float]:
        """Least and greatest speed ahead over ground in the logs to identify on, m/s."""
        ahead = np.concatenate([s.states[:, 3] for s in self.identify])
        return float(ahead.min()), float(ahead.max())


def prepare(trials: Sequence[Trial], model: str, *, held: bool = False) -> Prepared:
    """Pool noise levels over the logs, cut trials into stretches, and declare the model for this vessel.

    ``held`` takes every input for steps that hold until the next sample, whatever it looks like.

    Raises
    ------
    NotIdentifiable
        Where no trial has the role identify, none is long enough, or none shows any motion.
    """
    trials, silent = known_inputs_alone(_as_predicted(usable(trials), model))
    trials = with_common_inputs(with_pooled_noise(usable(trials, silent)), held)
    used = [t for t in trials if t.role == "identify"]
    h = step_for(trials[0].vessel.length)
    identify = tuple(merged(s) for t in used for s in stretches_of(t, h))
    if not identify:
        raise NotIdentifiable(why_none(used, silent))
    if all(map(still, used)):
        raise NotIdentifiable("the vessel does not move in any log to identify on: no sensor ever changes.")
    structure, notes = _declare(model, trials, used, identify)
    structure = with_speed_from_motion(structure, identify)
    validate = tuple(merged(s) for t in trials if t.role == "validate" for s in stretches_of(t, h))
    return Prepared(structure, identify, validate, (*notes, *silent), _digest(used))


def _as_predicted(trials: Sequence[Trial], model: str) -> list[Trial]:
    """The trials without the streams that the model does not predict: one of yaw alone says nothing of positions."""
    if model not in MODEL_BY_NAME or "x" in MODEL_BY_NAME[model].predicts:
        return list(trials)
    aside = ("position", "velocity")
    return [
        replace(t, measurements={k: m for k, m in t.measurements.items() if k not in aside}) for t in trials
    ]


def with_pooled_noise(trials: Sequence[Trial]) -> list[Trial]:
    """The same sensor has the same noise in every log: the median over the logs, and no less than makes sense.

    A search cannot begin with weights of a sensor that is a thousand times better than any model; what the noise
    really is, the prediction errors tell later.
    """
    exact = _least_noise(trials)
    trials = _with_pooled_drift(trials, SMALL * exact["position"])
    pooled = {
        s: max(float(np.median([t.measurements[s].sigma for t in trials if s in t.measurements])), least)
        for s, least in exact.items()
        if any(s in t.measurements for t in trials)
    }
    return [
        replace(
            t, measurements={k: replace(m, sigma=pooled.get(k, m.sigma)) for k, m in t.measurements.items()}
        )
        for t in trials
    ]


def _with_pooled_drift(trials: Sequence[Trial], least: float) -> list[Trial]:
    """A receiver's errors wander in every log as in those that show it; not at all where hardly any do, or by less.

    Where positions are seldom, a log may take for white noise what wanders in the next: those that tell are believed.
    """
    seen = [t.measurements["position"] for t in trials if "position" in t.measurements]
    found = [m for m in seen if m.wander > 0.0]
    if len(found) >= max(min(len(seen), LEAST_SHOWN), SHOWN * len(seen), 1):
        time = float(np.median([m.correlation_time for m in found]))
        size = float(np.sqrt(np.median([m.wander**2 / m.correlation_time for m in found]) * time))
        white = float(np.median([m.sigma for m in found]))
        told = {"sigma": white, "wander": size, "correlation_time": time, "smooth": _mostly(found)}
        if size > least:
            return [_with_position(t, **told) for t in trials]
    return [_with_position(t, wander=0.0, correlation_time=0.0) for t in trials]


def _mostly(found: Sequence[Measurement]) -> bool:
    """Whether most of these wander smoothly."""
    return 2 * sum(m.smooth for m in found) > len(found)


def _with_position(trial: Trial, **told: float) -> Trial:
    """The trial with what is told of its positions' errors, if it has any."""
    some = {k: replace(m, **told) for k, m in trial.measurements.items() if k == "position"}  # type: ignore[arg-type]
    return replace(trial, measurements={**trial.measurements, **some})


def with_common_inputs(trials: Sequence[Trial], held: bool) -> list[Trial]:
    """An input that holds its values between changes in one log does so in all; an output in PWM always does.

    So it is with the step to which its values were rounded: one log alone may show too few of its levels. Where changes
    are what is logged, what an input was before each is known.
    """
    trials = with_changes_known(trials)
    holds = {
        i.name: held or bool(i.pwm) or any(t.inputs[i.name].held for t in trials)
        for i in trials[0].inputs_declared
    }
    step = {
        i.name: input_step(i, np.concatenate([t.inputs[i.name].value[t.inputs[i.name].good] for t in trials]))
        for i in trials[0].inputs_declared
    }
    return [
        replace(t, inputs={k: replace(m, held=holds[k], quantum=step[k]) for k, m in t.inputs.items()})
        for t in trials
    ]


def _least_noise(trials: Sequence[Trial]) -> dict[str, float]:
    """Noise below which a sensor is as good as exact, by stream: a share of the length, of the speed and of the yaw."""
    states = np.vstack([t.states[["u", "r"]].dropna().to_numpy(dtype=float) for t in trials])
    speed, yaw = np.sqrt(np.mean(states**2, axis=0))
    length = trials[0].vessel.length
    return {
        "position": 3e-4 * length,
        "heading": 5e-4,
        "yaw_rate": 5e-3 * float(yaw),
        "velocity": 2e-3 * float(speed),
    }


def _declare(
    model: str, trials: Sequence[Trial], used: Sequence[Trial], stretches: Sequence[Stretch]
) -> tuple[Structure, tuple[str, ...]]:
    first, known = used[0], used[0].vessel.reference_speed
    speeds = np.concatenate([s.states[:, 3] for s in stretches])
    return structure_for(
        model,
        first.vessel if model != "mmg" else _with_rudder_sign(first.vessel, first.inputs_declared, stretches),
        first.inputs_declared,
        logs=tuple(dict.fromkeys(t.name for t in trials)),
        streams=tuple(s for s in STREAMS if s in first.measurements),
        depths=tuple({t.name: t.depth for t in trials}.values()),
        wind_logged="wind" in first.measurements,
        identify_logs=tuple(dict.fromkeys(t.name for t in used)),
        u0=known or float(np.quantile(speeds, 0.9)),
        u0_found=known is None,
        extents=_extents(used),
        input_lead=_input_lead(used),
        unsure=_unsure(used),
        one_receiver=all(_one_receiver(t) for t in trials),
    )


def _with_rudder_sign(vessel: Vessel, inputs: Sequence[Input], stretches: Sequence[Stretch]) -> Vessel:
    """The vessel with the sense of its rudder: 1 where positive angles turn it to starboard, as the motion says.

    A log's rudder may have either sign, and the flow at the rudder depends on it; what is declared stands.
    """
    rudders = [i.name for i in inputs if i.kind == "rudder"]
    if "sign" in vessel.rudder or not rudders:
        return vessel
    square, right = np.zeros((3, 3)), np.zeros(3)
    for s in stretches:
        angle = np.mean([sampled(s.inputs[n], s.start, s.h, s.steps)[0] for n in rudders], axis=0)
        r = s.states[:, 5]
        columns = np.column_stack([angle, 0.5 * (r[1:] + r[:-1]), np.ones(s.steps)])
        square += columns.T @ columns
        right += columns.T @ (np.diff(r) / s.h)
    turn = np.linalg.lstsq(square, right, rcond=None)[0][0]
    return replace(vessel, rudder={**vessel.rudder, "sign": -1.0 if turn < 0 else 1.0})


def _extents(trials: Sequence[Trial]) -> dict[str, tuple[float, float]]:
    """Half the range of every input over all logs, and its largest value without sign."""
    out = {}
    for item in trials[0].inputs_declared:
        values = np.concatenate([t.inputs[item.name].value[t.inputs[item.name].good] for t in trials])
        largest = float(np.abs(values).max(initial=0.0)) or 1.0
        out[item.name] = (float(np.ptp(values)) / 2 or largest, largest)
    return out


def _input_lead(trials: Sequence[Trial]) -> tuple[float, float] | None:
    """How far actuators may be ahead of inputs that are logged only every so often, mean and standard deviation.

    Or with stamps that only the order of the records tells.

    A command that holds has changed some time in the interval before it is seen: the mean is that of such inputs. Of a
    signal that varies all the time it is only unknown how it went between two samples; what never changes says nothing.
    """
    names = [n for n in trials[0].inputs if changes([t.inputs[n] for t in trials])]
    every = [t.inputs[n] for t in trials for n in names]
    longest = max((m.sample_time for m in every), default=0.0)
    holding = max((m.sample_time for m in every if m.held), default=0.0)
    unsure = max((m.unsure for t in trials for m in t.inputs.values()), default=0.0)
    if longest <= NEGLIGIBLE and unsure <= NEGLIGIBLE:
        return None
    return 0.5 * holding, float(np.hypot(longest / np.sqrt(12.0), unsure / np.sqrt(3.0)))


def _unsure(trials: Sequence[Trial]) -> dict[str, float]:
    """Standard deviation of the stamps of streams that only the order of the records tells, s: any within is as good.

    A position tells the time itself, and the receiver's velocity with it.
    """
    out: dict[str, float] = {}
    for stream in ("heading", "yaw_rate"):
        half = max((t.measurements[stream].unsure for t in trials if stream in t.measurements), default=0.0)
        out |= {stream: half / np.sqrt(3.0)} if half > NEGLIGIBLE else {}
    return out


def _one_receiver(trial: Trial) -> bool:
    """Whether the velocity comes with the position: then its stamps are as late."""
    position, velocity = (trial.measurements.get(s) for s in ("position", "velocity"))
    if position is None or velocity is None:
        return True
    return position.sender is not None and position.sender == velocity.sender


def _digest(trials: Sequence[Trial]) -> str:
    sha = hashlib.sha256()
    for trial in trials:
        sha.update(trial.name.encode())
        for m in (*trial.measurements.values(), *trial.inputs.values()):
            sha.update(np.ascontiguousarray(m.t).tobytes())
            sha.update(np.ascontiguousarray(m.value).tobytes())
    return sha.hexdigest()
