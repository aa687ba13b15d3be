"""The whole pipeline: from the bytes of the logs to the results folder, in a handful of calls."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ingest import read_log
from ingest.log import Log
from preprocess.cores import on_cores
from preprocess.run_of_log import LoggedRun
from preprocess.same_day import on_one_day
from preprocess.trial import Trial
from preprocess.trials import make_trials
from seatrial.blas import one_blas_thread
from seatrial.campaign import Campaign, LogEntry, check_against, check_number, with_options
from seatrial.compiled_code import forget_stale_code
from seatrial.parallel import map_tasks
from seatrial.progress import Progress, Stopwatch, silent
from seatrial.remarks import remarks_on, require_unseen
from seatrial.results_folder import check_replaceable, in_place
from validate.diagnosis import MATERIALITY, Diagnosis, Results, Verdict

if TYPE_CHECKING:
    from identify.choose_model import Choice

#: Logs of less than this in all are read faster here than in processes of their own, bytes.
WORTH_PROCESSES = 50_000_000


@one_blas_thread()
def run(
    campaign: Campaign,
    out: str | os.PathLike[str] | None = None,
    *,
    model: str | None = None,
    estimator: str | None = None,
    optimiser: str | None = None,
    seed: int = 0,
    workers: int = 1,
    loop: bool = True,
    materiality: float = MATERIALITY,
    progress: Progress = silent,
) -> Results:
    """Ingest, preprocess, identify, validate, and find out what the model lacks.

    Parameters
    ----------
    campaign : Campaign
        From ``load_campaign``.
    out : path-like, optional
        The results folder; written whole or not at all. Without it nothing is written.
    model, estimator, optimiser : str, optional
        In place of what the campaign says.
    seed : int
        Same seed, same results.
    workers : int
        Processes on this machine. From a script, more than one needs ``if __name__ == "__main__":``.
    loop : bool
        Search for what the model lacks.
    materiality : float
        Share of a channel's standard deviation above which structure that stays unexplained counts.
    progress : callable
        Told ``(stage, text, fraction)`` as the work goes on.

    Raises
    ------
    UsageError
        An option, a log or a signal is wrong (exit status 2 on the command line).
    DataError
        The data cannot give an answer (exit status 1).
    """
    campaign = with_options(campaign, model, estimator, optimiser)
    check_number("seed", seed, 0)
    check_number("workers", workers, 1)
    if out is not None:
        check_replaceable(Path(out))
    forget_stale_code()
    watch = Stopwatch(progress)
    with on_cores(workers):
        results = _results(campaign, workers, seed, loop, materiality, watch)
    if out is not None:
        write(results, Path(out), watch)
    return results


def _results(
    campaign: Campaign, workers: int, seed: int, loop: bool, materiality: float, watch: Stopwatch
) -> Results:
    """From the bytes of the logs to what is known of the vessel."""
    logs = read_logs(campaign, workers, watch)
    runs = runs_of(campaign, logs)
    trials = _trials(campaign, runs, watch, by_response=not loop)
    if loop:
        require_unseen(campaign.path, runs, trials)
    from validate.analysis import analyse  # compiled code: loaded once the data are known to be good

    chosen = chosen_model(trials, campaign.model, watch, loop=loop)
    analysed = partial(
        analyse,
        trials,
        estimator=campaign.estimator,
        optimiser=campaign.optimiser,
        seed=seed,
        loop=loop,
        materiality=materiality,
        grows=campaign.model == "auto",
        progress=watch,
    )
    found = analysed(model=chosen.name)
    if chosen.other and not _stands(chosen, found.diagnosis):
        chosen = chosen.other()
        found = analysed(model=chosen.name)
    name, said = chosen.name, chosen.said
    if found.before.model != name:
        said = (
            *said,
            f"With the terms that it was found to lack it is '{found.before.model}', which was taken.",
        )
    return Results(
        campaign=str(campaign.path),
        logs=tuple(logs),
        trials=tuple(trials),
        before=replace(found.before, notes=(*said, *found.before.notes)),
        after=replace(found.after, notes=(*said, *found.after.notes)),
        validation_before=found.validation_before,
        validation_after=found.validation_after,
        diagnosis=found.diagnosis,
        predictions=found.predictions,
        actuators=found.actuators,
        carried=found.carried,
        timing_s=watch.timing(),
        equations=found.equations,
        papers=found.papers,
        remarks=remarks_on(runs, trials),
    )


def _stands(chosen: ChosenModel, diagnosis: Diagnosis | None) -> bool:
    """Whether a model that was taken for an effect was found to lack that, or others that leave nothing unexplained."""
    if diagnosis is None or not diagnosis.effects:
        return False
    named = chosen.needs in {e.fitted.name for e in diagnosis.effects}
    return named or diagnosis.verdict is not Verdict.UNEXPLAINED


def _trials(
    campaign: Campaign, runs: Sequence[LoggedRun], watch: Stopwatch, by_response: bool
) -> tuple[Trial, ...]:
    """The trials of a campaign's logs."""
    with watch.during("preprocess"):
        sensors = {s.quantity: s for s in campaign.sensors}
        return make_trials(
            runs, campaign.vessel, campaign.inputs, sensors, partial(watch, "preprocess"), campaign.smoothing,
            by_response=by_response,
        )  # fmt: skip


@dataclass(frozen=True)
class ChosenModel:
    """The declared model or the one that was chosen, what to say of it, and the ``other`` where it lacks ``needs``."""

    name: str
    said: tuple[str, ...] = ()
    needs: str = ""
    other: Callable[[], ChosenModel] | None = None


def chosen_model(
    trials: Sequence[Trial], name: str, progress: Progress = silent, *, loop: bool = False
) -> ChosenModel:
    """The declared model, or what the data support where it is ``auto``.

    Where effects are looked for (``loop``), a simpler model that says as much with one of them is taken; the other
    where that effect is then not found and something stays unexplained.
    """
    if name != "auto":
        return ChosenModel(name)
    from identify.choose_model import considered

    progress("identify", "which model", 0.0)
    choice = considered(trials)
    alone = partial(_without_an_effect, trials, choice)
    if not loop:
        return alone()
    from validate.simpler_model import simpler_with_an_effect

    progress("identify", "whether an effect makes a simpler one do", 0.0)
    simpler = simpler_with_an_effect(choice)
    if simpler is None:
        return alone()
    said = () if choice.far else alone().said
    return ChosenModel(simpler.name, (*said, simpler.in_words(choice.name)), simpler.effect, alone)


def _without_an_effect(trials: Sequence[Trial], choice: Choice) -> ChosenModel:
    """The model that is chosen where no effect makes up for what others lack."""
    from identify.choice_words import choice_in_words
    from identify.choose_model import by_whole_logs

    if choice.far:
        choice = by_whole_logs(trials, choice)
    logs = sum(t.role == "identify" for t in trials)
    return ChosenModel(choice.name, (choice_in_words(choice.name, choice.table, logs),))


def read_logs(campaign: Campaign, workers: int = 1, progress: Progress = silent) -> list[Log]:
    """The logs of a campaign, in its order."""
    total = sum(entry.file.stat().st_size for entry in campaign.logs)
    logs: dict[int, Log] = {}
    progress("ingest", "", 0.0)
    read = partial(read_entry, dbc=campaign.dbc)
    for done in map_tasks(read, campaign.logs, workers if total > WORTH_PROCESSES else 1):
        logs[done.index] = done.result()
        progress("ingest", campaign.logs[done.index].path, len(logs) / len(campaign.logs))
    return [without_guesses(logs[index], campaign) for index in sorted(logs)]


def without_guesses(log: Log, campaign: Campaign) -> Log:
    """A log that says nothing of units which were guessed where the campaign states them."""
    sensors = [(s.signals.values(), s.unit) for s in campaign.sensors]
    inputs = [([i.signal], i.unit or i.pwm) for i in campaign.inputs]
    stated = {signal for signals, unit in (*sensors, *inputs) if unit for signal in signals}
    return replace(log, findings=tuple(f for f in log.findings if f.signal is None or f.signal not in stated))


def read_entry(entry: LogEntry, dbc: Path | None = None) -> Log:
    """One log as the campaign says that it is to be read."""
    return read_log(entry.file, format=entry.format, dialect=entry.dialect, dbc=dbc)


def runs_of(campaign: Campaign, logs: Sequence[Log]) -> list[LoggedRun]:
    """The logs with what the campaign says of each.

    Raises
    ------
    CampaignError
        A slice has next to nothing of its log, or its format reads no such dialect.
    """
    check_against(campaign, logs)
    return on_one_day(
        [
            LoggedRun(
                name=entry.path,
                log=log,
                role=entry.role,
                manoeuvre=entry.manoeuvre,
                start=entry.start,
                slice=entry.slice,
                depth=entry.depth,
            )
            for entry, log in zip(campaign.logs, logs, strict=True)
        ]
    )


def write(results: Results, folder: Path, progress: Progress = silent) -> None:
    """The results folder, whole or not at all."""
    from validate.report_files import write_results

    progress("write", str(folder), 0.0)
    with in_place(folder) as unfinished:
        write_results(results, unfinished)
    progress("write", str(folder), 1.0)
