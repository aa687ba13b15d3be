"""A velocity is that of the receiver that positions come from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ingest.log import Log, Source
from preprocess.resolve import of_one_receiver
from preprocess.run_of_log import LoggedRun
from preprocess.trials import gather
from preprocess.vessel import Sensor, Vessel

BOAT = Vessel("boat", length=4.0, beam=1.5)
FIELDS = {"north": "vn", "east": "ve"}


def two_receivers(own_velocity=True) -> Log:
    """Two instances of one message, the second of which is the quicker; each knows its velocity."""
    tables, sources = {}, []
    for k, topic in enumerate(("gps", "gps[1]")):
        t = pd.Index(np.arange(0, 20_000_000_000, 500_000_000 // (1 + k)), name="t")
        n = len(t)
        tables[topic] = pd.DataFrame(
            {"lat": 50.0 + 1e-6 * np.arange(n), "lon": np.full(n, 8.0), "vn": np.full(n, 1.0 + k), "ve": np.zeros(n),
             "psi": np.zeros(n), "source": k}, index=t,
        )  # fmt: skip
        where = {"latitude": "lat", "longitude": "lon"}
        sources.append(Source("position", topic, where, "deg", k, 50.0 + k))
        if k or own_velocity:
            sources.append(Source("velocity", topic, FIELDS, "m/s", k, 50.0 + k))
    sources.append(Source("heading", "gps", {"value": "psi"}, "rad", None, 1.0))
    return Log(Path("a.ulg"), "ulog", tables, {}, sources=tuple(sources))


def velocity_in(log, **sensors):
    run = LoggedRun("a", log, "identify")
    raw = gather(run, BOAT, (), sensors).sensors.get("velocity")
    return None if raw is None else float(raw.value[0, 0])


@pytest.mark.parametrize("device", [0, 1])
def test_it_is_the_velocity_of_the_receiver_whose_positions_are_declared(device):
    assert velocity_in(two_receivers(), position=Sensor("position", source=device)) == 1.0 + device


def test_without_a_word_both_are_the_best_receiver_s():
    assert velocity_in(two_receivers()) == 2.0


def test_there_is_none_where_another_receiver_alone_measures_one():
    assert velocity_in(two_receivers(own_velocity=False), position=Sensor("position", source=0)) is None


def test_what_a_campaign_says_of_the_velocity_is_done():
    declared = {"position": Sensor("position", source=0), "velocity": Sensor("velocity", source=1)}
    assert velocity_in(two_receivers(), **declared) == 2.0
    assert velocity_in(two_receivers(), **(declared | {"velocity": Sensor("velocity", offset=0.0)})) == 1.0


def test_a_velocity_of_another_kind_is_no_other_receiver_s():
    log = two_receivers()
    filtered = Source("velocity", "filter", FIELDS, "m/s", None, 40.0)
    log.tables["filter"] = log.tables["gps"]
    assert of_one_receiver(log, filtered, "gps[0]") is filtered
