"""Tables of a log, by seconds, for tests."""

from __future__ import annotations

import numpy as np
import pandas as pd

SECOND = 1_000_000_000


def table(t_s, **columns) -> pd.DataFrame:
    return pd.DataFrame(columns, index=pd.Index((np.asarray(t_s) * SECOND).astype(np.int64)))
