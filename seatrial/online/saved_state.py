"""The state of an identification in a file, to go on from after a restart or the next day.

What is kept: the parameters with all that is known of them (windows of the horizon absorbed), the noise of the sensors,
the levels of the observer, how the inputs are read, what the monitor has learned. One JSON file, written whole or not
at all.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.online.horizon import Horizon, slid
from identify.online.knowledge import Knowledge, Noise
from identify.online.sequential import Learned
from identify.output_error import Prior
from identify.stretch import STREAMS
from identify.structure import Structure, structure_for
from ingest.errors import UsageError
from preprocess.causal import CausalLevels
from seatrial.campaign.data import Campaign
from seatrial.online.estimator import Estimator
from seatrial.online.identifier import Identifier
from seatrial.online.stream_buffer import InputTraits
from seatrial.online.updates import Note
from seatrial.online.warm_up import Beginning

SCHEMA = "seatrial.online/1"


def save(identifier: Identifier, path: Path) -> None:
    """Keep the state; while a change stands, that of before the change."""
    start, estimator = identifier.start, identifier.estimator
    if start is None or estimator is None:
        return
    horizon = slid(estimator.change.before if estimator.change else estimator.horizon, most=0)
    content = {
        "schema": SCHEMA,
        "declared": declared(horizon.structure),
        "structure": {
            "streams": list(horizon.structure.setting.streams), "wind": horizon.structure.setting.wind_logged,
            "u0": horizon.structure.u0, "extents": dict(horizon.structure.extents),
            "input_lead": horizon.structure.input_lead, "unsure": dict(horizon.structure.unsure),
            "u0_found": horizon.structure.u0_found,
            "one_receiver": horizon.structure.setting.one_receiver,
        },
        "names": [s.name for s in horizon.structure.slots],
        "p": horizon.p.tolist(),
        "prior": {"mean": horizon.prior.mean.tolist(), "sd": _finite(horizon.prior.sd)},
        "information": horizon.past.information.tolist(),
        "vector": horizon.past.vector.tolist(),
        "dispersed": horizon.past.dispersed.tolist(),
        "noise": {k: getattr(horizon.noise, k).tolist() for k in ("sigma", "inflation", "dispersion")},
        "levels": asdict(start.levels) | {"sigma": _finite(np.array(start.levels.sigma))},
        "traits": {k: asdict(t) for k, t in start.traits.items()},
        "quantum": start.quantum.tolist(),
        "learned": {k: asdict(getattr(estimator.monitor, k)) for k in ("size", "slow")},
        "chi2": estimator.chi2 if np.isfinite(estimator.chi2) else None,
    }  # fmt: skip
    unfinished = path.with_name(f"{path.name}.unfinished")
    unfinished.write_text(json.dumps(content), encoding="utf-8")
    unfinished.replace(path)


def restored(identifier: Identifier, path: Path) -> list[Note]:
    """Put a saved state into an identifier that has seen nothing yet.

    Raises
    ------
    UsageError
        The file is no state, or that of another vessel or model.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["schema"] != SCHEMA:
            raise UsageError(
                f"{path}: expected a state of the on-line identification ({SCHEMA}), found another."
            )
        structure = _structure(identifier.campaign, content)
        if content["declared"] != declared(structure) or len(content["p"]) != len(structure.slots):
            raise UsageError(
                f"{path}: this state is of another vessel, model or set of inputs; name another file to begin anew."
            )
        _put(identifier, structure, content)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(f"{path}: this is no state of the on-line identification ({error}).") from error
    return [Note(0.0, f"going on from {path.name}")]


def declared(structure: Structure) -> dict[str, Any]:
    """What must be the same for a state to be taken up."""
    text = json.dumps(
        {"model": structure.model.name, "vessel": asdict(structure.vessel),
         "inputs": [asdict(i) for i in structure.inputs]}, default=dict
    )  # fmt: skip
    return dict(json.loads(text))


def _structure(campaign: Campaign, content: dict[str, Any]) -> Structure:
    known = content["structure"]
    model = content["declared"]["model"] if campaign.model == "auto" else campaign.model
    lead = known["input_lead"]
    structure, _ = structure_for(
        model, campaign.vessel, campaign.inputs, logs=("live",), identify_logs=("live",),
        streams=tuple(s for s in STREAMS if s in known["streams"]), wind_logged=bool(known["wind"]),
        u0=float(known["u0"]), extents=_extents(known),
        input_lead=None if lead is None else (float(lead[0]), float(lead[1])),
        unsure=dict(known.get("unsure", {})), one_receiver=bool(known.get("one_receiver", False)),
        u0_found=bool(known.get("u0_found", False)),
    )  # fmt: skip
    return structure


def _extents(known: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Extents of the inputs; an older state has half their ranges alone."""
    older = {k: (a, np.inf) for k, a in known.get("amplitudes", {}).items()}
    return {k: (float(a), float(b)) for k, (a, b) in known.get("extents", older).items()}


def _put(identifier: Identifier, structure: Structure, content: dict[str, Any]) -> None:
    prior = Prior(np.array(content["prior"]["mean"]), _infinite(content["prior"]["sd"]))
    noise = Noise(**{k: np.array(v) for k, v in content["noise"].items()})
    levels = content["levels"]
    rate, antenna = tuple(levels["rate"]), tuple(levels["antenna"])
    sigma = tuple(np.nan if s is None else float(s) for s in levels["sigma"])
    causal = CausalLevels(float(levels["q_heading"]), float(levels["q_track"]), sigma, rate, antenna)  # type: ignore[arg-type]
    traits = {k: InputTraits(**t) for k, t in content["traits"].items()}
    p = np.array(content["p"])
    identifier.start = Beginning(structure, prior, p, noise, causal, traits, np.array(content["quantum"]))
    information, vector, dispersed = (np.array(content[k]) for k in ("information", "vector", "dispersed"))
    past = Knowledge(information, vector, dispersed)
    horizon = Horizon(structure, prior, p, noise, past, forget=identifier.forget)
    estimator = Estimator.of(horizon, identifier.block)
    size, slow = (Learned(**content["learned"][k]) for k in ("size", "slow"))
    estimator.monitor = replace(estimator.monitor, size=size, slow=slow)
    estimator.chi2 = float("nan") if content["chi2"] is None else float(content["chi2"])
    identifier.estimator = estimator


def _finite(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]


def _infinite(values: list[float | None]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array([np.inf if v is None else v for v in values])
