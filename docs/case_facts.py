"""What a results folder and its campaign say, read back for the case studies: nothing here is remembered from a run."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from seatrial import load_model
from validate.report.names import shared_begin

CHANNELS = {"u": ("surge", "m/s", 1.0), "v": ("sway", "m/s", 1.0), "r": ("yaw rate", "°/s", 180 / np.pi)}


@dataclass(frozen=True)
class Case:
    """A campaign and the folder that its run wrote."""

    campaign: Path
    results: Path

    @cached_property
    def declared(self) -> dict:
        """campaign.toml."""
        return tomllib.loads((self.campaign / "campaign.toml").read_text(encoding="utf-8"))

    @cached_property
    def report(self) -> dict:
        """report.json."""
        return json.loads((self.results / "report.json").read_text(encoding="utf-8"))

    @cached_property
    def model(self):
        """The model with what was found."""
        return load_model(self.results)

    @cached_property
    def runs(self) -> dict[str, pd.DataFrame]:
        """Predictions by log, in the order of the campaign."""
        return {name: self._table("predictions", name) for name in self.names()}

    @cached_property
    def trials(self) -> dict[str, pd.DataFrame]:
        """Preprocessed trials by log."""
        return {name: self._table("trial", name) for name in self.names()}

    def _table(self, kind: str, name: str) -> pd.DataFrame:
        return pd.read_parquet(self.results / kind / f"{Path(name).name}.parquet")

    def names(self, role: str | None = None) -> list[str]:
        """Logs with a role, or all."""
        return [entry["path"] for entry in self.report["logs"] if role in (None, entry["role"])]

    @property
    def two(self) -> bool:
        """Whether anything was taken, so that there is a before and an after."""
        return bool(self.report["diagnosis"]["effects"])

    def spread(self, channel: str) -> float:
        """Standard deviation of a channel over all runs."""
        return float(np.nanstd(np.concatenate([t[channel].to_numpy() for t in self.runs.values()])))

    def scores(self, which: str, name: str) -> dict:
        """Scores of a log, ``before`` or ``after``."""
        return next(s["channels"] for s in self.report["validation"][which]["logs"] if s["path"] == name)


def short(names: list[str]) -> dict[str, str]:
    """Names of logs without what all of them share: ``HSVA_CPMC_KVLCC2_Z_05_01.dat`` as ``05_01``."""
    stems = [Path(n).stem for n in names]
    cut = shared_begin(stems)
    return {n: s[cut:] for n, s in zip(names, stems, strict=True)}
