"""One stream through the identification: on line as it comes, and off line as a whole."""

from __future__ import annotations

import math
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.online_streams import SUITE, recorded, sailed, vessel_for, written
from fixtures.effects import World
from fixtures.sensors import Suite
from identify.base_fit import fit_from_scratch
from identify.held_inputs import prepare_best
from identify.parameter_covariance import covariance_of
from ingest import read_log
from ingest.log import Log
from preprocess.trials import make_trials
from seatrial.campaign import Campaign, load_campaign
from seatrial.online.identifier import Identifier
from seatrial.online.recorded import batches
from seatrial.online.updates import Update
from seatrial.pipeline import runs_of

#: Vessels, and the format that their logs are written in.
FLEET = (("usv", "nmea0183"), ("catamaran", "dataflash"))
CALM = World()
#: Length of the batches in which a log is replayed where only the outcome counts, s.
BATCH_S = 1.0


def stream(
    vessel: str,
    form: str,
    changes: list[tuple[float, World]],
    seconds: float,
    seed: int,
    suite: Suite = SUITE,
) -> tuple[Campaign, Log]:
    """A campaign with the log of one run."""
    truth = sailed(vessel_for(vessel, form), changes, seconds, seed)
    with tempfile.TemporaryDirectory() as name:
        path = written(Path(name), recorded(truth, seed, suite), form)
        campaign = load_campaign(path)
        return campaign, read_log(campaign.logs[0].file)


def identified(campaign: Campaign, log: Log, until: float = math.inf) -> tuple[Identifier, list[Update]]:
    """The log through the on-line identification, up to a time; what is due goes by its time, not by the batches."""
    identifier, updates = Identifier(campaign), list[Update]()
    for tables in batches(log, BATCH_S):
        if min(int(t.index[0]) for t in tables.tables.values()) * 1e-9 > until:
            break
        updates += identifier.feed("log", tables)
    updates += identifier.finish()
    return identifier, updates


def offline(campaign: Campaign, log: Log, until: float) -> tuple[dict[str, float], np.ndarray, list[str]]:
    """Parameters of the off-line fit to the first seconds, their covariance, and their names."""
    entry = replace(campaign.logs[0], slice=(0.0, until), role="identify")
    runs = runs_of(replace(campaign, logs=(entry,)), [log])
    trials = make_trials(runs, campaign.vessel, campaign.inputs, {s.quantity: s for s in campaign.sensors})
    prepared = prepare_best(list(trials), campaign.model)
    fitted = fit_from_scratch(prepared.structure, prepared.identify)
    names = [s.name for s in fitted.solution.structure.slots]
    return dict(zip(names, fitted.solution.p, strict=True)), covariance_of(fitted), names
