"""model.json: an identified model that can be read back."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from identify.fit import Estimated, Fit, FittedEffect
from ingest.errors import UsageError
from validate.report.contents import seatrial_version
from validate.report.schema import MODEL, ModelEffectEntry, ModelFile, ModelParameterEntry, to_json

#: What of a fit goes into ``provenance``, under its own name.
FROM_FIT = (
    "estimator", "optimiser", "seed", "chi2_per_dof", "stopped", "digest", "notes", "u0", "typical_inputs",
    "largest_inputs", "misfit", "speeds",
)  # fmt: skip


class ModelFileError(UsageError):
    """A file that should hold an identified model does not."""

    def __init__(self, path: Path, where: str, problem: str) -> None:
        self.path, self.where, self.problem = path, where, problem
        super().__init__(f"{path}: {where}: {problem}. Give the model.json of a results folder.")


def model_schema() -> dict[str, Any]:
    """The JSON schema of model.json."""
    return ModelFile.model_json_schema(by_alias=True, mode="serialization")


def write_model(fit: Fit, path: Path, provenance: Mapping[str, object] | None = None) -> None:
    """Write an identified model.

    Parameters
    ----------
    fit : Fit
        The model; NaN becomes null.
    path : Path
        The file to write.
    provenance : mapping, optional
        Facts to keep beside those of the fit (campaign, scores, …).
    """
    own = {key: getattr(fit, key) for key in FROM_FIT}
    file = ModelFile(
        schema=MODEL,
        model=fit.model,
        vessel=fit.vessel,
        inputs=list(fit.inputs),
        parameters=[_parameter_entry(p) for p in fit.coefficients],
        covariance=fit.covariance.tolist(),
        effects=[_effect_entry(e) for e in fit.effects],
        provenance={"seatrial_version": seatrial_version(), **(provenance or {}), **own},
    )
    path.write_text(to_json(file), encoding="utf-8")


def read_model(path: Path) -> Fit:
    """Read what `write_model` wrote.

    Parameters
    ----------
    path : Path
        A model.json.

    Returns
    -------
    Fit
        Equal to the one that was written.

    Raises
    ------
    ModelFileError
        Where the file is not there or does not hold a model; says which key and why.
    """
    file = _parse(path)
    _check_covariance(path, file)
    provenance = file.provenance
    return Fit(
        model=file.model,
        vessel=file.vessel,
        inputs=tuple(file.inputs),
        estimator=str(provenance.get("estimator", "")),
        optimiser=str(provenance.get("optimiser", "")),
        seed=int(provenance.get("seed") or 0),
        coefficients=tuple(_estimated(p) for p in file.parameters),
        effects=tuple(_fitted(e) for e in file.effects),
        covariance=np.array(file.covariance, dtype=np.float64),
        chi2_per_dof=_number(provenance.get("chi2_per_dof")),
        stopped=str(provenance.get("stopped", "")),
        digest=str(provenance.get("digest", "")),
        notes=tuple(provenance.get("notes") or ()),
        u0=provenance.get("u0"),
        typical_inputs=provenance.get("typical_inputs") or {},
        largest_inputs=provenance.get("largest_inputs") or {},
        misfit=float(provenance.get("misfit") or 1.0),
        speeds=_pair(provenance.get("speeds")),
    )


def _parse(path: Path) -> ModelFile:
    try:
        return ModelFile.model_validate(
            json.loads(path.read_text(encoding="utf-8"), parse_constant=_no_number)
        )
    except OSError as error:
        raise ModelFileError(path, "cannot be read", error.strerror or str(error)) from error
    except ValidationError as error:
        first = error.errors()[0]
        raise ModelFileError(path, ".".join(map(str, first["loc"])) or "file", first["msg"]) from error
    except ValueError as error:
        raise ModelFileError(path, "is not JSON", str(error)) from error


def _no_number(text: str) -> None:
    """Python reads what JSON does not have; a value that is not known is null."""
    raise ValueError(f"{text} is no number, a value that is not known is null")


def _check_covariance(path: Path, file: ModelFile) -> None:
    """The covariance has a row and a column for every parameter."""
    named = len(file.parameters) + sum(len(e.parameters) for e in file.effects)
    lengths = {len(row) for row in file.covariance} or {0}
    if len(file.covariance) != named or lengths != {named}:
        found = f"{len(file.covariance)} rows of {' or '.join(map(str, sorted(lengths)))}"
        problem = f"expected {named} rows of {named}, one for each parameter, found {found}"
        raise ModelFileError(path, "covariance", problem)


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _pair(values: Sequence[float] | None) -> tuple[float, float] | None:
    return None if values is None else (float(values[0]), float(values[1]))


def _parameter_entry(p: Estimated) -> ModelParameterEntry:
    return ModelParameterEntry.model_validate(asdict(p))


def _effect_entry(e: FittedEffect) -> ModelEffectEntry:
    return ModelEffectEntry(
        name=e.name,
        input=e.input,
        parameters=[_parameter_entry(p) for p in e.parameters],
        options=dict(e.options),
    )


def _estimated(entry: ModelParameterEntry) -> Estimated:
    known = entry.model_dump()
    return Estimated(**known | {"value": _number(entry.value), "stderr": _number(entry.stderr)})


def _fitted(entry: ModelEffectEntry) -> FittedEffect:
    return FittedEffect(
        entry.name, entry.input, tuple(_estimated(p) for p in entry.parameters), entry.options
    )
