"""Rows that two logs share: data given twice test nothing."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from pipeline.logs.errors import LogContentError
from pipeline.logs.reading.log import Log

#: Consecutive rows that have to agree in every number; a sensor's noise alone never does.
_RUN: Final = 8
#: Share of the shorter log's runs from which two logs count as the same data.
_SHARE: Final = 0.02


def refuse_repeats(logs: Sequence[Log]) -> None:
    """Refuse logs that hold the same rows, in whole or in part.

    Args:
        logs: Of one robot.

    Raises:
        LogContentError: Two logs share a run of rows in which a joint moves.
    """
    for a, b in combinations(logs, 2):
        if a.joints != b.joints or a.effort.channel != b.effort.channel:
            continue
        short, long = (a, b) if len(a) <= len(b) else (b, a)
        rows = shared_rows(short, long)
        if rows > max(_RUN, _SHARE * len(short)):
            raise LogContentError(
                f"{a.name} and {b.name} hold the same measurements ({rows} of {len(short)} rows): "
                "test data must be data of their own, and data given twice count twice; leave one "
                "out"
            )


def shared_rows(short: Log, long: Log) -> int:
    """Rows of a log that lie in runs which another holds too, while a joint moves."""
    keys = [_hashed(np.hstack([log.position, log.effort.values])) for log in (short, long)]
    if min(map(len, keys)) < _RUN or not np.isin(keys[0], keys[1]).any():
        return 0
    moving = (np.diff(short.position, axis=0, prepend=short.position[:1]) != 0).any(axis=1)
    runs = [_hashed(sliding_window_view(key.view(np.int64), _RUN)) for key in keys]
    same = np.isin(runs[0], runs[1])
    # A machine at rest repeats itself.
    alive = np.convolve(moving, np.ones(_RUN), mode="valid") >= _RUN / 2
    inside = np.convolve(same & alive, np.ones(_RUN), mode="full") > 0
    return int(inside.sum())


def _hashed(table: NDArray[np.float64] | NDArray[np.int64]) -> NDArray[np.uint64]:
    """A number per row (N,) that equal rows share and others hardly ever."""
    import pandas as pd

    hashes = pd.util.hash_pandas_object(pd.DataFrame(table), index=False)
    return np.asarray(hashes, dtype=np.uint64)
