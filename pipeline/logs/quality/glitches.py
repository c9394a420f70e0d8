"""Samples that jump away and back: a sensor's or a bus's error, no motion.

A median over a few rows follows ramps and steps exactly and passes over what lasts less than half
of it. What lies further from it than noise and the channel's own pace explain is a glitch.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, percentile_filter

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Rows of the median: what lasts up to five rows is passed over, two at the ends of a log.
_WINDOW: Final = 11
#: Rows over which the usual change from row to row is taken.
_NEAR: Final = 41
#: Distance from the median in usual changes, and in rows at the channel's fastest pace.
_CHANGES: Final = 12.0
_ROWS: Final = 6.0


def glitches(x: Array) -> Mask:
    """Rows of a series (N,) that jump away and back; NaN rows are none."""
    out = np.zeros(x.size, dtype=np.bool_)
    good = np.flatnonzero(np.isfinite(x))
    if good.size < 2 * _NEAR:
        return out
    y = x[good]
    away = np.abs(y - median_filter(y, _WINDOW, mode="mirror"))
    # Most channels have none: the local pace is computed where something stands out at all.
    pace = np.abs(y[_WINDOW + 1 :] - y[: -_WINDOW - 1]).max() / (_WINDOW + 1)
    least = _ROWS * pace
    if not (away > least).any():
        return out
    change = np.abs(np.diff(y, prepend=y[0]))
    usual = percentile_filter(change, 75, _NEAR, mode="mirror")
    out[good] = away > least + _CHANGES * usual
    return out
