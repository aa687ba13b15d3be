"""What a port's tables look like: judged by all that came in the last seconds, since a batch may hold one record."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ingest.log import Source

if TYPE_CHECKING:
    import pandas as pd

#: Tables are looked at over so long; when a topic is new, and every so often; what nobody knows is strange after, ns.
KEPT_NS, AGAIN_NS, SETTLED_NS = 5_000_000_000, 1_000_000_000, 2_000_000_000
#: Records without which a topic is not looked at, as the rules want it.
FEWEST = 2


@dataclass
class Recognised:
    """What was recognised in what a port sends.

    Attributes
    ----------
    detect : callable
        Sources in tables of some length: that of the log readers.
    sources : tuple of Source
        Of all that came lately, whether or not it is in the last batch.
    settled : bool
        Whether so much has come that what is not among the sources is nothing known.
    """

    detect: Callable[[Mapping[str, pd.DataFrame]], tuple[Source, ...]]
    sources: tuple[Source, ...] = ()
    settled: bool = False
    _recent: dict[str, deque[pd.DataFrame]] = field(default_factory=dict)
    _first_ns: int | None = None
    _looked_ns: int = 0

    def add(self, tables: Mapping[str, pd.DataFrame]) -> None:
        """Take a batch into account."""
        stamps = [int(t.index[-1]) for t in tables.values() if len(t)]
        if not stamps:
            return
        now = max(stamps)
        self._first_ns = now if self._first_ns is None else self._first_ns
        self.settled = now - self._first_ns >= SETTLED_NS
        new = [self._keep(topic, table) for topic, table in tables.items()]
        if any(new) or now - self._looked_ns >= AGAIN_NS:
            self._looked_ns = now
            self.sources = self.detect({k: _joined(v, now - KEPT_NS) for k, v in self._recent.items()})

    def _keep(self, topic: str, table: pd.DataFrame) -> bool:
        """Keep a topic's rows; whether there are now enough of them for the first time."""
        parts = self._recent.setdefault(topic, deque())
        before = sum(map(len, parts)) if len(parts) < FEWEST else FEWEST
        parts.append(table)
        return before < FEWEST <= before + len(table)


def _joined(parts: deque[pd.DataFrame], since_ns: int) -> pd.DataFrame:
    """The rows of a topic as one table; those before a time are forgotten, but for the last few."""
    import pandas as pd

    if len(parts) > 1:
        whole = pd.concat(parts)
        first = min(int(whole.index.searchsorted(since_ns)), len(whole) - FEWEST)
        parts.clear()
        parts.append(whole.iloc[max(first, 0) :])
    return parts[0]
