"""What is left when the stream ends: the model, and a few lines."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from identify.fit import Estimated, Fit
from identify.online.horizon import newest
from identify.report_fit import LARGEST_ERROR, fitted_effect
from identify.term import unit_of
from seatrial.online.estimator import Estimator
from seatrial.online.identifier import Identifier

STOPPED = "The estimate stopped where the stream ended."


def fit_of(identifier: Identifier) -> Fit | None:
    """The model as it was known at the end; None where there was never one."""
    estimator = identifier.estimator
    if estimator is None:
        return None
    structure, known = estimator.horizon.structure, estimator.known
    covariance = known.covariance
    own = [k for k, s in enumerate(structure.slots) if s.effect < 0 and s.coefficient >= 0]
    coefficients = tuple(_coefficient(estimator, k, float(np.sqrt(covariance[k, k]))) for k in own)
    made = [fitted_effect(structure, known.p, covariance, e) for e in range(len(structure.actives))]
    rows = np.vstack([np.eye(len(known.p))[own], *(jacobian for _, jacobian in made)])
    return Fit(
        structure.model.name, structure.vessel, structure.inputs, "output_error", "on line", 0, coefficients,
        tuple(effect for effect, _ in made), rows @ covariance @ rows.T, estimator.chi2, STOPPED, "",
        identifier.start.notes if identifier.start else (), structure.u0_at(known.p), _typical(estimator),
    )  # fmt: skip


def _coefficient(estimator: Estimator, k: int, stderr: float) -> Estimated:
    slot, value = estimator.horizon.structure.slots[k], float(estimator.known.p[k])
    text, dof = (slot.term.text, slot.term.dof) if slot.term else (slot.name, "")
    share = stderr / max(abs(value), 1e-12)
    reason = f"the standard error is {100 * share:.0f} % of the value" if share > LARGEST_ERROR else ""
    return Estimated(dof, slot.name, value, stderr, unit_of(text, dof), not reason, False, reason, text)


def _typical(estimator: Estimator) -> dict[str, float]:
    """Median of each input over the windows of the horizon."""
    windows = estimator.horizon.windows
    names = [i.name for i in estimator.horizon.structure.inputs]
    return {
        n: float(np.median(np.concatenate([w.inputs[n].value for w in windows]))) for n in names if windows
    }


def lines(identifier: Identifier, model: Path | None) -> Iterator[str]:
    """The end of an identification, for a person."""
    fit, estimator = fit_of(identifier), identifier.estimator
    if fit is None or estimator is None:
        lacking = f" (missing: {', '.join(identifier.tap.missing)})" if identifier.tap.missing else ""
        yield f"on line: no model was identified{lacking}"
        return
    sure = sum(c.identifiable for c in fit.coefficients)
    yield (
        f"on line: {fit.model} from {newest(estimator.horizon):.0f} s, {sure} of {len(fit.coefficients)} coefficients "
        f"known to within half, errors {np.sqrt(fit.chi2_per_dof):.2f} times the sensors' noise"
    )
    for change in estimator.changes:
        named = change.suspicion.named if change.suspicion else ()
        yield f"  a change at t = {change.at:.0f} s: " + (
            ", or ".join(s.label for s in named) if named else "nothing known"
        )
    if model is not None:
        yield f"  {model}"
