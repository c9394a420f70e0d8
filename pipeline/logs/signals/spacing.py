"""How densely a channel was really sampled, whatever the rate of the rows it stands in.

A column may be slower than its log: most cells empty, each value held for several rows, or rows
interpolated between samples afterwards. What lies above a quarter of its own rate is not in it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.signals.grid import runs_of

#: Share of a log's time that may lie in longer steps: those are gaps, not the channel's rate.
_IN_GAPS: Final = 0.02
#: Steps this many times longer than the usual one are gaps.
_GAP: Final = 20.0
#: Share of a moving channel's rows on a straight line between their neighbours from which on rows
#: were interpolated; noise and rounding of a sensor leave hardly any.
_STRAIGHT: Final = 0.4
#: Share of those rows in stretches of one length, a row more or less.
_PACE: Final = 0.6
#: Distance from that line, in usual changes from row to row.
_ON_LINE: Final = 1e-4


def own_spacing(time: Array, ok: Mask) -> float:
    """Step between good samples [s] that all but `_IN_GAPS` of the time keeps to; inf for none."""
    step = np.sort(np.diff(time[ok]))
    if step.size == 0:
        return np.inf
    step = step[: np.searchsorted(step, _GAP * step[step.size // 2], side="right")]
    passed = np.cumsum(step)
    return float(step[int(np.searchsorted(passed, (1.0 - _IN_GAPS) * passed[-1]))])


def interpolated(time: Array, x: Array) -> Mask:
    """Rows (N,) that lie on the straight line between their neighbours; none in a sensor's own log.

    All false where fewer rows than `_STRAIGHT` of the moving ones do.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    if x.size < 10:
        return out
    change = np.abs(np.diff(x))
    alive = change[np.isfinite(change) & (change > 0)]
    if alive.size < 10:
        return out
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    away = np.abs(x[1:-1] - (1.0 - share) * x[:-2] - share * x[2:])
    moving = (change[1:] > 0) | (change[:-1] > 0)
    with np.errstate(invalid="ignore"):
        straight = away < _ON_LINE * float(np.median(alive))
    straight &= moving
    if straight.sum() < max(_STRAIGHT * moving.sum(), 10):
        return out
    # Samples between which lines were drawn come at one pace; steps of a rounded sensor do not.
    starts, stops = runs_of(straight)
    length = stops - starts
    usual = float(np.median(np.repeat(length, length)))
    if usual < 3 or length[np.abs(length - usual) <= 1].sum() < _PACE * straight.sum():
        return out
    out[1:-1] = straight
    return out
