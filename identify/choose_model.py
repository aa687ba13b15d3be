"""``auto``: the simplest model that the data support, by prediction of parts that the fit has not seen.

Everything happens inside the logs to identify on. Every model whose inputs the vessel has is fitted to all of them
over short windows, in which even a poor model cannot run far; then each part is left out in turn, the parameters are
fitted again from there, and the part is predicted over long windows. Fits begin in one way; only where none of them
comes to the sensors' noise are all begun in others too, for then a wrong valley may be why.

Where no model comes near the sensors' noise and there are several logs, it is whole logs that count: each model, and
one that is richer than windows could tell apart, is fitted free-running, each log left out in turn
(``identify.left_out``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identify.base_fit import LONG, finished, fit_from_scratch, fit_one_way, window_length
from identify.fitted import FAR, NEAR, SLOWLY, Fitted
from identify.left_out import joined_regularised
from identify.models import MODEL_BY_NAME, terms_for
from identify.prepare import Prepared, prepare
from identify.unseen_parts import squares_left_out
from ingest.errors import NotIdentifiable
from preprocess.cores import side_by_side
from preprocess.trial import Trial
from preprocess.vessel import Input, Vessel

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

#: Models that predict all of u, v, r, by number of terms; the discrete one is another form of its neighbour.
CONSIDERED = ("zhu2019", "linear", "modulus", "blanke", "cybership2", "taylor3", "abkowitz")
#: A model is as good as the best where its error is no more than this share larger.
AS_GOOD = 0.02
#: Models whose coefficients windows of a few logs could not tell; considered where whole logs are predicted.
RICH = ("taylor_modulus",)
#: Length of the windows that are fitted, s, where long ones are ``LONG``; less where there would not be so many to
#: leave out.
ROUGH, LEAST_WINDOWS = 10.0, 3


@dataclass(frozen=True)
class Considered:
    """A model that was tried.

    Attributes
    ----------
    name : str
    terms : int
    error : float
        Root mean square over u, v, r of the prediction error of unseen parts, in units of each channel's spread;
        where whole logs were left out the geometric mean over them.
    parts : tuple of float
        The same per part.
    note : str
        Why it was not tried, or nothing.
    """

    name: str
    terms: int
    error: float
    parts: tuple[float, ...] = ()
    note: str = ""


def choose_model(trials: Sequence[Trial], seed: int = 0) -> tuple[str, tuple[Considered, ...]]:
    """Choose the simplest model that predicts unseen parts within 2 % of the best.

    Parameters
    ----------
    trials : sequence of Trial
        Those with role identify are used.
    seed : int
        For symmetry with other choices; nothing here is random.

    Returns
    -------
    name : str
    table : tuple of Considered
        Best first; models that the inputs cannot drive come last with a note.

    Raises
    ------
    NotIdentifiable
        Where no model can be fitted.
    """
    del seed
    choice = considered(trials)
    if choice.far:
        choice = by_whole_logs(trials, choice)
    return choice.name, choice.table


@dataclass(frozen=True)
class Choice:
    """Which model was chosen, and what of: the table, best first, and the fits over short windows that it rests on.

    ``far``: there are several logs, and no model comes near the noise, so that whole logs should be asked.
    """

    name: str
    table: tuple[Considered, ...]
    fits: Mapping[str, Fitted]
    far: bool = False


def considered(trials: Sequence[Trial]) -> Choice:
    """The choice by windows alone."""
    used = [t for t in trials if t.role == "identify"]
    if not used:
        raise NotIdentifiable("no log has the role identify.")
    begun = side_by_side(partial(_begun, used), CONSIDERED)
    tried = side_by_side(partial(_tried, used, any(b.at_the_noise for b in begun)), begun)
    ranked = ranking([t.considered for t in tried])
    if not np.isfinite(ranked[0].error):
        raise NotIdentifiable("none of the models could be fitted to these logs.")
    fits = {t.considered.name: t.fitted for t in tried if t.fitted}
    return Choice(simplest(ranked), ranked, fits, _far_from_noise(tried))


def by_whole_logs(trials: Sequence[Trial], choice: Choice) -> Choice:
    """The choice by whole logs left out, of the models that windows were asked of and of richer ones."""
    used = [t for t in trials if t.role == "identify"]
    asked = [*(c for c in choice.table if c.name in choice.fits), *(_untried(used, name) for name in RICH)]
    others = [c for c in choice.table if c.name not in choice.fits]
    ranked = ranking([*side_by_side(partial(_over_whole_logs, used), asked), *others])
    return replace(choice, name=simplest(ranked), table=ranked)


def ranking(found: Sequence[Considered]) -> tuple[Considered, ...]:
    """Best first."""
    return tuple(sorted(found, key=lambda c: (not np.isfinite(c.error), c.error)))


def simplest(ranked: Sequence[Considered]) -> str:
    """The one with fewest terms among those as good as the best."""
    best = ranked[0].error
    good = [c for c in ranked if c.error <= (1.0 + AS_GOOD) * best]
    return min(good, key=lambda c: (c.terms, c.error)).name


def missing_inputs(name: str, vessel: Vessel, inputs: tuple[Input, ...]) -> str:
    """Why the inputs cannot drive a model; nothing where they can."""
    kinds = {i.kind for i in inputs}
    model = MODEL_BY_NAME[name]
    wants_rudder = any("δ" in t for t in (*model.sway, *model.yaw))
    if wants_rudder and "rudder" not in kinds:
        return "no rudder"
    if wants_rudder and kinds & {"azimuth", "tunnel"}:
        return "has no place for azimuths and tunnels"
    terms, _ = terms_for(model, vessel, inputs)
    driven = {t.dof for t in terms if t.role in ("thrust", "rudder")}
    return "" if "r" in driven else "nothing turns it: positions are missing"


@dataclass(frozen=True)
class _Begun:
    """A model, why it was not tried, or its rough fit begun in one way: as it came, and ``finished``."""

    name: str
    note: str = ""
    one_way: Fitted | None = None
    finished: Fitted | None = None

    @property
    def at_the_noise(self) -> bool:
        """Whether nothing is left of what it was fitted to."""
        return (
            self.finished is not None and self.finished.chi2_per_dof < NEAR and self.finished.slow <= SLOWLY
        )


@dataclass(frozen=True)
class _Tried:
    """A model with its rough fit, where there is one, and what it is worth over windows."""

    considered: Considered
    fitted: Fitted | None = None


def _begun(trials: Sequence[Trial], name: str) -> _Begun:
    first = trials[0]
    note = missing_inputs(name, first.vessel, first.inputs_declared)
    if note:
        return _Begun(name, note)
    prepared = prepare(trials, name)
    one_way = fit_one_way(prepared.structure, prepared.identify, length=_rough(prepared))
    return _Begun(name, "", one_way, finished(one_way, rounds=0, fine=False))


def _tried(trials: Sequence[Trial], enough: bool, begun: _Begun) -> _Tried:
    """What a model predicts of parts that are left out; unless one way is ``enough``, begun in others too."""
    if begun.one_way is None or begun.finished is None:
        return _Tried(Considered(begun.name, 0, np.inf, (), begun.note))
    prepared, fitted = prepare(trials, begun.name), begun.finished
    terms = len(prepared.structure.setting.terms)
    if not enough:
        structure, stretches, length = prepared.structure, prepared.identify, _rough(prepared)
        fitted = fit_from_scratch(
            structure, stretches, length=length, rounds=0, fine=False, begun=begun.one_way
        )
    if not np.isfinite(fitted.solution.cost):
        return _Tried(Considered(begun.name, terms, np.inf, (), "ran away"))
    return _Tried(_of_squares(begun.name, terms, squares_left_out(prepared, fitted)), fitted)


def _rough(prepared: Prepared) -> float:
    """Length of the windows, s: of a single short log at least three are made, so that one can be left out."""
    rough = window_length(prepared.structure.vessel.length) * ROUGH / LONG
    longest = max(s.steps * s.h for s in prepared.identify)
    return min(rough, longest / LEAST_WINDOWS) if len(prepared.identify) == 1 else rough


def _of_squares(name: str, terms: int, squares: Sequence[tuple[float, int]]) -> Considered:
    total = sum(s for s, _ in squares) / max(sum(n for _, n in squares), 1)
    parts = tuple(float(np.sqrt(s / max(n, 1))) for s, n in squares)
    return Considered(name, terms, float(np.sqrt(total)), parts)


def _far_from_noise(tried: Sequence[_Tried]) -> bool:
    """Whether there are several logs and no model comes near the noise over even short windows."""
    fitted = [t.fitted for t in tried if t.fitted is not None]
    several = len({s.name for s in fitted[0].problem.stretches}) > 2
    return several and min(f.chi2_per_dof for f in fitted) > FAR


def _over_whole_logs(trials: Sequence[Trial], one: Considered) -> Considered:
    """The model's error over logs that were left out, with the prior that predicts those best."""
    if one.note:
        return one
    prepared = prepare(trials, one.name)
    found = joined_regularised(prepared.structure, prepared.identify)
    if found is None:
        return replace(one, error=np.inf, parts=(), note="runs away over whole logs")
    return replace(one, error=found.error, parts=tuple(map(float, found.errors)))


def _untried(trials: Sequence[Trial], name: str) -> Considered:
    """A model that only whole logs can tell the coefficients of."""
    first = trials[0]
    note = missing_inputs(name, first.vessel, first.inputs_declared)
    terms = 0 if note else len(prepare(trials, name).structure.setting.terms)
    return Considered(name, terms, np.inf, (), note)
