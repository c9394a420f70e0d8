"""How one channel was sampled: lattice, held, interpolated, frozen or saturated values, jumps."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.ndimage import median_filter, percentile_filter

from actuators.arrays import Array, Mask
from pipeline.logs.grid import runs_of

#: Rows looked at for the lattice of values.
LATTICE_ROWS: Final = 100_000
#: Half-width of the window in which a channel's mean change per row is taken.
WINDOW: Final = 20
#: Share of repeats from which a channel counts as held.
HELD: Final = 0.1
#: Share of values on a lattice from which a channel is a rounded sensor's own.
ROUNDED: Final = 0.8
#: Rows of the median that ramps and steps pass: what lasts up to five rows is passed over.
_MEDIAN: Final = 11
#: Rows over which the usual change from row to row is taken.
_NEAR: Final = 41
#: Distance from the median in usual changes, and in rows at the channel's fastest pace.
_CHANGES, _ROWS = 12.0, 6.0
#: Chance at which a live channel may look frozen somewhere in a log.
_CHANCE: Final = 1e-6
#: Rows that hold one value are looked at from this many on.
_LEAST_RUN: Final = 20
#: Share of a moving channel's rows on a straight line between their neighbours from which on rows
#: were interpolated; noise and rounding of a sensor leave hardly any.
_STRAIGHT: Final = 0.4
#: Share of those rows in stretches of one length, a row more or less.
_PACE: Final = 0.6
#: Distance from that line, in usual changes from row to row.
_ON_LINE: Final = 1e-4


def is_constant(x: Array) -> bool:
    """Whether a series (N,) holds one number and nothing else but empty cells."""
    x = x[np.isfinite(x)]
    return x.size > 0 and bool((x == x[0]).all())


def quantum(x: Array) -> tuple[float, float]:
    """Step of a quantised channel (N,) and the share of values on its lattice; zeros for none."""
    part = x[: LATTICE_ROWS + 1]
    part = part[np.isfinite(part)]
    values, counts = np.unique(part, return_counts=True)
    # A log that was interpolated after sampling still rests on the values of the sensor.
    often = counts >= 5
    share = float(counts[often].sum()) / max(part.size, 1)
    if 3 <= values.size < 0.5 * part.size and (lattice := _lattice(values))[1] > 0.9:
        return lattice
    if values.size >= 3 and often.sum() >= 5 and share > 0.2:
        step, whole = _lattice(values[often])
        if whole > 0.6:
            return step, whole * share
    return 0.0, 0.0


def _lattice(values: Array) -> tuple[float, float]:
    """Usual spacing of sorted values and the share of spacings that are whole multiples."""
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-9 * (values[-1] - values[0])]
    step = float(np.quantile(gaps, 0.1))
    return step, float(np.mean(np.abs(gaps / step - np.round(gaps / step)) < 0.05))


def new_values(time: Array, x: Array) -> float:
    """How often a channel takes a new value, by the median over its changes [Hz]; inf for never.

    A rounded channel of speed v and step d does v / d times a second, and its error is a sawtooth
    of that frequency: a filter that lets it pass shows the steps, and no speed between them.
    """
    changes = time[1:][np.diff(x) != 0]
    if changes.size == 0:
        return np.inf
    return 1.0 / float(np.median(np.diff(changes) if changes.size > 1 else np.ptp(time)))


def held(x: Array, step: float) -> Mask:
    """Rows (N,) that repeat the one before and that no rounding to `step` explains.

    Where a channel changes by more than two of its quanta per row on average, every row should
    differ from the one before, but for those that rounding makes alike: no more rows than differ by
    one smallest step. None where fewer than `HELD` of those rows repeat.
    """
    none = np.zeros(x.size, dtype=np.bool_)
    if x.size <= 4 * WINDOW:
        return none
    pace = _pace(x, WINDOW)
    fast = pace > max(2.0 * step, 0.1 * float(np.quantile(pace, 0.95)), 1e-12)
    if fast.sum() < 50:
        return none
    change = np.abs(np.diff(x, prepend=np.nan))
    repeats = (change == 0) & fast
    steps = change[fast & (change > 0)]
    by_chance = int((steps < 1.5 * float(np.quantile(steps, 0.01))).sum()) if steps.size else 0
    count = int(repeats.sum())
    enough = count > 1.5 * by_chance + 4.0 * np.sqrt(count) and repeats[fast].mean() > HELD
    return repeats if enough else none


def _pace(x: Array, w: int) -> Array:
    """Mean change per row over a window of w rows to either side, (N,); zero where unknown."""
    change = np.abs(x[2 * w :] - x[: -2 * w]) / (2 * w)
    return np.nan_to_num(np.pad(change, w, mode="edge"))


def interpolated(time: Array, x: Array) -> Mask:
    """Rows (N,) on the straight line between their neighbours; none in a sensor's own log.

    All false where fewer rows than `_STRAIGHT` of the moving ones do.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    change = np.abs(np.diff(x))
    alive = change[change > 0]
    if alive.size < 10:
        return out
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    away = np.abs(x[1:-1] - (1.0 - share) * x[:-2] - share * x[2:])
    moving = (change[1:] > 0) | (change[:-1] > 0)
    straight = (away < _ON_LINE * float(np.median(alive))) & moving
    if straight.sum() < max(_STRAIGHT * moving.sum(), 10):
        return out
    # Samples between which lines were drawn come at one pace; steps of a rounded sensor do not.
    starts, stops = runs_of(straight)
    length = stops - starts
    usual = float(np.median(np.repeat(length, length)))
    if usual >= 3 and length[np.abs(length - usual) <= 1].sum() >= _PACE * straight.sum():
        out[1:-1] = straight
    return out


def saturated(x: Array, moving: Mask, step: float) -> Mask:
    """Rows (N,) at a channel's largest or smallest value where it sticks there while moving.

    A peak passes through its neighbourhood; a limit collects rows at one value. Where the channel
    is quantised in steps, more must lie at the limit than just inside it; where it is not, no value
    comes back by chance.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    good = np.isfinite(x) & moving
    for limit in (x[good].min(), x[good].max()) if good.sum() >= 50 else ():
        away = np.abs(x - limit)
        at = good & (away <= 0.5 * step)
        inside = good & ~at & (away < 4.5 * step)
        runs = at[2:] & at[1:-1] & at[:-2]
        if at.sum() >= 20 and runs.any() and (step == 0 or at.sum() > 2 * inside.sum()):
            # Known to be a limit, it counts at standstill, too.
            out |= away <= 0.5 * step
    return out


def frozen(x: Array, moving: Mask) -> Mask:
    """Rows of an effort (N,) that hold one value longer than chance allows while the joint moves.

    A live channel repeats a value with some probability p from row to row (rounding, or a rate of
    its own); n repeats in a row come by chance p^n times.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    if moving.sum() < 2 * _LEAST_RUN:
        return out
    starts, stops = runs_of(np.concatenate([[False], (x[1:] == x[:-1]) & moving[1:]]))
    length = stops - starts
    usual = length < max(_LEAST_RUN, int(np.quantile(length, 0.9)) if length.size else 0)
    repeats = float(length[usual].sum()) / max(float(moving.sum() - length[~usual].sum()), 1.0)
    p = min(max(repeats, 1.0 / x.size), 1.0 - 1e-9)
    longest = max(_LEAST_RUN, int(np.ceil(np.log(_CHANCE / x.size) / np.log(p))))
    for k in np.flatnonzero(length >= longest):
        out[starts[k] : stops[k]] = True
    return out


def glitches(x: Array) -> Mask:
    """Rows of a series (N,) that jump away and back, further than noise and its own pace explain.

    A median over a few rows follows ramps and steps exactly and passes over what lasts less than
    half of it; NaN rows are no glitches.
    """
    out = np.zeros(x.size, dtype=np.bool_)
    good = np.flatnonzero(np.isfinite(x))
    if good.size < 2 * _NEAR:
        return out
    y = x[good]
    away = np.abs(y - median_filter(y, _MEDIAN, mode="mirror"))
    # Most channels have none: the local pace is computed where something stands out at all.
    least = _ROWS * float(np.abs(y[_MEDIAN + 1 :] - y[: -_MEDIAN - 1]).max()) / (_MEDIAN + 1)
    if (away > least).any():
        change = np.abs(np.diff(y, prepend=y[0]))
        usual = percentile_filter(change, 75, _NEAR, mode="mirror")
        out[good] = away > least + _CHANGES * usual
    return out


def standstill(q: Array) -> Mask:
    """Rows (N,) in which a joint moves at less than 1 % of its usual top speed.

    Empty cells of positions [rad] take the last value before them.
    """
    known = np.where(np.isfinite(q), np.arange(q.size), 0)
    pace = _pace(np.nan_to_num(q[np.maximum.accumulate(known)]), max(1, min(WINDOW, q.size // 8)))
    # A short excursion still counts as motion, a single jump does not.
    return np.asarray(pace <= 0.01 * np.quantile(pace, 0.98))
