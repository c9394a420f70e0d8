"""How a log and its channels were sampled: grid, pieces between gaps, own rates, odd values.

A column may be slower than its log: most cells empty, each value held for several rows, or rows
interpolated between samples afterwards. What lies above a quarter of its own rate is not in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, percentile_filter

from actuators.arrays import Array, Mask

Rows = NDArray[np.intp]
#: A step this many times the usual one is a gap; the filter never runs across it.
GAP: Final = 2.5
#: Times that lie this near to the grid, in steps, need no interpolation.
JITTER_IGNORED: Final = 0.05
#: Spectra and noise are taken from at most this many stretches of this many rows.
STRETCHES: Final = 8
STRETCH_ROWS: Final = 16_384
#: Rows between two looked at: the speed of a robot changes little within them.
EVERY: Final = 8
#: Share of a log's time that may lie in longer steps: those are gaps, not the channel's rate ...
_IN_GAPS: Final = 0.02
#: ... as are steps this many times longer than the usual one.
_LONG: Final = 20.0
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


@dataclass(frozen=True)
class Grid:
    """A uniform grid."""

    time: Array  #: Shape (M,) [s].
    pieces: tuple[slice, ...]  #: Stretches without a gap, slices of the grid's rows.
    left: Rows  #: Row of the log to the left of each grid time, shape (M,).
    share: Array | None = None  #: Weight of the row to the right, (M,); None where rows lie on it.

    @property
    def nearest(self) -> Rows:
        """Nearest row of the log, shape (M,)."""
        return self.left if self.share is None else self.left + (self.share > 0.5)

    def resample(self, values: Array) -> Array:
        """Values of the log's rows (N, ...) on the grid by straight lines; NaN stays NaN."""
        if self.share is None:
            return np.array(values)
        weight = self.share.reshape(-1, *(1,) * (values.ndim - 1))
        below, above = values[self.left], values[np.minimum(self.left + 1, values.shape[0] - 1)]
        # Where the weight is zero a missing neighbour does not matter.
        return np.where(weight == 0, below, (1 - weight) * below + weight * above)

    def flags(self, flag: Mask) -> Mask:
        """A flag of the log's rows (N,) on the grid: set where either neighbour has it."""
        if self.share is None:
            return np.array(flag)
        right = np.minimum(self.left + 1, flag.size - 1)
        return np.asarray(flag[self.left] | (flag[right] & (self.share > 0)))


def uniform_grid(time: Array, dt: float, *, bridge: float = 0.0) -> Grid:
    """Lay a uniform grid of steps `dt` [s] under a log.

    The log's own rows where each piece is uniform to within `JITTER_IGNORED` steps, else a grid to
    interpolate on, through the first time; steps up to `bridge` [s] are no gaps.
    """
    cuts = np.flatnonzero(np.diff(time) > max(GAP * dt, bridge)) + 1
    pieces = [slice(a, b) for a, b in pairwise([0, *cuts.tolist(), time.size])]
    if all(_is_uniform(time[piece], dt) for piece in pieces):
        return Grid(time, tuple(pieces), np.arange(time.size, dtype=np.intp))
    times = []
    for part in (time[piece] for piece in pieces):
        first = int(np.ceil((part[0] - time[0]) / dt - 1e-9))
        last = int(np.floor((part[-1] - time[0]) / dt + 1e-9))
        if last >= first:
            grid = time[0] + dt * np.arange(first, last + 1)
            times.append(np.clip(grid, part[0], part[-1]))
    whole, ends = np.concatenate(times), np.cumsum([0, *map(len, times)]).tolist()
    left = np.clip(np.searchsorted(time, whole, side="right") - 1, 0, time.size - 2)
    share = (whole - time[left]) / (time[left + 1] - time[left])
    slices = tuple(slice(a, b) for a, b in pairwise(ends))
    return Grid(whole, slices, left.astype(np.intp), share)


def _is_uniform(time: Array, dt: float) -> bool:
    # A rate that is off by a little is no jitter: compare with the piece's own step too.
    own = (time[-1] - time[0]) / max(time.size - 1, 1)
    steps = [dt, own] if abs(own / dt - 1.0) < 1e-3 else [dt]
    rows = np.arange(time.size)
    return any(np.abs(time - time[0] - s * rows).max() <= JITTER_IGNORED * dt for s in steps)


def fill_gaps(time: Array, x: Array, ok: Mask) -> Array:
    """Bad values (N,) interpolated from good ones; zero where there is none."""
    good = ok & np.isfinite(x)
    if good.all():
        return x
    return np.interp(time, time[good], x[good]) if good.any() else np.zeros(x.size)


def most_telling(tells: Array, count: int) -> list[int]:
    """Numbers of the stretches of a log that tell most: half of them, and half spread evenly.

    A joint that moves in one minute of an hour is thus seen.

    Args:
        tells: What each tells of every quantity, such as variances, shape (S, Q).
        count: Most of them.
    """
    score = (tells / np.maximum(tells.mean(axis=0), 1e-300)).sum(axis=1)
    alive = np.flatnonzero(score > 0)
    best = alive[np.argsort(-score[alive], kind="stable")[: count // 2]]
    others = np.setdiff1d(alive, best)
    places = np.linspace(0, max(others.size - 1, 0), count - best.size).astype(int)
    return sorted({*best.tolist(), *others[places[: others.size]].tolist()})


def busiest(coarse: Array, pieces: Sequence[slice]) -> list[slice]:
    """Stretches of a long log that are enough to know its spectrum and noise.

    The pieces themselves where they are short, else up to `STRETCHES` of `STRETCH_ROWS` rows.
    `coarse` is every `EVERY`-th row of the log, shape (N / EVERY, C).
    """
    if sum(p.stop - p.start for p in pieces) <= STRETCHES * STRETCH_ROWS:
        return list(pieces)
    parts = cut(pieces, STRETCH_ROWS, whole=True)
    if not parts:
        return sorted(pieces, key=lambda p: p.stop - p.start)[-STRETCHES:]
    own = [coarse[p.start // EVERY : p.stop // EVERY] for p in parts]
    change = np.stack([np.nanmean(np.diff(x, axis=0) ** 2, axis=0) for x in own])
    return [parts[k] for k in most_telling(change, STRETCHES)]


def cut(pieces: Sequence[slice], rows: int, *, whole: bool = False) -> list[slice]:
    """Pieces in stretches of so many rows; those that are shorter too, unless `whole`."""
    return [
        slice(start, min(start + rows, p.stop))
        for p in pieces
        for start in range(p.start, p.stop - (rows - 1) * whole, rows)
    ]


def runs_of(flag: Mask) -> tuple[Rows, Rows]:
    """First rows, and rows after the last, of the stretches in which a flag (N,) is set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flag.astype(np.int8), [0]])))
    return edges[::2], edges[1::2]


def long_runs(time: Array, bad: Mask, longest: float) -> Mask:
    """Bad samples (N,) except runs between good ones up to `longest` [s], as held repeats are."""
    out = np.zeros(bad.size, dtype=np.bool_)
    starts, stops = runs_of(bad)
    lasts = time[np.minimum(stops, time.size - 1)] - time[np.maximum(starts - 1, 0)]
    keep = (starts == 0) | (stops == time.size) | (lasts > longest)
    for start, stop in zip(starts[keep], stops[keep], strict=True):
        out[start:stop] = True
    return out


def own_spacing(time: Array, ok: Mask) -> float:
    """Step between good samples [s] that all but `_IN_GAPS` of the time keeps to; inf for none."""
    step = np.sort(np.diff(time[ok]))
    if step.size == 0:
        return np.inf
    step = step[: np.searchsorted(step, _LONG * step[step.size // 2], side="right")]
    passed = np.cumsum(step)
    return float(step[int(np.searchsorted(passed, (1.0 - _IN_GAPS) * passed[-1]))])


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
